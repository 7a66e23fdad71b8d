use proptest::prelude::{prop_assert, proptest};

use super::*;
use crate::hand::joint::{JointId, Side};
use crate::hand::kinematics::forward;
use crate::hand::sample::{FingerAngles, JointAngles};

/// The right index finger bent by `bend` radians at each joint.
fn bent(bend: f64) -> FingerLinks {
    let model = HandModel::adult(Side::Right);
    let finger = FingerAngles {
        mcp_flexion: bend,
        pip_flexion: bend,
        dip_flexion: bend,
        abduction: 0.0,
    };
    let points = forward(
        &model.skeleton,
        Side::Right,
        &JointAngles {
            fingers: [finger; 4],
            ..JointAngles::default()
        },
    );
    let start = JointId::of(Finger::Index, 0).index();
    FingerLinks::from_points(&std::array::from_fn(|step| points[start + step]))
}

fn path(touched: f64) -> OpeningPath {
    OpeningPath::new(
        &HandModel::adult(Side::Right),
        Finger::Index,
        bent(touched).directions,
    )
}

/// Depth below a plane of points at height `y`.
fn below(y: f64) -> impl FnMut(&[Point3<f64>; 4]) -> f64 {
    move |points| {
        points
            .iter()
            .map(|p| y - p.y)
            .fold(f64::NEG_INFINITY, f64::max)
    }
}

#[test]
fn a_finger_outside_stays_as_it_is() {
    let tracked = bent(0.2);
    // The last opening is tried first: two evaluations where there was one, one otherwise.
    for (last, n_evaluations) in [(0.0, 1), (0.4, 2)] {
        let found = retract_finger(&tracked, &path(0.1), last, &mut below(-0.5));
        assert_eq!((found.opening, found.n_evaluations), (0.0, n_evaluations));
    }
    let found = retract_finger(&tracked, &path(0.1), 0.4, &mut below(-0.5));
    assert_eq!(found.points, tracked.points());
}

#[test]
fn a_finger_inside_comes_to_lie_on_the_surface() {
    let plane = bent(0.3).points()[3].y;
    let found = retract_finger(&bent(0.6), &path(0.3), 0.0, &mut below(plane));
    assert!(
        found.depth <= DEPTH_TOLERANCE && found.depth > -1e-4,
        "{found:?}"
    );
    assert!(found.opening > 0.5 && found.opening <= 1.0, "{found:?}");
    assert!(found.n_evaluations <= 20, "{found:?}");
    let warm = retract_finger(&bent(0.601), &path(0.3), found.opening, &mut below(plane));
    assert!(
        warm.depth <= DEPTH_TOLERANCE && warm.n_evaluations <= 10,
        "{warm:?}"
    );
}

#[test]
fn a_touch_pose_that_still_penetrates_is_opened_further() {
    // Out beyond the first touch, out only when straight, out only when lifted.
    for (plane, at_least) in [
        (bent(0.2).points()[3].y, 1.0),
        (-0.004, ARC_END),
        (0.0, 0.0),
    ] {
        let mut low_base =
            |points: &[Point3<f64>; 4]| below(plane)(&[points[1], points[1], points[2], points[3]]);
        let found = retract_finger(&bent(0.6), &path(0.3), 0.0, &mut low_base);
        assert!(found.depth <= DEPTH_TOLERANCE, "{plane}: {found:?}");
        assert!(found.opening >= at_least, "{plane}: {found:?}");
    }
}

#[test]
fn where_nothing_is_out_the_least_deep_opening_is_taken() {
    let found = retract_finger(&bent(0.6), &path(0.3), 0.0, &mut below(1.0));
    let tracked = below(1.0)(&bent(0.6).points());
    assert!(
        found.depth > DEPTH_TOLERANCE && found.depth <= tracked,
        "{found:?}"
    );
    assert!(found.n_evaluations <= 12);
}

#[test]
fn opposite_directions_have_a_defined_middle() {
    let middle = slerp(&Vector3::x(), &-Vector3::x(), 0.5);
    assert!((middle.norm() - 1.0).abs() < 1e-12 && middle.dot(&Vector3::x()).abs() < 1e-9);
    assert_eq!(slerp(&Vector3::x(), &Vector3::x(), 7.0), Vector3::x());
}

proptest! {
    #[test]
    fn deeper_fingers_open_further(touch in 0.05..0.4f64, first in 0.01..0.4f64, more in 0.01..0.3f64, last in 0.0..1.5f64) {
        let plane = bent(touch).points()[3].y;
        let shallow = retract_finger(&bent(touch + first), &path(touch), last, &mut below(plane));
        let deep = retract_finger(&bent(touch + first + more), &path(touch), last, &mut below(plane));
        // Both lie within the depth tolerance of the surface; at the finger's shortest lever that is this angle.
        let slack = DEPTH_TOLERANCE / 0.02;
        prop_assert!(shallow.depth <= DEPTH_TOLERANCE && deep.depth <= DEPTH_TOLERANCE);
        prop_assert!(shallow.opening * first <= deep.opening * (first + more) + slack, "{shallow:?} {deep:?}");
    }

    #[test]
    fn lengths_stay_at_any_opening(bend in 0.0..1.5f64, touch in 0.0..1.5f64, opening in 0.0..OPENING_MAX) {
        let tracked = bent(bend);
        let opened = FingerLinks::from_points(&path(touch).finger_at(&tracked, opening).points());
        for link in 0..LINKS_PER_FINGER {
            prop_assert!((opened.lengths[link] - tracked.lengths[link]).abs() < 1e-12);
        }
    }
}
