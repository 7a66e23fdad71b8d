//! From the directions of a hand's links to what a glove's sensors would read.
//!
//! ```text
//!   +y back of the hand          knuckle ──── PIP        abduction turns a finger's plane about +y,
//!    │                               \ mcp      \ pip    flexion turns its links within the plane,
//!    └── -z fingers                  (flexion toward -y)  from -z toward -y.
//! ```
//!
//! The thumb's plane contains -z. Its rotation turns that plane about -z, its abduction lifts the first link out of -z
//! within the plane, and the flexions bend the others back toward -z.

use std::f64::consts::{PI, TAU};

use nalgebra::{UnitQuaternion, Vector3};

use crate::glove::calibrate::{Handedness, SensorCalibration};
use crate::glove::sensor::GloveSensor;

/// Directions of the three links of a finger, from the palm to the tip, in the wrist's space.
pub(crate) type Links = [Vector3<f64>; 3];

/// The turn of the thumb's plane about -z at which its rotation reads 0, counted from the plane of the palm toward its
/// inside, rad. The hand model of the daemon has its thumb's base there.
pub(crate) const THUMB_ROLL_AT_ZERO: f64 = 0.7;
/// Rotation of the thumb in the middle of its range, rad: of the two readings of a plane, half a turn apart, the one
/// nearer to it is taken where the first link does not say.
const THUMB_ROTATION_CENTRE: f64 = 0.75;
/// Below this share of a link that is not along y, its direction does not tell the abduction well.
const UPRIGHT: f64 = 0.2;
/// Below this share of the thumb's first link that is not along -z, its direction does not tell the side of the plane.
const ALONG: f64 = 0.1;

/// MCP, PIP and DIP of index, middle, ring and little finger.
pub(crate) const FLEXIONS: [[GloveSensor; 3]; 4] = [
    [
        GloveSensor::IndexMcp,
        GloveSensor::IndexPip,
        GloveSensor::IndexDip,
    ],
    [
        GloveSensor::MiddleMcp,
        GloveSensor::MiddlePip,
        GloveSensor::MiddleDip,
    ],
    [
        GloveSensor::RingMcp,
        GloveSensor::RingPip,
        GloveSensor::RingDip,
    ],
    [
        GloveSensor::LittleMcp,
        GloveSensor::LittlePip,
        GloveSensor::LittleDip,
    ],
];

/// What is known of the directions of a hand.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct HandLinks {
    /// The thumb's.
    pub(crate) thumb: Option<Links>,
    /// Index to little finger, each with the direction that is sideways (x) to its first link as far as the sender tells.
    pub(crate) fingers: [Option<(Links, Vector3<f64>)>; 4],
}

impl HandLinks {
    /// Whether nothing is known.
    pub(crate) fn is_empty(&self) -> bool {
        self.thumb.is_none() && self.fingers.iter().all(Option::is_none)
    }

    /// What the sensors read, degrees by slot.
    pub(crate) fn degrees(&self, hand: Handedness) -> [Option<f64>; GloveSensor::N_SLOTS] {
        let mut slots = [None; GloveSensor::N_SLOTS];
        let mut put =
            |sensor: GloveSensor, angle: f64| slots[sensor.slot()] = Some(angle.to_degrees());
        if let Some(links) = &self.thumb {
            let [rotation, abduction, mcp, ip] = thumb(&links.map(|link| as_right(link, hand)));
            put(GloveSensor::ThumbRotation, rotation);
            put(GloveSensor::ThumbAbduction, abduction);
            put(GloveSensor::ThumbMcp, mcp);
            put(GloveSensor::ThumbIp, ip);
        }
        // Toward the thumb is positive.
        let mut swings = [None; 4];
        for (finger, known) in self.fingers.iter().enumerate() {
            let Some((links, sideways)) = known else {
                continue;
            };
            let links = links.map(|link| as_right(link, hand));
            let sideways = match hand {
                Handedness::Right => *sideways,
                Handedness::Left => -as_right(*sideways, hand),
            };
            let (bends, swing) = bends_and_swing(&links, &sideways);
            for (sensor, bend) in FLEXIONS[finger].into_iter().zip(bends) {
                put(sensor, bend);
            }
            swings[finger] = Some(swing);
        }
        for (sensor, first, second) in [
            (GloveSensor::MiddleIndexAbduction, 0, 1),
            (GloveSensor::RingMiddleAbduction, 1, 2),
            (GloveSensor::LittleRingAbduction, 2, 3),
        ] {
            if let (Some(first), Some(second)) = (swings[first], swings[second]) {
                put(sensor, first - second);
            }
        }
        slots
    }
}

