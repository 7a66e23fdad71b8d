//! The makers' own calibration of simple gloves: what a sensor has shown so far, least to greatest, is the range of its
//! joint. It goes on as long as the glove is worn.

use crate::glove::calibrate::{GloveCalibration, SensorCalibration};
use crate::glove::quick_range::usual_range_deg;
use crate::glove::sensor::GloveSensor;

/// Share of the device's whole span that a sensor has to move before its range is believed.
const MIN_TRAVEL: f64 = 0.05;

/// The least and greatest raw values of each sensor, with single outliers left out.
#[derive(Debug, Clone, Default)]
pub(crate) struct AutoRange {
    tracks: [Track; GloveSensor::N_SLOTS],
}

#[derive(Debug, Clone, Copy, Default)]
struct Track {
    /// The last two values: an extreme counts as far as one of its neighbours in time confirms it.
    before: [Option<f64>; 2],
    range: Option<(f64, f64)>,
}

impl Track {
    /// Takes a value; true when the range has grown.
    fn add(&mut self, value: f64) -> bool {
        let [Some(first), Some(second)] = self.before else {
            self.before = [self.before[1], Some(value)];
            return false;
        };
        self.before = [Some(second), Some(value)];
        let median = first.max(second).min(first.min(second).max(value));
        let (low, high) = self.range.unwrap_or((median, median));
        let grown = (low.min(median), high.max(median));
        let is_new = self.range != Some(grown);
        self.range = Some(grown);
        is_new
    }
}

impl AutoRange {
    /// Takes one sample of a device whose raw values span `span`, and sets the sensors of `calibration` that it knows
    /// better now; those of `fixed` (by wire slot) stay.
    pub(crate) fn add(
        &mut self,
        raw: &[Option<f64>; GloveSensor::N_SLOTS],
        span: f64,
        fixed: &[bool; GloveSensor::N_SLOTS],
        calibration: &mut GloveCalibration,
    ) {
        for sensor in GloveSensor::ALL {
            let slot = sensor.slot();
            let Some(value) = raw[slot].filter(|_| !fixed[slot]) else {
                continue;
            };
            let track = &mut self.tracks[slot];
            if !track.add(value) {
                continue;
            }
            let Some((low, high)) = track.range else {
                continue;
            };
            if high - low < MIN_TRAVEL * span {
                continue;
            }
            let (min_deg, max_deg) = usual_range_deg(sensor);
            // A device that counts backwards keeps its direction.
            let falls = calibration.sensor(sensor).gain_deg_per_count < 0.0;
            let (at_min, at_max) = if falls { (high, low) } else { (low, high) };
            if let Some(fitted) =
                SensorCalibration::from_two_points((at_min, min_deg), (at_max, max_deg))
            {
                calibration.sensors.insert(sensor, fitted);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::AutoRange;
    use crate::glove::calibrate::{GloveCalibration, SensorCalibration};
    use crate::glove::sensor::GloveSensor;

    const SENSOR: GloveSensor = GloveSensor::IndexMcp;

    fn angle_after(values: &[f64], gain: f64, fixed: bool) -> f64 {
        let mut calibration = GloveCalibration::default();
        let start = SensorCalibration {
            gain_deg_per_count: gain,
            ..SensorCalibration::default_of(SENSOR)
        };
        calibration.sensors.insert(SENSOR, start);
        let mut range = AutoRange::default();
        let mut raw = [None; GloveSensor::N_SLOTS];
        for value in values {
            raw[SENSOR.slot()] = Some(*value);
            range.add(
                &raw,
                255.0,
                &[fixed; GloveSensor::N_SLOTS],
                &mut calibration,
            );
        }
        let reading = calibration.angles(&raw)[SENSOR.slot()].unwrap();
        reading.angle_rad.to_degrees()
    }

    #[test]
    fn the_range_grows_with_what_is_shown() {
        let opened_and_closed = [50.0, 50.0, 50.0, 120.0, 150.0, 150.0, 100.0];
        assert!((angle_after(&opened_and_closed, 0.5, false) - 45.0).abs() < 1e-9);
        assert!((angle_after(&opened_and_closed, -0.5, false) - 45.0).abs() < 1e-9);
        // One wild value changes nothing.
        let mut wild = opened_and_closed.to_vec();
        wild.extend([255.0, 100.0, 0.0, 100.0]);
        assert!((angle_after(&wild, 0.5, false) - 45.0).abs() < 1e-9);
    }

    #[test]
    fn a_little_movement_and_a_calibrated_sensor_change_nothing() {
        let as_before = |angle_deg: f64| (angle_deg - 0.5 * (100.0 - 40.0)).abs() < 1e-9;
        let little = [95.0, 95.0, 95.0, 100.0, 100.0];
        assert!(as_before(angle_after(&little, 0.5, false)));
        let far = [50.0, 50.0, 50.0, 150.0, 150.0, 100.0];
        assert!(as_before(angle_after(&far, 0.5, true)));
    }
}
