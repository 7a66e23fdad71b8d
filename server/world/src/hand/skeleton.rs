//! What never changes about a hand: bone lengths, finger radii and how its judgement parts are made.

use libm::{cos, sin};
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::joint::{Finger, LINKS_PER_FINGER, N_FINGERS, Side};

/// One hand as a scene or a wearer defines it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HandModel {
    /// Which hand.
    pub side: Side,
    /// Bones and radii, in the wrist's space.
    pub skeleton: Skeleton,
    /// Ridges (judgement segments) of each link's prism, 3 to 8. Four give the 60 segments of the 1998 model.
    pub prism_sides: u32,
    /// Radius of the judgement points, metres, 0 to 0.05. 0 tests the joint positions themselves, as the paper does.
    pub point_radius: f64,
    /// Whether the palm has judgement points and segments too.
    pub palm_contacts: bool,
}

/// The bones of one hand in the wrist's space (see [`super::sample::HandSample::wrist`] for its axes).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Skeleton {
    /// The five fingers, in [`Finger::ALL`] order.
    pub fingers: [FingerBones; N_FINGERS],
}

/// The bones of one finger.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FingerBones {
    /// The joint nearest the palm in the wrist's space, metres: the thumb's CMC, the other fingers' MCP.
    pub base: Point3<f64>,
    /// `wrist_from_base`: the straight finger points along the base's -z and bends toward its -y
    /// (the thumb: in its xz plane, see [`super::kinematics`]).
    pub orientation: UnitQuaternion<f64>,
    /// Lengths of the three links from the palm to the tip, metres.
    pub lengths: [f64; LINKS_PER_FINGER],
    /// Radii of the flesh around the three links, metres.
    pub radii: [f64; LINKS_PER_FINGER],
}

/// Why a hand model is refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum HandModelFault {
    /// The number of ridges per prism is out of bounds.
    #[error("prism_sides is {0}; it must be 3 to 8")]
    PrismSides(u32),
    /// The radius of the judgement points is out of bounds.
    #[error("point_radius is {0} m; it must be 0 to 0.05 m")]
    PointRadius(f64),
    /// A link is too short, too long or not a number.
    #[error("{} finger: link {} is {} m long; it must be 0.001 to 0.5 m", finger.name(), link, length)]
    LinkLength {
        /// The finger.
        finger: Finger,
        /// The link, 0 nearest the palm.
        link: usize,
        /// What was given, metres.
        length: f64,
    },
    /// A radius is too small, too large or not a number.
    #[error("{} finger: link {} has a radius of {} m; it must be 0.0005 to 0.05 m", finger.name(), link, radius)]
    LinkRadius {
        /// The finger.
        finger: Finger,
        /// The link, 0 nearest the palm.
        link: usize,
        /// What was given, metres.
        radius: f64,
    },
    /// A base joint is too far from the wrist or not a number.
    #[error("{} finger: its base joint must lie within 0.5 m of the wrist", finger.name())]
    Base {
        /// The finger.
        finger: Finger,
    },
    /// A base orientation is no unit quaternion.
    #[error("{} finger: its base orientation must be a unit quaternion", finger.name())]
    Orientation {
        /// The finger.
        finger: Finger,
    },
}

/// Fewest ridges of a prism.
pub const PRISM_SIDES_MIN: u32 = 3;
/// Most ridges of a prism.
pub const PRISM_SIDES_MAX: u32 = 8;
/// Shortest link, metres.
const LENGTH_MIN: f64 = 0.001;
/// Longest link and farthest base joint, metres.
const LENGTH_MAX: f64 = 0.5;
/// Thinnest finger, metres.
const RADIUS_MIN: f64 = 0.0005;
/// Thickest finger and largest judgement point, metres.
const RADIUS_MAX: f64 = 0.05;
/// How far a quaternion's length may be from one.
const UNIT_TOLERANCE: f64 = 1e-6;

impl HandModel {
    /// An adult hand with four-sided prisms and bare joint points, as in the 1998 model.
    pub fn adult(side: Side) -> Self {
        Self {
            side,
            skeleton: Skeleton::adult(side),
            prism_sides: 4,
            point_radius: 0.0,
            palm_contacts: false,
        }
    }

