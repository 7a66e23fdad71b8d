//! Postures of the hand, found by inverse kinematics: a pinch between thumb and two fingers at any aperture, a pinch
//! between index and middle finger, and postures set by their angles.
//!
//! ```text
//!   seen from the thumb's side, fingers to the left; the grip frame's origin is where the tips meet:
//!
//!            knuckles ______ wrist            +y
//!          index /      \ thumb                │
//!                \  ██  /              -z ─────┘
//!                 ─>██<─               fingertips enter at -z, the thumb's at +z
//! ```

use libm::{cos, sin};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use tsukamu_world::hand::joint::{Finger, JointId, Side};
use tsukamu_world::hand::kinematics::forward;
use tsukamu_world::hand::limits::ADULT_LIMITS;
use tsukamu_world::hand::sample::{FingerAngles, JointAngles, ThumbAngles};
use tsukamu_world::hand::skeleton::Skeleton;

use crate::track::angles_between;

/// Where the tips of a pinch meet in the wrist's space of an adult right hand, metres: there thumb, index and middle
/// finger can face each other from 10 to 105 mm apart with the least strain.
const GRIP_CENTRE: Point3<f64> = Point3::new(-0.0146, -0.0818, -0.1124);
/// How far the line from the thumb to the fingers rises above the wrist's -z, radians.
const GRIP_RISE: f64 = 0.567;
/// Half the distance between index and middle tip in a pinch, metres.
pub(super) const TIP_SPREAD_M: f64 = 0.009;
/// Apertures of the table of pinches: the least, and the step to the next, metres.
const APERTURES: (f64, f64, usize) = (0.010, 0.005, 20);
/// Where index and middle tip meet when they hold something between them, grip frame, metres.
const SCISSOR_CENTRE: Point3<f64> = Point3::new(0.0016, -0.0035, -0.0423);
/// The DIP joint bends with the PIP: this share of it (Hager-Ross & Schieber 2000 find 0.5 to 0.7).
const DIP_SHARE: f64 = 0.6;

/// How a pinch holds fingers that take no part.
const IDLE_FINGER: FingerAngles = FingerAngles {
    mcp_flexion: 0.15,
    pip_flexion: 0.45,
    dip_flexion: 0.27,
    abduction: 0.05,
};
/// A finger that is out of the way in the palm.
const CURLED_FINGER: FingerAngles = FingerAngles {
    mcp_flexion: 1.2,
    pip_flexion: 1.5,
    dip_flexion: 0.8,
    abduction: 0.0,
};
/// The middle of the range in which a pinch moves, where the search begins.
const PINCH: JointAngles = JointAngles {
    thumb: ThumbAngles {
        opposition: 1.02,
        abduction: 1.2,
        mcp_flexion: 0.25,
        ip_flexion: 0.6,
    },
    fingers: [
        FingerAngles {
            mcp_flexion: 0.4,
            pip_flexion: 0.9,
            dip_flexion: 0.54,
            abduction: -0.06,
        },
        FingerAngles {
            mcp_flexion: 0.4,
            pip_flexion: 1.0,
            dip_flexion: 0.6,
            abduction: 0.1,
        },
        IDLE_FINGER,
        IDLE_FINGER,
    ],
    palm_arch: 0.1,
};

/// The postures that one right hand can take.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Postures {
    skeleton: Skeleton,
    pinches: Vec<JointAngles>,
}

impl Postures {
    /// The postures of an adult's hand. The search takes the right one; a left hand takes the same angles.
    pub(super) fn adult() -> Self {
        let skeleton = Skeleton::adult(Side::Right);
        let mut angles = PINCH;
        let pinches = (0..APERTURES.2).map(|index| {
            let half = 0.5 * (APERTURES.0 + APERTURES.1 * index as f64);
            let tips = [
                (Finger::Thumb, [0.0, 0.0, half]),
                (Finger::Index, [-TIP_SPREAD_M, 0.0, -half]),
                (Finger::Middle, [TIP_SPREAD_M, 0.0, -half]),
            ];
            for (finger, tip) in tips {
                angles = reached(&skeleton, &angles, finger, &Point3::from(tip));
            }
            angles
        });
        let pinches = pinches.collect();
        Self { skeleton, pinches }
    }

    /// The pinch whose tips are that far apart, in metres; clamped to what the hand can do.
    pub(super) fn pinch(&self, aperture_m: f64) -> JointAngles {
        let place = ((aperture_m - APERTURES.0) / APERTURES.1).clamp(0.0, (APERTURES.2 - 1) as f64);
        let below = (place as usize).min(APERTURES.2 - 2);
        angles_between(
            &self.pinches[below],
            &self.pinches[below + 1],
            place - below as f64,
        )
    }

    /// Index and middle finger on both sides of [`scissor_centre`], that far apart (metres), the thumb away.
    pub(super) fn scissor(&self, aperture_m: f64) -> JointAngles {
        let half = Vector3::x() * (0.5 * aperture_m);
        let mut angles = PINCH;
        angles.thumb = ThumbAngles {
            opposition: 0.0,
            abduction: 0.9,
            mcp_flexion: 0.0,
            ip_flexion: 0.0,
        };
        angles = reached(
            &self.skeleton,
            &angles,
            Finger::Index,
            &(SCISSOR_CENTRE - half),
        );
        reached(
            &self.skeleton,
            &angles,
            Finger::Middle,
            &(SCISSOR_CENTRE + half),
        )
    }

