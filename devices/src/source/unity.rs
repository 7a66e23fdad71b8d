//! From the space of the Unity engine (left-handed: x right, y up, z forward) to the world's (right-handed: x right,
//! y up, -z forward), and to the axes of a wrist.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::glove::calibrate::Handedness;

/// Farther away than this is no hand in a room, m.
const FARTHEST_M: f64 = 1.0e4;
/// How far the length of a quaternion may be from 1: senders round.
const LENGTH_TOLERANCE: f64 = 0.05;

/// A position: z is mirrored. `None` when it is not a number or not in a room.
pub(crate) fn position_from_unity(xyz: [f64; 3]) -> Option<Vector3<f64>> {
    let [x, y, z] = xyz;
    xyz.iter()
        .all(|part| part.abs() <= FARTHEST_M)
        .then(|| Vector3::new(x, y, -z))
}

/// A rotation: the mirror keeps the turn about z and reverses those about x and y. `None` when it is no rotation.
pub(crate) fn rotation_from_unity(xyzw: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    let [x, y, z, w] = xyzw;
    let mirrored = Quaternion::new(w, -x, -y, z);
    ((mirrored.norm() - 1.0).abs() <= LENGTH_TOLERANCE)
        .then(|| UnitQuaternion::from_quaternion(mirrored))
}

/// The inverse of [`position_from_unity`].
pub(crate) fn unity_from_position(position: &Vector3<f64>) -> [f64; 3] {
    [position.x, position.y, -position.z]
}

/// The inverse of [`rotation_from_unity`].
pub(crate) fn unity_from_rotation(rotation: &UnitQuaternion<f64>) -> [f64; 4] {
    [-rotation.i, -rotation.j, rotation.k, rotation.w]
}

/// `hand_from_wrist`: the axes of the wrist in those of a hand bone. An avatar in T-pose looks along -z with its arms
/// along x, its palms down and every bone's axes along the world's; the wrist's -z is along the fingers and its y out of the
/// back of the hand.
pub(crate) fn hand_from_wrist(hand: Handedness) -> UnitQuaternion<f64> {
    let turn = match hand {
        Handedness::Left => FRAC_PI_2,
        Handedness::Right => -FRAC_PI_2,
    };
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_1_SQRT_2;

    use nalgebra::Vector3;

    use super::{
        hand_from_wrist, position_from_unity, rotation_from_unity, unity_from_position,
        unity_from_rotation,
    };
    use crate::glove::calibrate::Handedness;

    #[test]
    fn forward_stays_forward_and_turns_keep_their_sense() {
        assert_eq!(
            position_from_unity([1.0, 2.0, 3.0]),
            Some(Vector3::new(1.0, 2.0, -3.0))
        );
        // In Unity a positive quarter about y turns forward (z) to the right (x).
        let turn = rotation_from_unity([0.0, FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2]).unwrap();
        let forward = -Vector3::z();
        assert!((turn * forward - Vector3::x()).norm() < 1e-12);
        // And one about z turns right (x) up (y), in both.
        let turn = rotation_from_unity([0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2]).unwrap();
        assert!((turn * Vector3::x() - Vector3::y()).norm() < 1e-12);
    }

    #[test]
    fn there_and_back_is_nowhere() {
        let rotation = rotation_from_unity([0.1, -0.5, 0.7, 0.5]).unwrap();
        let back = rotation_from_unity(unity_from_rotation(&rotation)).unwrap();
        assert!(rotation.angle_to(&back) < 1e-7);
        let position = position_from_unity([0.1, -0.5, 0.7]).unwrap();
        assert_eq!(
            position_from_unity(unity_from_position(&position)),
            Some(position)
        );
    }

    #[test]
    fn what_is_no_pose_is_refused() {
        assert_eq!(position_from_unity([f64::NAN, 0.0, 0.0]), None);
        assert_eq!(position_from_unity([0.0, 1.0e9, 0.0]), None);
        assert_eq!(rotation_from_unity([0.0; 4]), None);
        assert_eq!(rotation_from_unity([0.0, f64::NAN, 0.0, 1.0]), None);
    }

    #[test]
    fn fingers_of_a_t_pose_point_outward_and_backs_up() {
        for (hand, outward) in [
            (Handedness::Left, -Vector3::x()),
            (Handedness::Right, Vector3::x()),
        ] {
            let axes = hand_from_wrist(hand);
            assert!((axes * -Vector3::z() - outward).norm() < 1e-12);
            assert!((axes * Vector3::y() - Vector3::y()).norm() < 1e-12);
        }
    }
}
