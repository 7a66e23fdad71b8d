use proptest::prelude::{Strategy, prop, prop_assert, proptest};

use super::*;
use crate::hand::joint::JointId;
use crate::hand::skeleton::mirrored_point;

const TIP: usize = 3;

pub(crate) fn any_angles() -> impl Strategy<Value = JointAngles> {
    let thumb = (-0.3..1.7f64, 0.0..1.3f64, -0.3..1.2f64, -0.4..1.5f64).prop_map(
        |(opposition, abduction, mcp_flexion, ip_flexion)| ThumbAngles {
            opposition,
            abduction,
            mcp_flexion,
            ip_flexion,
        },
    );
    let finger = (-0.5..1.6f64, 0.0..1.9f64, -0.3..1.5f64, -0.4..0.4f64).prop_map(
        |(mcp_flexion, pip_flexion, dip_flexion, abduction)| FingerAngles {
            mcp_flexion,
            pip_flexion,
            dip_flexion,
            abduction,
        },
    );
    (thumb, prop::array::uniform4(finger), 0.0..0.6f64).prop_map(|(thumb, fingers, palm_arch)| {
        JointAngles {
            thumb,
            fingers,
            palm_arch,
        }
    })
}

fn point(points: &[Point3<f64>; N_JOINTS], finger: Finger, from_palm: usize) -> Point3<f64> {
    points[JointId::of(finger, from_palm).index()]
}

/// Grip: thumb opposed, index and middle bent.
fn grip(
    opposition: f64,
    abduction: f64,
    thumb: (f64, f64),
    finger: (f64, f64, f64),
) -> JointAngles {
    let bent = FingerAngles {
        mcp_flexion: finger.0,
        pip_flexion: finger.1,
        dip_flexion: finger.2,
        abduction: 0.0,
    };
    JointAngles {
        thumb: ThumbAngles {
            opposition,
            abduction,
            mcp_flexion: thumb.0,
            ip_flexion: thumb.1,
        },
        fingers: [bent; 4],
        palm_arch: 0.0,
    }
}

/// The pose nearest to `gap` metres between the thumb's and the index finger's tips, over a coarse grid of natural angles.
fn nearest_grip(gap: f64) -> (f64, JointAngles) {
    let skeleton = Skeleton::adult(Side::Right);
    let mut best = (f64::INFINITY, JointAngles::default());
    for steps in 0..7 * 8 * 6 * 8 {
        let f = |count: usize, low: f64, high: f64, k: usize| {
            low + (high - low) * k as f64 / (count - 1) as f64
        };
        let abduction = f(7, 0.1, 1.15, steps % 7);
        let flexion = f(8, 0.0, 0.9, steps / 7 % 8);
        let mcp = f(6, 0.3, 1.2, steps / 56 % 6);
        let pip = f(8, 0.2, 1.4, steps / 336 % 8);
        let angles = grip(0.9, abduction, (flexion, flexion), (mcp, pip, 0.5 * pip));
        let points = forward(&skeleton, Side::Right, &angles);
        let apart = point(&points, Finger::Index, TIP) - point(&points, Finger::Thumb, TIP);
        // Tips apart across the gap, along y.
        let error = (apart - Vector3::new(0.0, gap, 0.0)).norm();
        if error < best.0 {
            best = (error, angles);
        }
    }
    best
}

#[test]
fn a_flat_hand_points_along_minus_z() {
    for side in [Side::Left, Side::Right] {
        let points = forward(&Skeleton::adult(side), side, &JointAngles::default());
        let middle = point(&points, Finger::Middle, TIP);
        assert!(
            (middle.z + 0.196).abs() < 1e-9 && middle.y.abs() < 1e-9,
            "{middle}"
        );
        let thumb = point(&points, Finger::Thumb, TIP);
        assert!((thumb.x < 0.0) == (side == Side::Right), "{side:?} {thumb}");
    }
}

