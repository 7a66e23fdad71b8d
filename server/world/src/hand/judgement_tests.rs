use nalgebra::{Translation3, UnitQuaternion, Vector3};
use proptest::prelude::{Strategy, prop, prop_assert, proptest};

use super::*;
use crate::hand::joint::{LINKS_PER_FINGER, Side};
use crate::hand::kinematics::tests::any_angles;
use crate::hand::sample::JointAngles;
use crate::hand::skeleton::{Skeleton, mirrored_point};

fn posed(model: &HandModel, wrist: Isometry3<f64>, angles: JointAngles) -> PosedHand {
    let mut out = PosedHand::default();
    let sample = HandSample {
        wrist,
        fingers: FingerPose::Angles(angles),
    };
    pose_hand(model, &sample, &mut JointMemory::default(), &mut out);
    out
}

fn any_pose() -> impl Strategy<Value = Isometry3<f64>> {
    (
        prop::array::uniform3(-1.0..1.0f64),
        prop::array::uniform3(-3.0..3.0f64),
    )
        .prop_map(|(place, turn)| Isometry3::new(Vector3::from(place), Vector3::from(turn)))
}

fn model(prism_sides: u32, palm_contacts: bool) -> HandModel {
    HandModel {
        prism_sides,
        palm_contacts,
        ..HandModel::adult(Side::Right)
    }
}

#[test]
fn counts_follow_the_layout() {
    for (sides, palm, n_points, n_segments) in
        [(4, false, 20, 60), (3, false, 20, 45), (8, true, 28, 152)]
    {
        let model = model(sides, palm);
        let hand = posed(&model, Isometry3::identity(), JointAngles::default());
        assert_eq!(
            (hand.points.len(), hand.point_valid.len()),
            (n_points, n_points)
        );
        assert_eq!(
            (hand.segments.len(), hand.segment_valid.len()),
            (n_segments, n_segments)
        );
        assert_eq!(PartLayout::of(&model).n_segments(), n_segments);
        assert!(hand.segment_valid.iter().all(|v| *v));
    }
}

#[test]
fn the_first_ridge_of_a_flat_finger_is_on_its_palmar_side() {
    for side in [Side::Left, Side::Right] {
        let hand = posed(
            &HandModel::adult(side),
            Isometry3::identity(),
            JointAngles::default(),
        );
        let middle = JointId::of(Finger::Middle, 0).index();
        let start = PartLayout::of(&HandModel::adult(side))
            .segments_of(Finger::Middle)
            .start;
        let offset = hand.segments[start][0] - hand.points[middle];
        assert!(
            (offset - Vector3::new(0.0, -0.010, 0.0)).norm() < 1e-12,
            "{side:?} {offset}"
        );
        let ulnar = hand.segments[start + 1][0] - hand.points[middle];
        let toward_little = if side == Side::Right { 0.010 } else { -0.010 };
        assert!(
            (ulnar - Vector3::new(toward_little, 0.0, 0.0)).norm() < 1e-12,
            "{side:?} {ulnar}"
        );
    }
}

#[test]
fn a_joint_not_tracked_keeps_its_place_in_the_wrists_space() {
    let model = model(4, false);
    let mut memory = JointMemory::default();
    let mut out = PosedHand::default();
    let places = forward(
        &Skeleton::adult(Side::Right),
        Side::Right,
        &JointAngles::default(),
    );
    let mut points: [Option<Point3<f64>>; N_JOINTS] = places.map(Some);
    points[5] = None;
    let sample = |wrist, points| HandSample {
        wrist,
        fingers: FingerPose::Points(points),
    };
    pose_hand(
        &model,
        &sample(Isometry3::identity(), points),
        &mut memory,
        &mut out,
    );
    assert!(!out.point_valid[5] && out.point_valid[4]);
    let layout = PartLayout::of(&model);
    let valid: Vec<usize> = layout
        .segments_of(Finger::Index)
        .filter(|i| out.segment_valid[*i])
        .collect();
    assert_eq!(valid.len(), 4, "only the distal link has both ends");
    assert_eq!(out.finger_points(Finger::Index), None);

    let moved = Isometry3::from_parts(Translation3::new(0.5, 0.0, 0.0), UnitQuaternion::identity());
    pose_hand(
        &model,
        &sample(moved, [None; N_JOINTS]),
        &mut memory,
        &mut out,
    );
    assert!(!out.point_valid[5], "never tracked");
    assert!((out.points[7] - (places[7] + Vector3::x() * 0.5)).norm() < 1e-12);
    assert_eq!(out.points[5], Point3::new(0.5, 0.0, 0.0));
}

