//! What a LucidGlove's numbers mean as long as no wearer's calibration says it.

use crate::glove::calibrate::SensorCalibration;
use crate::glove::quick_range::usual_range_deg;
use crate::glove::sensor::GloveSensor;

/// Angle of a finger at full splay, degrees; the SteamVR driver turns by as much.
const SPLAY_DEG: f64 = 20.0;

/// The line from 0 to `max` counts to a joint's usual range.
///
/// The firmware has already set 0 to the straight and `max` to the bent finger. A relative abduction, which is made of
/// two splays, is 0 in the middle.
#[must_use]
pub fn default_of(sensor: GloveSensor, max: u16) -> SensorCalibration {
    let (min_deg, max_deg) = match sensor {
        GloveSensor::MiddleIndexAbduction
        | GloveSensor::RingMiddleAbduction
        | GloveSensor::LittleRingAbduction => (-2.0 * SPLAY_DEG, 2.0 * SPLAY_DEG),
        // A thumb that bends comes across the palm, and its splay reaches from the palm's side to its front.
        GloveSensor::ThumbRotation => (0.0, 70.0),
        GloveSensor::ThumbAbduction => (0.0, 75.0),
        other => usual_range_deg(other),
    };
    SensorCalibration::from_two_points((0.0, min_deg), (f64::from(max.max(1)), max_deg))
        .unwrap_or_else(|| SensorCalibration::default_of(sensor))
}
