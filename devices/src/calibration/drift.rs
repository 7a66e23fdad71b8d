//! Whether a wearer's calibration still fits: told while the glove runs, from its readings alone.
//!
//! Two signs are looked for over the last minute. A sensor whose angle is clamped most of the time is out of its range:
//! another wearer, a slipped glove. A joint that moves and yet never straightens has a zero that drifted.

use crate::glove::quick_range::usual_range_deg;
use crate::glove::sensor::GloveSensor;
use crate::reading::GloveReading;

/// Parts of the minute that is looked at, and the length of one, ns.
const PARTS: (usize, u64) = (6, 10_000_000_000);
/// Readings before anything is said: some seconds of any glove.
const READINGS_MIN: u64 = 60;
/// Share of clamped readings from which a sensor is out of range.
const CLAMPED_SHARE: f64 = 0.5;
/// How far a joint has to move within the minute before its zero is judged, as a share of its usual range.
const MOVES_SHARE: f64 = 0.4;
/// How far from straight the straightest moment of a minute may be, degrees.
const ZERO_SHIFT_DEG: f64 = 20.0;

#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    n: u64,
    n_clamped: u64,
    least_deg: f64,
    greatest_deg: f64,
}

impl Part {
    const EMPTY: Self = Self {
        n: 0,
        n_clamped: 0,
        least_deg: f64::INFINITY,
        greatest_deg: f64::NEG_INFINITY,
    };

    fn and(self, other: &Self) -> Self {
        Self {
            n: self.n + other.n,
            n_clamped: self.n_clamped + other.n_clamped,
            least_deg: self.least_deg.min(other.least_deg),
            greatest_deg: self.greatest_deg.max(other.greatest_deg),
        }
    }
}

/// Watches one glove. Costs a few additions for each sensor of a reading, and allocates nothing.
#[derive(Debug, Clone)]
pub struct DriftWatch {
    /// Which ten seconds each part is of, since the clock's start.
    indices: [u64; PARTS.0],
    parts: [[Part; GloveSensor::N_SLOTS]; PARTS.0],
    n_angles: u64,
    n_clamped: u64,
}

/// What the last minute says.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriftReport {
    /// Share of all angles of the minute that were clamped, 0 to 1.
    pub clamped_share: f64,
    /// The sensor that is clamped most, with its share; `None` while none is.
    pub worst: Option<(GloveSensor, f64)>,
    /// Whether that one is clamped so often that the calibration does not fit.
    pub is_out_of_range: bool,
    /// The joint whose zero drifted most: the sensor, and how far from straight it stays, degrees; `None` while none did.
    pub zero_shift: Option<(GloveSensor, f64)>,
    /// Angles since the watch began; never goes back.
    pub n_angles: u64,
    /// How many of them were clamped; never goes back.
    pub n_clamped: u64,
}

impl Default for DriftWatch {
    fn default() -> Self {
        Self {
            indices: [0; PARTS.0],
            parts: [[Part::EMPTY; GloveSensor::N_SLOTS]; PARTS.0],
            n_angles: 0,
            n_clamped: 0,
        }
    }
}

impl DriftWatch {
    /// Takes one reading; one that is not valid changes nothing.
    pub fn add(&mut self, reading: &GloveReading) {
        if !reading.angles_valid {
            return;
        }
        let index = reading.stamp_ns / PARTS.1;
        let place = (index % PARTS.0 as u64) as usize;
        if self.indices[place] != index {
            self.indices[place] = index;
            self.parts[place] = [Part::EMPTY; GloveSensor::N_SLOTS];
        }
        for (part, sensor) in self.parts[place].iter_mut().zip(&reading.sensors) {
            let Some(sensor) = sensor else { continue };
            let angle_deg = sensor.angle_rad.to_degrees();
            part.n += 1;
            part.n_clamped += u64::from(sensor.clamped);
            part.least_deg = part.least_deg.min(angle_deg);
            part.greatest_deg = part.greatest_deg.max(angle_deg);
            self.n_angles += 1;
            self.n_clamped += u64::from(sensor.clamped);
        }
    }

    /// Forgets the minute: the wearer or the calibration is another. The counters stay.
    pub fn forget(&mut self) {
        *self = Self {
            n_angles: self.n_angles,
            n_clamped: self.n_clamped,
            ..Self::default()
        };
    }