/// The calibration of a sensor whose sender gives degrees already: as they are.
pub(crate) const fn degrees_as_they_are() -> SensorCalibration {
    SensorCalibration {
        raw_at_zero: 0.0,
        gain_deg_per_count: 1.0,
        min_deg: -180.0,
        max_deg: 180.0,
        coupling: None,
    }
}

/// The direction of the left hand's link as the right hand has it.
fn as_right(link: Vector3<f64>, hand: Handedness) -> Vector3<f64> {
    match hand {
        Handedness::Right => link,
        Handedness::Left => Vector3::new(-link.x, link.y, link.z),
    }
}

/// MCP, PIP and DIP flexion and the swing about y, rad, of a right hand's finger.
fn bends_and_swing(links: &Links, sideways: &Vector3<f64>) -> ([f64; 3], f64) {
    let swing = swing(&links[0], sideways);
    let (sin, cos) = swing.sin_cos();
    let straight = Vector3::new(-sin, 0.0, -cos);
    let hinge = Vector3::new(-cos, 0.0, sin);
    let bend =
        |from: &Vector3<f64>, to: &Vector3<f64>| from.cross(to).dot(&hinge).atan2(from.dot(to));
    let bends = [
        bend(&straight, &links[0]),
        bend(&links[0], &links[1]),
        bend(&links[1], &links[2]),
    ];
    (bends, swing)
}

/// How far the finger's plane is turned about y, rad. A finger that points straight down has no direction in the plane of
/// the palm, and one that is bent further points backward there: then what is sideways to it tells.
fn swing(first: &Vector3<f64>, sideways: &Vector3<f64>) -> f64 {
    let backward = if first.z > 0.0 { -1.0 } else { 1.0 };
    let (sin, cos) = (-first.x * backward, -first.z * backward);
    let trust = (sin.hypot(cos) / UPRIGHT).min(1.0);
    let rest = UPRIGHT * (1.0 - trust);
    (sin * trust - sideways.z * rest).atan2(cos * trust + sideways.x * rest)
}

/// Rotation, abduction, MCP and IP flexion, rad, of a right hand's thumb: in the plane that its links are nearest to.
fn thumb(links: &Links) -> [f64; 4] {
    let moments = links
        .iter()
        .map(|link| (link.x * link.x - link.y * link.y, 2.0 * link.x * link.y));
    let (difference, product) = moments.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    let nearest = 0.5 * f64::atan2(product, difference);
    let first_side = -links[0].x * nearest.cos() - links[0].y * nearest.sin();
    let centre = THUMB_ROTATION_CENTRE + THUMB_ROLL_AT_ZERO;
    let is_this_side = if first_side.abs() > ALONG {
        first_side > 0.0
    } else {
        wrapped(nearest - centre).abs() <= PI / 2.0
    };
    let roll = if is_this_side { nearest } else { nearest + PI };
    let (sin, cos) = roll.sin_cos();
    let lift = |link: &Vector3<f64>| (-link.x * cos - link.y * sin).atan2(-link.z);
    let [first, second, third] = [lift(&links[0]), lift(&links[1]), lift(&links[2])];
    [
        wrapped(roll - THUMB_ROLL_AT_ZERO),
        first,
        wrapped(first - second),
        wrapped(second - third),
    ]
}

fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

/// Rotations of the links of a right hand's finger, each from the wrist's axes, for emulators: the inverse of
/// [`HandLinks::degrees`] for one finger, angles in rad.
pub(crate) fn finger_rotations(bends: [f64; 3], swing: f64) -> [UnitQuaternion<f64>; 3] {
    let turned = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), swing);
    let mut bent = 0.0;
    bends.map(|bend| {
        bent += bend;
        turned * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -bent)
    })
}