#[test]
fn a_link_without_length_has_the_ridges_of_its_neighbour() {
    let model = model(4, false);
    let places = forward(&model.skeleton, Side::Right, &JointAngles::default());
    let mut points = places;
    points[6] = points[5];
    let sample = HandSample {
        wrist: Isometry3::identity(),
        fingers: FingerPose::Points(points.map(Some)),
    };
    let mut out = PosedHand::default();
    pose_hand(&model, &sample, &mut JointMemory::default(), &mut out);
    let start = PartLayout::of(&model).segments_of(Finger::Index).start;
    for ridge in 0..4 {
        let first = (out.segments[start + ridge][0] - points[4]).normalize();
        let none = (out.segments[start + 4 + ridge][0] - points[5]).normalize();
        assert!((first - none).norm() < 1e-12);
    }
    // All joints in one place, and a finger along the wrist's x axis: still defined and finite.
    for direction in [Vector3::zeros(), Vector3::x(), -Vector3::x()] {
        let line: [_; N_JOINTS] =
            std::array::from_fn(|i| Some(Point3::from(direction * (0.01 * i as f64))));
        let sample = HandSample {
            wrist: Isometry3::identity(),
            fingers: FingerPose::Points(line),
        };
        pose_hand(&model, &sample, &mut JointMemory::default(), &mut out);
        assert!(
            out.segments
                .iter()
                .flatten()
                .all(|p| p.coords.iter().all(|x| x.is_finite()))
        );
        let radius = model.skeleton.fingers[1].radii[0];
        let offset = (out.segments[start][0] - out.points[4]).norm();
        assert!((offset - radius).abs() < 1e-12, "{offset}");
    }
}

#[test]
fn replacing_a_finger_by_itself_changes_nothing() {
    let model = model(4, true);
    let angles = JointAngles {
        palm_arch: 0.2,
        ..JointAngles::default()
    };
    let hand = posed(
        &model,
        Isometry3::new(Vector3::x(), Vector3::new(0.3, 0.2, 0.1)),
        angles,
    );
    let mut again = hand.clone();
    for finger in Finger::ALL {
        let points = hand.finger_points(finger).unwrap();
        again.set_finger(&model, finger, &points);
    }
    assert_eq!(hand, again);
}

proptest! {
    #[test]
    fn ridges_stand_at_the_radius_from_their_link(angles in any_angles(), wrist in any_pose(), sides in 3..=8u32) {
        let model = model(sides, false);
        let hand = posed(&model, wrist, angles);
        let sides = sides as usize;
        for (index, ridge) in hand.segments.iter().enumerate() {
            let (finger, link) = (index / sides / LINKS_PER_FINGER, index / sides % LINKS_PER_FINGER);
            let near = finger * POINTS_PER_FINGER + link;
            let (start, end) = (hand.points[near], hand.points[near + 1]);
            let offset = ridge[0] - start;
            prop_assert!((offset.norm() - model.skeleton.fingers[finger].radii[link]).abs() < 1e-12);
            prop_assert!((ridge[1] - end - offset).norm() < 1e-12, "parallel");
            prop_assert!(offset.dot(&(end - start)).abs() < 1e-12, "across");
        }
    }

    #[test]
    fn a_rigid_move_of_the_wrist_moves_everything(angles in any_angles(), wrist in any_pose(), motion in any_pose()) {
        let model = model(4, true);
        let (before, after) = (posed(&model, wrist, angles), posed(&model, motion * wrist, angles));
        for (a, b) in before.points.iter().zip(&after.points) {
            prop_assert!((motion * a - b).norm() < 1e-12);
        }
        for (a, b) in before.segments.iter().flatten().zip(after.segments.iter().flatten()) {
            prop_assert!((motion * a - b).norm() < 1e-12);
        }
    }

    #[test]
    fn a_left_hand_mirrors_a_right_one(angles in any_angles()) {
        let right = posed(&HandModel::adult(Side::Right), Isometry3::identity(), angles);
        let left = posed(&HandModel::adult(Side::Left), Isometry3::identity(), angles);
        for (r, l) in right.segments.iter().flatten().zip(left.segments.iter().flatten()) {
            prop_assert!((mirrored_point(r) - l).norm() < 1e-12, "{r} {l}");
        }
    }

    #[test]
    fn ridges_turn_continuously(angles in any_angles(), nudge in prop::array::uniform4(-1.0..1.0f64)) {
        let model = model(4, false);
        let mut near = angles;
        near.thumb.opposition += 1e-4 * nudge[0];
        near.fingers[0].mcp_flexion += 1e-4 * nudge[1];
        near.fingers[0].pip_flexion += 1e-4 * nudge[2];
        near.fingers[0].abduction += 1e-4 * nudge[3];
        let (a, b) = (posed(&model, Isometry3::identity(), angles), posed(&model, Isometry3::identity(), near));
        for (p, q) in a.segments.iter().flatten().zip(b.segments.iter().flatten()) {
            prop_assert!((p - q).norm() < 2e-4, "{p} {q}");
        }
    }
}