#[test]
fn flexion_bends_to_the_palm_and_abduction_spreads() {
    let skeleton = Skeleton::adult(Side::Right);
    let flat = forward(&skeleton, Side::Right, &JointAngles::default());
    let mut angles = JointAngles::default();
    for finger in &mut angles.fingers {
        finger.mcp_flexion = std::f64::consts::FRAC_PI_2;
    }
    let bent = forward(&skeleton, Side::Right, &angles);
    for finger in &Finger::ALL[1..] {
        let (base, tip) = (point(&bent, *finger, 0), point(&bent, *finger, TIP));
        let length: f64 = skeleton.finger(*finger).lengths.iter().sum();
        assert!(
            (tip - (base - Vector3::y() * length)).norm() < 1e-12,
            "{finger:?} {tip}"
        );
    }
    let mut angles = JointAngles::default();
    for finger in &mut angles.fingers {
        finger.abduction = 0.3;
    }
    let spread = forward(&skeleton, Side::Right, &angles);
    // A right hand's thumb is at -x: index and middle swing there, ring and little away from it.
    for (finger, toward_thumb) in [
        (Finger::Index, true),
        (Finger::Middle, true),
        (Finger::Ring, false),
        (Finger::Little, false),
    ] {
        let moved = point(&spread, finger, TIP).x - point(&flat, finger, TIP).x;
        assert_eq!(moved < -0.01, toward_thumb, "{finger:?} {moved}");
        assert!(moved.abs() > 0.01);
    }
}

#[test]
fn opposition_turns_the_thumb_across_the_palm_and_the_arch_folds_the_little_finger() {
    let skeleton = Skeleton::adult(Side::Right);
    let tip = |opposition| {
        point(
            &forward(
                &skeleton,
                Side::Right,
                &grip(opposition, 0.8, (0.0, 0.0), (0.0, 0.0, 0.0)),
            ),
            Finger::Thumb,
            TIP,
        )
    };
    assert!(tip(0.9).y < tip(0.0).y - 0.01 && tip(0.9).x > tip(0.0).x + 0.01);
    let arch = JointAngles {
        palm_arch: 0.5,
        ..JointAngles::default()
    };
    let folded = point(&forward(&skeleton, Side::Right, &arch), Finger::Little, 0);
    let rest = skeleton.finger(Finger::Little).base;
    assert!(
        folded.y < rest.y - 0.005 && folded.x < rest.x,
        "{folded} {rest}"
    );
}

#[test]
fn thumb_and_index_pinch_and_hold_a_cube() {
    for gap in [0.0, 0.04, 0.05, 0.06] {
        let (error, angles) = nearest_grip(gap);
        assert!(error < 0.008, "gap {gap}: {error} m off at {angles:?}");
    }
}

proptest! {
    #[test]
    fn links_keep_their_lengths(angles in any_angles()) {
        let skeleton = Skeleton::adult(Side::Right);
        let points = forward(&skeleton, Side::Right, &angles);
        for finger in Finger::ALL {
            for link in 0..LINKS_PER_FINGER {
                let length = (point(&points, finger, link + 1) - point(&points, finger, link)).norm();
                prop_assert!((length - skeleton.finger(finger).lengths[link]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_left_hand_is_the_mirror_image(angles in any_angles()) {
        let right = forward(&Skeleton::adult(Side::Right), Side::Right, &angles);
        let left = forward(&Skeleton::adult(Side::Left), Side::Left, &angles);
        for (r, l) in right.iter().zip(&left) {
            prop_assert!((mirrored_point(r) - l).norm() < 1e-12, "{r} {l}");
        }
    }

    #[test]
    fn angles_of_points_give_the_points_back(angles in any_angles(), is_left in prop::bool::ANY, size in 0.8..1.2f64) {
        let side = if is_left { Side::Left } else { Side::Right };
        let skeleton = Skeleton::adult(side).scaled(size);
        let points = forward(&skeleton, side, &angles);
        let again = forward(&skeleton, side, &angles_from_points(&skeleton, side, &points));
        for (a, b) in points.iter().zip(&again) {
            prop_assert!((a - b).norm() < 1e-9, "{a} {b}");
        }
    }
}

#[test]
fn links_without_length_have_defined_angles() {
    let angles = angles_from_points(
        &Skeleton::adult(Side::Right),
        Side::Right,
        &[Point3::origin(); N_JOINTS],
    );
    assert!(angles.is_finite());
    assert_eq!(angles.fingers[0].mcp_flexion, angles.fingers[1].mcp_flexion);
    assert_eq!(angles.fingers[0].pip_flexion, 0.0);
}