/// Directions of the links of a right hand's thumb, for emulators: the inverse of [`HandLinks::degrees`] for the thumb,
/// angles in rad: rotation, abduction, MCP, IP.
pub(crate) fn thumb_links([rotation, abduction, mcp, ip]: [f64; 4]) -> Links {
    let roll = rotation + THUMB_ROLL_AT_ZERO;
    [abduction, abduction - mcp, abduction - mcp - ip].map(|lift| {
        Vector3::new(
            -lift.sin() * roll.cos(),
            -lift.sin() * roll.sin(),
            -lift.cos(),
        )
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::{HandLinks, finger_rotations, thumb_links};
    use crate::glove::calibrate::Handedness;
    use crate::glove::sensor::GloveSensor;

    fn near(found: Option<f64>, degrees: f64) {
        assert!(
            found.is_some_and(|found| (found - degrees).abs() < 1e-6),
            "{found:?} is not {degrees}"
        );
    }

    fn mirrored(links: HandLinks) -> HandLinks {
        let polar = |v: Vector3<f64>| Vector3::new(-v.x, v.y, v.z);
        HandLinks {
            thumb: links.thumb.map(|links| links.map(polar)),
            fingers: links
                .fingers
                .map(|finger| finger.map(|(links, x)| (links.map(polar), -polar(x)))),
        }
    }

    /// A right hand's finger by hand-made vectors: straight, then bent by 90° at the PIP.
    #[test]
    fn directions_have_the_angles_that_one_sees() {
        let (ahead, down, right) = (-Vector3::z(), -Vector3::y(), Vector3::x());
        let flat = [ahead; 3];
        let mut links = HandLinks {
            fingers: [Some((flat, right)); 4],
            thumb: None,
        };
        for slot in GloveSensor::ALL.map(GloveSensor::slot) {
            if let Some(found) = links.degrees(Handedness::Right)[slot] {
                near(Some(found), 0.0);
            }
        }
        links.fingers[1] = Some(([ahead, down, -ahead], right));
        // 30° toward the little finger's side (+x of a right hand), straight.
        let aside = Vector3::new(0.5, 0.0, -0.75_f64.sqrt());
        links.fingers[3] = Some(([aside; 3], right));
        for (hand, links) in [
            (Handedness::Right, links),
            (Handedness::Left, mirrored(links)),
        ] {
            let found = links.degrees(hand);
            let at = |sensor: GloveSensor| found[sensor.slot()];
            near(at(GloveSensor::MiddleMcp), 0.0);
            near(at(GloveSensor::MiddlePip), 90.0);
            near(at(GloveSensor::MiddleDip), 90.0);
            near(at(GloveSensor::LittleMcp), 0.0);
            near(at(GloveSensor::LittleRingAbduction), 30.0);
            near(at(GloveSensor::MiddleIndexAbduction), 0.0);
        }
    }

    #[test]
    fn a_thumb_in_the_plane_of_the_palm_is_abducted() {
        // 45° from the fingers, on the right hand's thumb side (-x).
        let aside = Vector3::new(-1.0, 0.0, -1.0).normalize();
        let links = HandLinks {
            thumb: Some([aside; 3]),
            ..HandLinks::default()
        };
        let found = links.degrees(Handedness::Right);
        near(found[GloveSensor::ThumbAbduction.slot()], 45.0);
        near(
            found[GloveSensor::ThumbRotation.slot()],
            -0.7_f64.to_degrees(),
        );
        near(found[GloveSensor::ThumbMcp.slot()], 0.0);
    }

    #[test]
    fn angles_come_back_from_the_rotations_that_they_make() {
        let range = [-0.3, 0.0, 0.2, 0.9, 1.4, 1.7];
        for mcp in range {
            for pip in range {
                for swing in [-0.4, 0.0, 0.25] {
                    let rotations = finger_rotations([mcp, pip, 0.5 * pip], swing);
                    let direction = rotations.map(|rotation| rotation * -Vector3::z());
                    let sideways = rotations[0] * Vector3::x();
                    let mut links = HandLinks::default();
                    links.fingers[0] = Some((direction, sideways));
                    links.fingers[1] = Some(([-Vector3::z(); 3], Vector3::x()));
                    let found = links.degrees(Handedness::Right);
                    near(found[GloveSensor::IndexMcp.slot()], mcp.to_degrees());
                    near(found[GloveSensor::IndexPip.slot()], pip.to_degrees());
                    near(found[GloveSensor::IndexDip.slot()], 0.5 * pip.to_degrees());
                    near(
                        found[GloveSensor::MiddleIndexAbduction.slot()],
                        swing.to_degrees(),
                    );
                }
            }
        }
        for rotation in [-0.6, 0.0, 0.8, 1.2] {
            for abduction in [0.3, 0.7, 1.1] {
                let angles = [rotation, abduction, 0.5, 0.6];
                let links = HandLinks {
                    thumb: Some(thumb_links(angles)),
                    ..HandLinks::default()
                };
                let found = links.degrees(Handedness::Right);
                for (sensor, angle) in [
                    GloveSensor::ThumbRotation,
                    GloveSensor::ThumbAbduction,
                    GloveSensor::ThumbMcp,
                    GloveSensor::ThumbIp,
                ]
                .into_iter()
                .zip(angles)
                {
                    near(found[sensor.slot()], angle.to_degrees());
                }
            }
        }
    }
}
