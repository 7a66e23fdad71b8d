//! The poses of the guided calibration, and the angle that each sensor has in them.

use crate::glove::quick_range::usual_range_deg;
use crate::glove::sensor::GloveSensor;

/// A pose that the wearer holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CalibrationPose {
    /// The hand lies flat: every flexion, abduction and the arch are 0.
    Flat,
    /// Every finger is bent fully, the thumb closed over them.
    Fist,
    /// The thumb lies across the palm, at the base of the little finger.
    ThumbAcross,
    /// All fingers are as far apart as they go, the thumb too.
    Spread,
}

impl CalibrationPose {
    /// Every pose, in the order of the routine.
    pub const ALL: [Self; 4] = [Self::Flat, Self::Fist, Self::ThumbAcross, Self::Spread];

    /// The name on the wire and in messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Fist => "fist",
            Self::ThumbAcross => "thumb_across",
            Self::Spread => "spread",
        }
    }

    /// What the wearer is told.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Flat => {
                "Lay the hand flat on the table: fingers straight and together, the thumb against the index finger."
            }
            Self::Fist => "Make a fist: every finger fully bent, the thumb closed over them.",
            Self::ThumbAcross => {
                "Open the fingers and lay the thumb across the palm, its tip at the base of the little finger."
            }
            Self::Spread => {
                "Spread all fingers as wide as they go, palm flat, the thumb far out to the side."
            }
        }
    }

    /// The angle of a sensor in this pose, degrees; `None` where the pose leaves it open. The wrist's sensors have one
    /// in the flat pose only: the routine finds their zero, not their gain.
    #[must_use]
    pub const fn target_deg(self, sensor: GloveSensor) -> Option<f64> {
        if matches!(self, Self::Flat) {
            return Some(0.0);
        }
        match full_pose(sensor) {
            Some(full) if full as u8 == self as u8 => Some(full_deg(sensor)),
            _ => None,
        }
    }
}

/// The pose in which a sensor is as far as it goes; `None` for the wrist's, of which no pose asks anything.
#[must_use]
pub const fn full_pose(sensor: GloveSensor) -> Option<CalibrationPose> {
    match sensor {
        GloveSensor::ThumbMcp
        | GloveSensor::ThumbIp
        | GloveSensor::IndexMcp
        | GloveSensor::IndexPip
        | GloveSensor::IndexDip
        | GloveSensor::MiddleMcp
        | GloveSensor::MiddlePip
        | GloveSensor::MiddleDip
        | GloveSensor::RingMcp
        | GloveSensor::RingPip
        | GloveSensor::RingDip
        | GloveSensor::LittleMcp
        | GloveSensor::LittlePip
        | GloveSensor::LittleDip => Some(CalibrationPose::Fist),
        GloveSensor::ThumbRotation | GloveSensor::PalmArch => Some(CalibrationPose::ThumbAcross),
        GloveSensor::ThumbAbduction
        | GloveSensor::MiddleIndexAbduction
        | GloveSensor::RingMiddleAbduction
        | GloveSensor::LittleRingAbduction => Some(CalibrationPose::Spread),
        GloveSensor::WristFlexion | GloveSensor::WristAbduction => None,
    }
}

/// The angle of a sensor in its full pose, degrees: the top of its usual range, but neighbouring fingers spread so that
/// each stays within what the hand model allows.
#[must_use]
pub const fn full_deg(sensor: GloveSensor) -> f64 {
    match sensor {
        GloveSensor::MiddleIndexAbduction => 25.0,
        GloveSensor::RingMiddleAbduction => 15.0,
        GloveSensor::LittleRingAbduction => 13.0,
        _ => usual_range_deg(sensor).1,
    }
}

#[cfg(test)]
mod tests {
    use super::{CalibrationPose, full_pose};
    use crate::glove::sensor::GloveSensor;

    #[test]
    fn each_sensor_has_a_zero_and_one_other_angle() {
        for sensor in GloveSensor::ALL {
            assert_eq!(CalibrationPose::Flat.target_deg(sensor), Some(0.0));
            let others: Vec<CalibrationPose> = CalibrationPose::ALL
                .into_iter()
                .skip(1)
                .filter(|pose| pose.target_deg(sensor).is_some())
                .collect();
            assert_eq!(others, Vec::from_iter(full_pose(sensor)), "{sensor:?}");
        }
        let fist = CalibrationPose::Fist.target_deg(GloveSensor::IndexMcp);
        assert_eq!(fist, Some(90.0));
    }
}
