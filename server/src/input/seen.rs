//! What a source says: a sample, or a half of one, with its times.

use nalgebra::Isometry3;
use tsukamu_world::hand::sample::{FingerPose, HandSample, JointAngles};

/// Largest joint angle that is believed, rad: no hand has it, and what reckons with it stays finite. One number near the
/// end of floats would stay in a filter for good.
const ANGLE_MAX_RAD: f64 = 1000.0;

/// What a source has seen; `None` says that it has lost the hand. A glove and a tracker speak of one half each, at rates
/// and times of their own.
#[derive(Clone, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "a box would allocate for every sample, and they are few"
)]
pub enum Seen {
    /// A whole hand.
    Whole(Option<HandSample>),
    /// A tracker: `world_from_wrist`.
    Wrist(Option<Isometry3<f64>>),
    /// A glove: the joint angles.
    Fingers(Option<JointAngles>),
}

impl Seen {
    /// Whether nothing of it is a number that is none, or beyond the reach of a world or a joint.
    pub(super) fn is_valid(&self) -> bool {
        let is_valid = |wrist: &Isometry3<f64>, angles: &JointAngles| {
            let (wrist, fingers) = (*wrist, FingerPose::Angles(*angles));
            HandSample { wrist, fingers }.is_valid()
        };
        // Written so that an angle that is not a number fails too.
        let are_angles = |angles: &JointAngles| {
            let list = angles.to_list();
            list.iter().all(|angle| angle.abs() <= ANGLE_MAX_RAD)
        };
        match self {
            Self::Whole(sample) => sample.as_ref().is_none_or(|sample| {
                let are_angles = match &sample.fingers {
                    FingerPose::Angles(angles) => are_angles(angles),
                    FingerPose::Points(_) => true,
                };
                are_angles && sample.is_valid()
            }),
            Self::Wrist(wrist) => wrist
                .as_ref()
                .is_none_or(|wrist| is_valid(wrist, &JointAngles::default())),
            Self::Fingers(angles) => angles.as_ref().is_none_or(are_angles),
        }
    }
}

/// A sample on its way to the tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrived {
    /// The source's own stamp in nanoseconds, 0 where it has none.
    pub source_ns: u64,
    /// Arrival, monotonic nanoseconds of the daemon.
    pub arrival_ns: u64,
    /// When the source took it, as far as that can be told, monotonic nanoseconds of the daemon; the arrival where
    /// nothing more is known, and never later.
    pub fitted_ns: u64,
    /// The device's own counter with what is new; `None` where it has none.
    pub ticks: Option<u64>,
    /// What was seen.
    pub seen: Seen,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_that_no_joint_has_are_not_valid() {
        let with = |angle: f64| JointAngles {
            palm_arch: angle,
            ..JointAngles::default()
        };
        let whole = |angle: f64| {
            let (wrist, fingers) = (Isometry3::identity(), FingerPose::Angles(with(angle)));
            Seen::Whole(Some(HandSample { wrist, fingers }))
        };
        for bad in [f64::NAN, f64::INFINITY, f64::MAX, -1.0e300] {
            assert!(!Seen::Fingers(Some(with(bad))).is_valid(), "{bad}");
            assert!(!whole(bad).is_valid(), "{bad}");
        }
        assert!(Seen::Fingers(Some(with(-7.0))).is_valid());
        assert!(whole(7.0).is_valid());
    }
}
