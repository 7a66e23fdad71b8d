//! From the places of a hand's joints to the directions of its links and the pose of its wrist.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::glove::calibrate::Handedness;
use crate::source::links::{HandLinks, Links};

/// A link that is shorter has no direction, m.
const NO_LENGTH_M: f64 = 1.0e-4;
/// The sine of a finger's bend from which on it tells where its hinge is.
const BENT: f64 = 0.2;

/// The joints of one finger from the palm to the tip, m.
pub(crate) type FingerJoints = [Option<Vector3<f64>>; 4];

/// Places of a hand's joints in the space of the world, m.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct HandJoints {
    /// The wrist.
    pub(crate) hand: Option<Vector3<f64>>,
    /// Thumb to little finger.
    pub(crate) fingers: [FingerJoints; 5],
}

impl HandJoints {
    /// `world_from_wrist`, m: -z toward the knuckle of the middle finger, y out of the back of the hand, whose plane is that
    /// of the wrist and the knuckles of index and little finger. `None` where they are missing or in one place.
    pub(crate) fn wrist(&self, hand: Handedness) -> Option<Isometry3<f64>> {
        let wrist = self.hand?;
        let knuckle = |finger: usize| self.fingers[finger][0];
        let ahead = (knuckle(2)? - wrist).try_normalize(NO_LENGTH_M)?;
        let toward_little = knuckle(4)? - knuckle(1)?;
        let right = match hand {
            Handedness::Left => -toward_little,
            Handedness::Right => toward_little,
        };
        let back = right
            .cross(&ahead)
            .try_normalize(NO_LENGTH_M * NO_LENGTH_M)?;
        let right = ahead.cross(&back);
        let axes = Matrix3::from_columns(&[right, back, -ahead]);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        Some(Isometry3::from_parts(Translation3::from(wrist), rotation))
    }

    /// The directions of the links in the wrist's space.
    pub(crate) fn links(&self, world_from_wrist: &Isometry3<f64>) -> HandLinks {
        let wrist_from_world = world_from_wrist.rotation.inverse();
        let links = |finger: usize| {
            directions(&self.fingers[finger]).map(|links| links.map(|link| wrist_from_world * link))
        };
        let finger = |finger: usize| links(finger).map(|links| (links, sideways(&links)));
        HandLinks {
            thumb: links(0),
            fingers: [finger(1), finger(2), finger(3), finger(4)],
        }
    }
}

/// `None` where a joint is missing or two are in one place.
fn directions(joints: &FingerJoints) -> Option<Links> {
    let mut links = [Vector3::zeros(); 3];
    for (link, ends) in links.iter_mut().zip(joints.windows(2)) {
        *link = (ends[1]? - ends[0]?).try_normalize(NO_LENGTH_M)?;
    }
    Some(links)
}

/// What is sideways to a finger: its hinge where it is bent, the wrist's x where it is straight.
fn sideways(links: &Links) -> Vector3<f64> {
    let hinge = links[1].cross(&links[0]);
    hinge
        .try_normalize(BENT)
        .filter(|hinge| hinge.x > 0.0)
        .unwrap_or_else(Vector3::x)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::HandJoints;
    use crate::glove::calibrate::Handedness;
    use crate::glove::sensor::GloveSensor;

    /// A right hand, palm down, at the height of 1 m, fingers to the front, the index finger bent by a right angle at
    /// the PIP; mirrored for the left.
    fn joints(hand: Handedness) -> HandJoints {
        let sign = match hand {
            Handedness::Left => -1.0,
            Handedness::Right => 1.0,
        };
        let at = |x: f64, y: f64, z: f64| Some(Vector3::new(sign * x, 1.0 + y, z));
        let straight = |x: f64| [-0.09, -0.13, -0.16, -0.18].map(|z| at(x, 0.0, z));
        HandJoints {
            hand: at(0.0, 0.0, 0.0),
            fingers: [
                [
                    at(-0.03, 0.0, -0.03),
                    at(-0.06, 0.0, -0.06),
                    at(-0.08, 0.0, -0.08),
                    at(-0.10, 0.0, -0.10),
                ],
                [
                    at(-0.02, 0.0, -0.09),
                    at(-0.02, 0.0, -0.13),
                    at(-0.02, -0.03, -0.13),
                    at(-0.02, -0.05, -0.13),
                ],
                straight(0.0),
                straight(0.02),
                straight(0.04),
            ],
        }
    }

    #[test]
    fn places_have_the_angles_that_one_sees() {
        for hand in [Handedness::Left, Handedness::Right] {
            let joints = joints(hand);
            let wrist = joints.wrist(hand).unwrap();
            assert!(wrist.rotation.angle() < 1e-9, "aligned with the world");
            assert!((wrist.translation.vector - Vector3::y()).norm() < 1e-12);
            let found = joints.links(&wrist).degrees(hand);
            let bent = [
                (GloveSensor::IndexPip, 90.0),
                (GloveSensor::ThumbAbduction, 45.0),
                (GloveSensor::ThumbRotation, -0.7_f64.to_degrees()),
            ];
            for sensor in GloveSensor::ALL {
                let expected = bent.iter().find(|(bent, _)| *bent == sensor);
                let expected = expected.map_or(0.0, |(_, degrees)| *degrees);
                if let Some(found) = found[sensor.slot()] {
                    assert!(
                        (found - expected).abs() < 1e-6,
                        "{hand:?} {sensor:?} {found}"
                    );
                }
            }
            assert_eq!(found.iter().flatten().count(), 19);
        }
    }

    #[test]
    fn a_hand_in_one_place_is_none() {
        let nowhere = HandJoints {
            hand: Some(Vector3::zeros()),
            fingers: [[Some(Vector3::zeros()); 4]; 5],
        };
        assert!(nowhere.wrist(Handedness::Left).is_none());
        assert!(HandJoints::default().wrist(Handedness::Left).is_none());
    }
}
