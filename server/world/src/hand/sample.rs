//! What every input ends in: one hand at one time.

use nalgebra::{Isometry3, Point3};

use super::joint::N_JOINTS;
use crate::scene::COORDINATE_MAX_M;

/// One hand at one time: where the wrist is and how the fingers stand.
///
/// A glove, a recording, a synthetic hand and a remote client all end in this type.
#[derive(Clone, Debug, PartialEq)]
pub struct HandSample {
    /// `world_from_wrist`: the reference point and its orientation. The wrist's space is that of OpenXR:
    /// -z toward the fingers, +y out of the back of the hand, +x to the right (both hands).
    pub wrist: Isometry3<f64>,
    /// How the fingers stand.
    pub fingers: FingerPose,
}

/// How the fingers of a sample stand.
#[derive(Clone, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "a box would allocate in every step, and samples are few"
)]
pub enum FingerPose {
    /// Joint angles of a glove; forward kinematics with the wearer's skeleton makes the points.
    Angles(JointAngles),
    /// Joint positions as an optical tracker or a file gives them: world space, metres.
    /// `None` is "not tracked": the joint keeps its last place in the wrist's space.
    Points([Option<Point3<f64>>; N_JOINTS]),
}

/// Angles of all joints of one hand, in radians. Flexion and abduction are positive as in clinical use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointAngles {
    /// The thumb's joints.
    pub thumb: ThumbAngles,
    /// Index, middle, ring and little finger.
    pub fingers: [FingerAngles; 4],
    /// Arching of the palm: the little finger's metacarpal folds toward the thumb.
    pub palm_arch: f64,
}

/// Joint angles of a hand: 4 of the thumb, 4 of each other finger, and the palm's arch.
pub const N_ANGLES: usize = 21;

/// Angles of the thumb, in radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ThumbAngles {
    /// Opposition at the CMC: 0 beside the palm, positive turns the thumb across it.
    pub opposition: f64,
    /// Abduction at the CMC: 0 against the index finger, positive away from it.
    pub abduction: f64,
    /// Flexion of the MCP.
    pub mcp_flexion: f64,
    /// Flexion of the IP.
    pub ip_flexion: f64,
}

/// Angles of one finger other than the thumb, in radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FingerAngles {
    /// Flexion of the MCP (knuckle).
    pub mcp_flexion: f64,
    /// Flexion of the PIP.
    pub pip_flexion: f64,
    /// Flexion of the DIP.
    pub dip_flexion: f64,
    /// Swing away from the middle finger's line; for the middle finger, toward the thumb.
    pub abduction: f64,
}

impl HandSample {
    /// Whether every number is finite and every place within the reach of a world, [`COORDINATE_MAX_M`]. The world takes
    /// a sample that is not valid for none.
    pub fn is_valid(&self) -> bool {
        let within = |place: &Point3<f64>| place.iter().all(|x| x.abs() <= COORDINATE_MAX_M);
        let fingers = match &self.fingers {
            FingerPose::Angles(_) => true,
            FingerPose::Points(points) => points.iter().flatten().all(within),
        };
        self.is_finite() && fingers && within(&self.wrist.translation.vector.into())
    }

    /// Whether every number is finite. A sample that is not is no valid sample: inputs drop it and count it.
    pub fn is_finite(&self) -> bool {
        let wrist = self.wrist.translation.vector.iter().all(|x| x.is_finite())
            && self.wrist.rotation.coords.iter().all(|x| x.is_finite());
        wrist
            && match &self.fingers {
                FingerPose::Angles(angles) => angles.is_finite(),
                FingerPose::Points(points) => points
                    .iter()
                    .flatten()
                    .all(|p| p.coords.iter().all(|x| x.is_finite())),
            }
    }
}

impl JointAngles {
    /// Whether every angle is finite.
    pub fn is_finite(&self) -> bool {
        self.to_list().iter().all(|angle| angle.is_finite())
    }

    /// All angles: thumb opposition, abduction, MCP and IP flexion; then MCP, PIP, DIP flexion and abduction of index,
    /// middle, ring and little finger; then the palm's arch.
    pub fn to_list(&self) -> [f64; N_ANGLES] {
        let mut list = [0.0; N_ANGLES];
        let thumb = &self.thumb;
        list[..4].copy_from_slice(&[
            thumb.opposition,
            thumb.abduction,
            thumb.mcp_flexion,
            thumb.ip_flexion,
        ]);
        for (four, finger) in list[4..20].chunks_exact_mut(4).zip(&self.fingers) {
            four.copy_from_slice(&[
                finger.mcp_flexion,
                finger.pip_flexion,
                finger.dip_flexion,
                finger.abduction,
            ]);
        }
        list[20] = self.palm_arch;
        list
    }

    /// The angles of such a list.
    pub fn from_list(list: &[f64; N_ANGLES]) -> Self {
        let finger = |f: usize| FingerAngles {
            mcp_flexion: list[4 + 4 * f],
            pip_flexion: list[5 + 4 * f],
            dip_flexion: list[6 + 4 * f],
            abduction: list[7 + 4 * f],
        };
        Self {
            thumb: ThumbAngles {
                opposition: list[0],
                abduction: list[1],
                mcp_flexion: list[2],
                ip_flexion: list[3],
            },
            fingers: std::array::from_fn(finger),
            palm_arch: list[20],
        }
    }
}
