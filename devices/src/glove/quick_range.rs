//! The quick calibration: the wearer moves everything for half a minute, and each sensor's extremes become a
//! joint range.

use crate::calibration::fit::{DEAD_SHARE, DEAD_STEPS, Fit, FitFault, middle};
use crate::calibration::quality::{SensorQuality, Verdict};
use crate::calibration::scale::Scales;
use crate::glove::calibrate::{GloveCalibration, SensorCalibration};
use crate::glove::sensor::GloveSensor;
use crate::reading::GloveReading;

/// The least and greatest raw value of each sensor so far.
#[derive(Debug, Clone, Default)]
pub struct QuickRange {
    scales: Scales,
}

impl QuickRange {
    /// Takes one reading; one that is not valid changes nothing.
    pub fn add(&mut self, reading: &GloveReading) {
        self.scales.add(reading);
    }

    /// Least and greatest raw value of a sensor; `None` when it was never seen.
    #[must_use]
    pub fn extremes(&self, sensor: GloveSensor) -> Option<(f64, f64)> {
        self.scales.extremes(sensor)
    }

    /// `base` with the sensors that moved mapped to [`usual_range_deg`], rising raw values for rising angles. One that
    /// hardly moved against the others is taken for absent.
    ///
    /// # Errors
    /// When nothing moved.
    pub fn fit(&self, base: &GloveCalibration) -> Result<Fit, FitFault> {
        let per_deg = |sensor: GloveSensor| {
            let (least_deg, greatest_deg) = usual_range_deg(sensor);
            let (low, high) = self.extremes(sensor)?;
            Some((high - low) / (greatest_deg - least_deg))
        };
        let usual_gain = middle(GloveSensor::ALL.into_iter().filter_map(per_deg));
        if usual_gain <= 0.0 {
            return Err(FitFault::NothingMoved);
        }
        let mut calibration = base.clone();
        let seen = GloveSensor::ALL.into_iter().filter_map(|sensor| {
            let extremes = self.extremes(sensor)?;
            Some(self.judge(&mut calibration, sensor, extremes, usual_gain))
        });
        let qualities = seen.collect();
        Ok(Fit {
            calibration,
            qualities,
        })
    }

    fn judge(
        &self,
        calibration: &mut GloveCalibration,
        sensor: GloveSensor,
        (low, high): (f64, f64),
        usual_gain: f64,
    ) -> SensorQuality {
        let (least_deg, greatest_deg) = usual_range_deg(sensor);
        let quantum = self.scales.quantum(sensor);
        let least_travel =
            (DEAD_SHARE * usual_gain * (greatest_deg - least_deg)).max(DEAD_STEPS * quantum);
        let quality = SensorQuality {
            sensor,
            travel: high - low,
            noise: 0.0,
            separation: high - low,
            error_deg: f64::INFINITY,
            score: 0.0,
            verdict: Verdict::Dead,
        };
        let line = SensorCalibration::from_two_points((low, least_deg), (high, greatest_deg));
        let Some(line) = line.filter(|_| high - low > least_travel) else {
            calibration.sensors.remove(&sensor);
            calibration.absent.insert(sensor);
            return quality;
        };
        calibration.absent.remove(&sensor);
        calibration.sensors.insert(sensor, line);
        // A step is a uniform error of its length; noise cannot be told from movement here.
        let error_deg = line.gain_deg_per_count.abs() * quantum / 12.0_f64.sqrt();
        quality.of_line(
            error_deg,
            self.scales.is_rail(low) || self.scales.is_rail(high),
        )
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
