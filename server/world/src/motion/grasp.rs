//! Following the hand (Funahashi et al. 1998, §3.2 (2); model §5.2 for several hands).

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::classify::widest_pair;
use crate::contact::Touch;
use crate::motion::inertia::unit;
use crate::state::{HandId, Hold};

/// Where a held object is, given the leader's wrist: it keeps its pose in the wrist's space.
pub fn carried(world_from_wrist: &Isometry3<f64>, hold: &Hold) -> Isometry3<f64> {
    let pose = world_from_wrist * hold.wrist_from_object;
    Isometry3::from_parts(pose.translation, unit(pose.rotation))
}

/// The hand that a grasped object follows: the one that led so far while it satisfies the test by itself, else the
/// lowest id that does, else none (only the contacts of several hands together hold it).
pub fn leader(touches: &[Touch], grasp_angle: f64, so_far: Option<HandId>) -> Option<HandId> {
    let alone = |hand: HandId| {
        widest_pair(touches, Some(hand)).is_some_and(|pair| pair.holds_at(grasp_angle))
    };
    if let Some(hand) = so_far
        && alone(hand)
    {
        return Some(hand);
    }
    let mut last = None;
    for touch in touches {
        if last != Some(touch.hand) && alone(touch.hand) {
            return Some(touch.hand);
        }
        last = Some(touch.hand);
    }
    None
}

/// Sweeps of the least-squares fit: the rotations of one step are small, each sweep squares the error.
const SWEEPS: usize = 4;
/// Share of the mean inertia of the points that stands in for directions in which they leave the turn open (two
/// points leave one about their line): the object then does not turn that way.
const OPEN_TURN: f64 = 1.0e-9;

/// The least-squares rigid motion that takes each first point to its second, by Gauss–Newton on the rotation.
///
/// The sum is over the pairs in their order. Identity for none; translation alone for one.
pub fn rigid_motion(pairs: &[[Point3<f64>; 2]]) -> Isometry3<f64> {
    if pairs.is_empty() {
        return Isometry3::identity();
    }
    let n = pairs.len() as f64;
    let centre = |end: usize| {
        pairs
            .iter()
            .fold(Vector3::zeros(), |sum, pair| sum + pair[end].coords)
            / n
    };
    let (from, to) = (centre(0), centre(1));
    let mut rotation = UnitQuaternion::identity();
    for _ in 0..SWEEPS {
        let mut inertia = Matrix3::zeros();
        let mut moment = Vector3::zeros();
        for pair in pairs {
            let arm = rotation * (pair[0].coords - from);
            let wanted = pair[1].coords - to;
            inertia += Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
            moment += arm.cross(&(wanted - arm));
        }
        let floor = inertia.trace() / 3.0 * OPEN_TURN + f64::MIN_POSITIVE;
        let Some(inverse) = (inertia + Matrix3::identity() * floor).try_inverse() else {
            break;
        };
        rotation = unit(
            UnitQuaternion::from_rotation_matrix(&Rotation3::new(inverse * moment)) * rotation,
        );
    }
    Isometry3::from_parts(Translation3::from(to - rotation * from), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(motion: &Isometry3<f64>, points: &[[f64; 3]]) {
        let pairs: Vec<[Point3<f64>; 2]> = points
            .iter()
            .map(|p| [Point3::from(*p), motion * Point3::from(*p)])
            .collect();
        let found = rigid_motion(&pairs);
        for pair in &pairs {
            assert!(
                (found * pair[0] - pair[1]).norm() < 1e-9,
                "{found} does not take {} to {}",
                pair[0],
                pair[1]
            );
        }
    }

    #[test]
    fn the_fit_finds_a_rigid_motion() {
        let motion = Isometry3::new(
            Vector3::new(0.01, -0.02, 0.005),
            Vector3::new(0.05, 0.1, -0.03),
        );
        check(
            &motion,
            &[
                [0.0, 0.0, 0.0],
                [0.1, 0.0, 0.0],
                [0.0, 0.1, 0.0],
                [0.0, 0.0, 0.1],
            ],
        );
        check(&Isometry3::translation(0.1, 0.2, 0.3), &[[0.1, 0.2, 0.3]]);
        // Two points leave the turn about their line open; the object does not turn that way.
        check(&motion, &[[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]]);
        assert_eq!(rigid_motion(&[]), Isometry3::identity());
    }

    #[test]
    fn two_points_that_only_translate_turn_nothing() {
        let shift = Vector3::new(0.0, 0.001, 0.0);
        let pairs = [
            [-0.03, 0.03].map(|_| Point3::origin()),
            [Point3::new(0.1, 0.0, 0.0); 2],
        ]
        .map(|[a, _]| [a, a + shift]);
        assert!(rigid_motion(&pairs).rotation.angle() < 1e-15);
    }
}
