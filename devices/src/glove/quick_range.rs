//! The quick calibration: the wearer moves everything for half a minute, and each sensor's extremes become a
//! joint range.

use crate::glove::calibrate::{GloveCalibration, SensorCalibration};
use crate::glove::sensor::GloveSensor;
use crate::reading::GloveReading;

/// Counts that a sensor has to move before its range is believed; one that stays put is taken as absent.
pub const MIN_TRAVEL_COUNTS: f64 = 10.0;

/// The least and greatest counts of each sensor so far.
#[derive(Debug, Clone, Default)]
pub struct QuickRange {
    extremes: [Option<(f64, f64)>; GloveSensor::N_SLOTS],
}

impl QuickRange {
    /// Takes one reading; one that is not valid changes nothing.
    pub fn add(&mut self, reading: &GloveReading) {
        if !reading.angles_valid {
            return;
        }
        for (extreme, sensor) in self.extremes.iter_mut().zip(&reading.sensors) {
            if let Some(raw) = sensor.map(|sensor| sensor.raw) {
                let (low, high) = extreme.unwrap_or((raw, raw));
                *extreme = Some((low.min(raw), high.max(raw)));
            }
        }
    }

    /// Least and greatest counts of a sensor; `None` when it was never seen.
    #[must_use]
    pub fn extremes(&self, sensor: GloveSensor) -> Option<(f64, f64)> {
        self.extremes[sensor.slot()]
    }

    /// `base` with the sensors that moved mapped to [`usual_range_deg`].
    #[must_use]
    pub fn calibration(&self, base: &GloveCalibration) -> GloveCalibration {
        let mut calibration = base.clone();
        for sensor in GloveSensor::ALL {
            let Some((low, high)) = self.extremes(sensor) else {
                continue;
            };
            if high - low < MIN_TRAVEL_COUNTS {
                continue;
            }
            let (min_deg, max_deg) = usual_range_deg(sensor);
            if let Some(fitted) =
                SensorCalibration::from_two_points((low, min_deg), (high, max_deg))
            {
                calibration.sensors.insert(sensor, fitted);
            }
        }
        calibration
    }
}

/// Least and greatest angle in degrees that most hands reach at this sensor.
#[must_use]
pub const fn usual_range_deg(sensor: GloveSensor) -> (f64, f64) {
    match sensor {
        GloveSensor::IndexMcp
        | GloveSensor::MiddleMcp
        | GloveSensor::RingMcp
        | GloveSensor::LittleMcp => (0.0, 90.0),
        GloveSensor::IndexPip
        | GloveSensor::MiddlePip
        | GloveSensor::RingPip
        | GloveSensor::LittlePip => (0.0, 100.0),
        GloveSensor::IndexDip
        | GloveSensor::MiddleDip
        | GloveSensor::RingDip
        | GloveSensor::LittleDip
        | GloveSensor::ThumbIp => (0.0, 80.0),
        GloveSensor::ThumbMcp => (0.0, 60.0),
        GloveSensor::ThumbRotation => (-20.0, 60.0),
        GloveSensor::ThumbAbduction => (0.0, 60.0),
        GloveSensor::MiddleIndexAbduction
        | GloveSensor::RingMiddleAbduction
        | GloveSensor::LittleRingAbduction => (0.0, 30.0),
        GloveSensor::PalmArch => (0.0, 40.0),
        GloveSensor::WristFlexion => (-70.0, 70.0),
        GloveSensor::WristAbduction => (-30.0, 30.0),
    }
}
