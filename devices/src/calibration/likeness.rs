//! Whether a hand that is held still can be in the pose that is asked for, as far as the calibration in force tells.
//!
//! That calibration may be another wearer's or a guess, so it is only asked for what is plain: bent or straight, the
//! thumb across or not, spread or not. A pose that contradicts it counts too, but has to be held longer.

use crate::calibration::pose::{CalibrationPose, full_deg, full_pose};
use crate::glove::sensor::GloveSensor;
use crate::reading::GloveReading;

/// Fingers bent by more than this share of a fist are not straight; the same for a thumb across the palm and a spread.
const NOT_STRAIGHT: f64 = 0.5;
/// Fingers bent by less than this share are no fist.
const NOT_BENT: f64 = 0.35;
/// What should be across the palm, or spread, and is by less than this share, is not.
const NOT_MOVED: f64 = 0.25;

/// Whether the reading is plainly not of this pose. Sensors that a glove lacks say nothing.
pub(crate) fn contradicts(reading: &GloveReading, pose: CalibrationPose) -> bool {
    let of = |full| share(reading, full);
    let above = |share: Option<f64>| share.is_some_and(|share| share > NOT_STRAIGHT);
    let below = |share: Option<f64>, least| share.is_some_and(|share| share < least);
    let bent = of(CalibrationPose::Fist);
    let (across, spread) = (
        of(CalibrationPose::ThumbAcross),
        of(CalibrationPose::Spread),
    );
    match pose {
        CalibrationPose::Flat => above(bent) || above(across) || above(spread),
        CalibrationPose::Fist => below(bent, NOT_BENT),
        CalibrationPose::ThumbAcross => above(bent) || below(across, NOT_MOVED),
        CalibrationPose::Spread => above(bent) || below(spread, NOT_MOVED),
    }
}

/// How far the sensors that are full in a pose are, on average, as a share of that; the thumb's flexion, which every
/// wearer does otherwise, left out. `None` where the glove has none of them.
fn share(reading: &GloveReading, full: CalibrationPose) -> Option<f64> {
    let is_asked = |sensor: &GloveSensor| {
        full_pose(*sensor) == Some(full)
            && !matches!(sensor, GloveSensor::ThumbMcp | GloveSensor::ThumbIp)
    };
    let (mut sum, mut n) = (0.0, 0_u32);
    for sensor in GloveSensor::ALL.into_iter().filter(is_asked) {
        if let Some(angle_rad) = reading.angle_rad(sensor) {
            sum += angle_rad.to_degrees() / full_deg(sensor);
            n += 1;
        }
    }
    (n > 0).then(|| sum / f64::from(n))
}