    /// Checks every bound.
    ///
    /// # Errors
    /// The first fault, fingers in order.
    pub fn validate(&self) -> Result<(), HandModelFault> {
        if !(PRISM_SIDES_MIN..=PRISM_SIDES_MAX).contains(&self.prism_sides) {
            return Err(HandModelFault::PrismSides(self.prism_sides));
        }
        if !(0.0..=RADIUS_MAX).contains(&self.point_radius) {
            return Err(HandModelFault::PointRadius(self.point_radius));
        }
        Finger::ALL
            .iter()
            .try_for_each(|&finger| self.skeleton.finger(finger).validate(finger))
    }
}

impl Skeleton {
    /// An adult's hand: 95 mm from the wrist to the middle finger's knuckle, 196 mm to its tip.
    pub fn adult(side: Side) -> Self {
        let right = Self {
            fingers: [
                bones(
                    [-0.027, -0.016, -0.034],
                    THUMB_ROLL_RIGHT,
                    [0.045, 0.034, 0.027],
                    [0.011, 0.010, 0.009],
                ),
                bones(
                    [-0.024, -0.003, -0.092],
                    yaw(0.05),
                    [0.044, 0.026, 0.023],
                    [0.009, 0.0085, 0.008],
                ),
                bones(
                    [-0.002, 0.0, -0.095],
                    yaw(0.0),
                    [0.047, 0.030, 0.024],
                    [0.010, 0.0085, 0.008],
                ),
                bones(
                    [0.018, -0.003, -0.090],
                    yaw(-0.05),
                    [0.043, 0.028, 0.024],
                    [0.009, 0.008, 0.0075],
                ),
                bones(
                    [0.036, -0.010, -0.081],
                    yaw(-0.12),
                    [0.034, 0.020, 0.021],
                    [0.008, 0.0075, 0.007],
                ),
            ],
        };
        match side {
            Side::Right => right,
            Side::Left => right.mirrored(),
        }
    }

    /// The bones of one finger.
    pub fn finger(&self, finger: Finger) -> &FingerBones {
        &self.fingers[finger.index()]
    }

    /// The same hand `factor` times as large: places, lengths and radii.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            fingers: self.fingers.map(|bones| FingerBones {
                base: bones.base * factor,
                lengths: bones.lengths.map(|l| l * factor),
                radii: bones.radii.map(|r| r * factor),
                ..bones
            }),
        }
    }

    /// The hand seen in a mirror at the wrist's yz plane: a right hand becomes a left one.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self {
            fingers: self.fingers.map(|bones| {
                let q = bones.orientation.coords;
                FingerBones {
                    base: mirrored_point(&bones.base),
                    orientation: UnitQuaternion::new_unchecked(Quaternion::new(
                        q.w, q.x, -q.y, -q.z,
                    )),
                    ..bones
                }
            }),
        }
    }

    /// The skeleton with base joints and link lengths taken from twenty joint places in the wrist's space (metres),
    /// keeping base orientations and radii. Lengths below 1 mm keep the skeleton's own.
    #[must_use]
    pub fn fitted(&self, points: &[Point3<f64>; super::joint::N_JOINTS]) -> Self {
        let mut fitted = self.clone();
        for (bones, places) in fitted
            .fingers
            .iter_mut()
            .zip(points.chunks_exact(super::joint::POINTS_PER_FINGER))
        {
            bones.base = places[0];
            for (length, ends) in bones.lengths.iter_mut().zip(places.windows(2)) {
                let measured = (ends[1] - ends[0]).norm();
                *length = if measured >= LENGTH_MIN {
                    measured
                } else {
                    *length
                };
            }
        }
        fitted
    }
}

/// A point seen in a mirror at the yz plane.
pub(crate) fn mirrored_point(point: &Point3<f64>) -> Point3<f64> {
    Point3::new(-point.x, point.y, point.z)
}