    /// What the minute before a monotonic time says, ns.
    #[must_use]
    pub fn report(&self, now_ns: u64) -> DriftReport {
        let oldest = (now_ns / PARTS.1).saturating_sub(PARTS.0 as u64 - 1);
        let minute = |sensor: GloveSensor| {
            let recent = self
                .indices
                .iter()
                .zip(&self.parts)
                .filter(|(index, _)| **index >= oldest);
            recent.fold(Part::EMPTY, |sum, (_, part)| sum.and(&part[sensor.slot()]))
        };
        let mut report = DriftReport {
            n_angles: self.n_angles,
            n_clamped: self.n_clamped,
            ..DriftReport::default()
        };
        let (mut n, mut n_clamped) = (0, 0);
        for sensor in GloveSensor::ALL {
            let part = minute(sensor);
            if part.n < READINGS_MIN {
                continue;
            }
            n += part.n;
            n_clamped += part.n_clamped;
            let share = part.n_clamped as f64 / part.n as f64;
            if share > report.worst.map_or(0.0, |(_, worst)| worst) {
                report.worst = Some((sensor, share));
            }
            if let Some(shift_deg) = zero_shift_deg(sensor, &part)
                && report.zero_shift.is_none_or(|(_, worst)| shift_deg > worst)
            {
                report.zero_shift = Some((sensor, shift_deg));
            }
        }
        report.is_out_of_range = report
            .worst
            .is_some_and(|(_, share)| share >= CLAMPED_SHARE);
        if n > 0 {
            report.clamped_share = n_clamped as f64 / n as f64;
        }
        report
    }
}

/// How far from straight a joint stays that moves; `None` for one that straightens, hardly moves, or bends both ways.
fn zero_shift_deg(sensor: GloveSensor, part: &Part) -> Option<f64> {
    let (least_deg, greatest_deg) = usual_range_deg(sensor);
    let bends_one_way = least_deg >= 0.0 && greatest_deg >= 60.0;
    let moves = part.greatest_deg - part.least_deg >= MOVES_SHARE * (greatest_deg - least_deg);
    (bends_one_way && moves && part.least_deg >= ZERO_SHIFT_DEG).then_some(part.least_deg)
}

#[cfg(test)]
mod tests {
    use super::DriftWatch;
    use crate::glove::sensor::GloveSensor;
    use crate::reading::{GloveReading, SensorReading};

    const SECOND_NS: u64 = 1_000_000_000;

    /// A minute at 100 Hz in which one joint swings between two angles, clamped above a third.
    fn swing(watch: &mut DriftWatch, start_s: u64, low_deg: f64, high_deg: f64, max_deg: f64) {
        for k in 0..6000_u64 {
            let free = low_deg + (high_deg - low_deg) * (k as f64 * 0.02).sin().powi(2);
            let mut reading = GloveReading {
                angles_valid: true,
                ..GloveReading::empty(start_s * SECOND_NS + k * SECOND_NS / 100, k)
            };
            reading.sensors[GloveSensor::IndexPip.slot()] = Some(SensorReading {
                raw: free,
                angle_rad: free.min(max_deg).to_radians(),
                clamped: free > max_deg,
            });
            watch.add(&reading);
        }
    }

    #[test]
    fn a_good_minute_says_nothing() {
        let mut watch = DriftWatch::default();
        assert_eq!(watch.report(0), super::DriftReport::default());
        swing(&mut watch, 0, 0.0, 95.0, 100.0);
        let report = watch.report(59 * SECOND_NS);
        assert_eq!(
            (report.is_out_of_range, report.worst, report.zero_shift),
            (false, None, None)
        );
        assert_eq!((report.n_angles, report.n_clamped), (6000, 0));
    }

    #[test]
    fn a_sensor_that_stays_clamped_is_out_of_range_until_it_is_not() {
        let mut watch = DriftWatch::default();
        swing(&mut watch, 0, 0.0, 200.0, 80.0);
        let report = watch.report(59 * SECOND_NS);
        assert!(report.is_out_of_range, "{report:?}");
        let (sensor, share) = report.worst.unwrap();
        assert_eq!(sensor, GloveSensor::IndexPip);
        assert!((0.5..0.7).contains(&share) && (report.clamped_share - share).abs() < 1e-12);
        swing(&mut watch, 60, 0.0, 79.0, 80.0);
        let after = watch.report(119 * SECOND_NS);
        assert!(!after.is_out_of_range && after.worst.is_none());
        assert_eq!(after.n_clamped, report.n_clamped, "counters never go back");
        swing(&mut watch, 120, 0.0, 200.0, 80.0);
        watch.forget();
        assert!(!watch.report(179 * SECOND_NS).is_out_of_range);
    }

    #[test]
    fn a_joint_that_moves_and_never_straightens_has_drifted() {
        let mut watch = DriftWatch::default();
        swing(&mut watch, 0, 30.0, 95.0, 100.0);
        let (sensor, shift_deg) = watch.report(59 * SECOND_NS).zero_shift.unwrap();
        assert_eq!(sensor, GloveSensor::IndexPip);
        assert!((shift_deg - 30.0).abs() < 1.0);
        let mut fist = DriftWatch::default();
        swing(&mut fist, 0, 80.0, 95.0, 100.0);
        assert_eq!(
            fist.report(59 * SECOND_NS).zero_shift,
            None,
            "a fist is no drift"
        );
        assert_eq!(watch.report(600 * SECOND_NS).zero_shift, None, "long ago");
    }
}