    /// The index finger with these angles, all others out of the way.
    pub(super) fn pointing(&self, mcp_flexion: f64, pip_flexion: f64) -> JointAngles {
        let index = FingerAngles {
            mcp_flexion,
            pip_flexion,
            dip_flexion: DIP_SHARE * pip_flexion,
            abduction: 0.0,
        };
        JointAngles {
            thumb: ThumbAngles {
                opposition: 0.6,
                abduction: 0.5,
                mcp_flexion: 0.5,
                ip_flexion: 0.6,
            },
            fingers: [index, CURLED_FINGER, CURLED_FINGER, CURLED_FINGER],
            palm_arch: 0.1,
        }
    }

    /// Where a fingertip is in the grip frame, metres.
    pub(super) fn tip(&self, angles: &JointAngles, finger: Finger) -> Point3<f64> {
        grip_from_wrist()
            * forward(&self.skeleton, Side::Right, angles)[JointId::of(finger, 3).index()]
    }
}

/// The pose that takes a right hand's wrist space to the grip frame.
pub(super) fn grip_from_wrist() -> Isometry3<f64> {
    let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
        cos(0.5 * GRIP_RISE),
        -sin(0.5 * GRIP_RISE),
        0.0,
        0.0,
    ));
    let back = turn * -GRIP_CENTRE.coords;
    Isometry3::from_parts(Translation3::from(back), turn)
}

/// Where index and middle tip meet, grip frame, metres.
pub(super) fn scissor_centre() -> Point3<f64> {
    SCISSOR_CENTRE
}

/// Rounds of the search.
const ROUNDS: usize = 60;
/// Change of an angle by which its effect is measured, radians.
const NUDGE: f64 = 1.0e-6;
/// Most that an angle changes in a round, radians.
const STRIDE: f64 = 0.15;
/// Damping of the search, in m²: of directions in which a tip hardly moves.
const DAMPING: f64 = 1.0e-7;

/// The angles with those of one finger changed so that its tip is at a place in the grip frame, or as near as it gets:
/// damped least squares (Wampler 1986).
fn reached(
    skeleton: &Skeleton,
    start: &JointAngles,
    finger: Finger,
    tip: &Point3<f64>,
) -> JointAngles {
    let tip = grip_from_wrist().inverse_transform_point(tip);
    let joint = JointId::of(finger, 3).index();
    let at = |angles: &JointAngles| forward(skeleton, Side::Right, angles)[joint];
    let mut angles = *start;
    for _ in 0..ROUNDS {
        let now = at(&angles);
        let columns: [Vector3<f64>; 4] = std::array::from_fn(|index| {
            let mut nudged = angles;
            nudge(&mut nudged, finger, index, NUDGE);
            (at(&nudged) - now) / NUDGE
        });
        let mut square = Matrix3::identity() * DAMPING;
        for column in &columns {
            square += column * column.transpose();
        }
        let Some(pull) = square.try_inverse().map(|inverse| inverse * (tip - now)) else {
            return angles;
        };
        for (index, column) in columns.iter().enumerate() {
            nudge(
                &mut angles,
                finger,
                index,
                column.dot(&pull).clamp(-STRIDE, STRIDE),
            );
        }
        angles = ADULT_LIMITS.clamped(&angles);
    }
    angles
}

/// Adds to one of the (up to four) independent angles of a finger.
fn nudge(angles: &mut JointAngles, finger: Finger, index: usize, amount: f64) {
    if finger == Finger::Thumb {
        let thumb = &mut angles.thumb;
        let all = [
            &mut thumb.opposition,
            &mut thumb.abduction,
            &mut thumb.mcp_flexion,
            &mut thumb.ip_flexion,
        ];
        *all[index] += amount;
        return;
    }
    let bends = &mut angles.fingers[finger.index() - 1];
    match index {
        0 => bends.mcp_flexion += amount,
        1 => {
            bends.pip_flexion += amount;
            bends.dip_flexion = DIP_SHARE * bends.pip_flexion;
        }
        2 => bends.abduction += amount,
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pinches_are_as_wide_as_asked_and_as_a_hand_can() {
        let postures = Postures::adult();
        for aperture in [0.01, 0.0333, 0.05, 0.08, 0.1] {
            let angles = postures.pinch(aperture);
            let thumb = postures.tip(&angles, Finger::Thumb);
            let [index, middle] =
                [Finger::Index, Finger::Middle].map(|finger| postures.tip(&angles, finger));
            assert!(
                (index.z + aperture / 2.0).abs() < 2e-4 && (middle.z - index.z).abs() < 2e-4,
                "{aperture}"
            );
            assert!(
                (thumb - Point3::new(0.0, 0.0, aperture / 2.0)).norm() < 2e-4,
                "{aperture}: {thumb}"
            );
            assert_eq!(ADULT_LIMITS.clamped(&angles), angles, "{aperture}");
        }
    }

    #[test]
    fn scissors_open_and_close() {
        let postures = Postures::adult();
        for aperture in [0.012, 0.03, 0.05] {
            let angles = postures.scissor(aperture);
            let [index, middle] =
                [Finger::Index, Finger::Middle].map(|finger| postures.tip(&angles, finger));
            assert!(
                (middle - index - Vector3::x() * aperture).norm() < 2e-4,
                "{aperture}: {index} {middle}"
            );
            assert_eq!(ADULT_LIMITS.clamped(&angles), angles, "{aperture}");
        }
    }
}