impl FingerBones {
    fn validate(&self, finger: Finger) -> Result<(), HandModelFault> {
        // Comparisons are written so that NaN fails them.
        if !self.base.coords.iter().all(|x| x.abs() <= LENGTH_MAX) {
            return Err(HandModelFault::Base { finger });
        }
        let unit = (self.orientation.coords.norm() - 1.0).abs() <= UNIT_TOLERANCE;
        if !unit {
            return Err(HandModelFault::Orientation { finger });
        }
        for (link, (&length, &radius)) in self.lengths.iter().zip(&self.radii).enumerate() {
            if !(LENGTH_MIN..=LENGTH_MAX).contains(&length) {
                return Err(HandModelFault::LinkLength {
                    finger,
                    link,
                    length,
                });
            }
            if !(RADIUS_MIN..=RADIUS_MAX).contains(&radius) {
                return Err(HandModelFault::LinkRadius {
                    finger,
                    link,
                    radius,
                });
            }
        }
        Ok(())
    }
}

/// How far the right thumb's base is rolled about -z toward the palm when its opposition is 0, radians.
const THUMB_ROLL: f64 = 0.7;

/// A turn of the base orientation: axis and angle, radians.
type Turn = (Vector3<f64>, f64);

const THUMB_ROLL_RIGHT: Turn = (Vector3::new(0.0, 0.0, 1.0), THUMB_ROLL);

/// A turn about the back of the hand, positive toward the right thumb.
const fn yaw(angle: f64) -> Turn {
    (Vector3::new(0.0, 1.0, 0.0), angle)
}

fn bones(base: [f64; 3], turn: Turn, lengths: [f64; 3], radii: [f64; 3]) -> FingerBones {
    FingerBones {
        base: Point3::from(base),
        orientation: turned(&turn.0, turn.1),
        lengths,
        radii,
    }
}

/// The rotation about a unit axis by an angle in radians.
pub(crate) fn turned(axis: &Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    let xyz = axis * sin(0.5 * angle);
    UnitQuaternion::new_unchecked(Quaternion::new(cos(0.5 * angle), xyz.x, xyz.y, xyz.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_adult_hand_is_valid_at_both_sides_and_many_sizes() {
        for side in [Side::Left, Side::Right] {
            for factor in [0.5, 1.0, 2.0] {
                let mut model = HandModel::adult(side);
                model.skeleton = model.skeleton.scaled(factor);
                assert_eq!(model.validate(), Ok(()), "{side:?} {factor}");
            }
        }
        assert!(
            Skeleton::adult(Side::Right).finger(Finger::Thumb).base.x < 0.0,
            "a right thumb is at -x"
        );
        assert!(
            Skeleton::adult(Side::Left).finger(Finger::Thumb).base.x > 0.0,
            "a left thumb is at +x"
        );
        let middle = Skeleton::adult(Side::Right)
            .finger(Finger::Middle)
            .base
            .coords
            .norm();
        assert!((middle - 0.095).abs() < 0.001, "{middle}");
    }

    #[test]
    fn each_bound_is_checked() {
        let check = |spoil: fn(&mut HandModel), words: &str| {
            let mut model = HandModel::adult(Side::Right);
            spoil(&mut model);
            let fault = model.validate().expect_err(words).to_string();
            assert!(fault.contains(words), "{fault} does not say {words}");
        };
        check(|m| m.prism_sides = 2, "prism_sides is 2");
        check(|m| m.prism_sides = 9, "prism_sides is 9");
        check(|m| m.point_radius = -0.001, "point_radius");
        check(|m| m.point_radius = f64::NAN, "point_radius");
        check(
            |m| m.skeleton.fingers[1].lengths[2] = 0.0005,
            "index finger: link 2 is 0.0005 m long",
        );
        check(
            |m| m.skeleton.fingers[0].lengths[0] = f64::INFINITY,
            "thumb finger: link 0",
        );
        check(
            |m| m.skeleton.fingers[4].radii[1] = 0.06,
            "little finger: link 1 has a radius",
        );
        check(
            |m| m.skeleton.fingers[3].base.y = f64::NAN,
            "ring finger: its base joint",
        );
        check(
            |m| {
                m.skeleton.fingers[2].orientation =
                    UnitQuaternion::new_unchecked(Quaternion::new(0.5, 0.0, 0.0, 0.0))
            },
            "middle finger: its base orientation",
        );
    }

    #[test]
    fn mirroring_twice_changes_nothing() {
        let right = Skeleton::adult(Side::Right);
        assert_eq!(right.mirrored().mirrored(), right);
    }
}
