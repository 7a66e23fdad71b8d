//! How far a sensor's raw values reach, whatever their unit: counts of 8 or 12 bits, or degrees.

use crate::glove::calibrate::SensorCalibration;
use crate::glove::quick_range::usual_range_deg;
use crate::glove::sensor::GloveSensor;
use crate::reading::{GloveReading, SensorReading};

/// Largest step of a sensor, as a share of what it moved.
const STEP_SHARE_MAX: f64 = 0.02;

/// What is known about one sensor's raw values.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    low: f64,
    high: f64,
    last: f64,
    /// Least change between two readings; infinite while it never changed.
    quantum: f64,
    /// Whether every value was whole.
    is_whole: bool,
    /// The first angle that was not clamped: raw value, degrees.
    first: Option<(f64, f64)>,
    /// Raw units per degree of the calibration in force, found from readings; 0 while that is not known.
    raw_per_deg: f64,
    /// How far apart the two readings were from which that is known, raw units.
    apart: f64,
}

/// What the readings so far tell about the raw values of each sensor.
#[derive(Debug, Clone, Default)]
pub struct Scales {
    seen: [Option<Seen>; GloveSensor::N_SLOTS],
}

impl Scales {
    /// Takes one reading; one that is not valid changes nothing.
    pub fn add(&mut self, reading: &GloveReading) {
        if !reading.angles_valid {
            return;
        }
        for (seen, sensor) in self.seen.iter_mut().zip(&reading.sensors) {
            if let Some(sensor) = sensor.filter(|sensor| sensor.raw.is_finite()) {
                seen.get_or_insert_with(|| Seen::new(sensor.raw))
                    .add(&sensor);
            }
        }
    }

    /// Least and greatest raw value of a sensor so far; `None` when it was never seen.
    #[must_use]
    pub fn extremes(&self, sensor: GloveSensor) -> Option<(f64, f64)> {
        self.seen[sensor.slot()].map(|seen| (seen.low, seen.high))
    }

    /// The least step in which a sensor's raw value changes; 0 while it never changed. A sensor that was only seen to jump
    /// is believed to have steps of a whole unit, or of a small share of what it moved.
    #[must_use]
    pub fn quantum(&self, sensor: GloveSensor) -> f64 {
        let Some(seen) = self.seen[sensor.slot()].filter(|seen| seen.quantum.is_finite()) else {
            return 0.0;
        };
        let share = STEP_SHARE_MAX * (seen.high - seen.low);
        let most = if seen.is_whole { share.max(1.0) } else { share };
        seen.quantum.min(most)
    }

    /// Raw units that the usual range of a sensor spans: as far as it was seen to move, or as far as the calibration in
    /// force expects it to, whichever is more. 0 for a sensor that never changed.
    #[must_use]
    pub fn reach(&self, sensor: GloveSensor) -> f64 {
        self.seen[sensor.slot()].map_or(0.0, |seen| {
            let (least, greatest) = usual_range_deg(sensor);
            (seen.high - seen.low).max(seen.raw_per_deg * (greatest - least))
        })
    }

    /// Whether a raw value is the end of an analogue converter's range: 0 or 1 below; 254, 255, 1023, 4094 or 4095 above,
    /// by the greatest value of all sensors. Never for a glove whose values are fractions or negative: it computes them.
    #[must_use]
    pub fn is_rail(&self, raw: f64) -> bool {
        let all = || self.seen.iter().flatten();
        let is_counts = |seen: &Seen| seen.low >= 0.0 && seen.is_whole;
        if !all().all(is_counts) {
            return false;
        }
        let greatest = all().fold(0.0_f64, |greatest, seen| greatest.max(seen.high));
        let top = match greatest {
            _ if greatest > 1023.0 => 4094.0,
            _ if greatest > 255.0 => 1023.0,
            _ => 254.0,
        };
        raw <= 1.0 || raw >= top
    }
}

impl Seen {
    fn new(raw: f64) -> Self {
        Self {
            low: raw,
            high: raw,
            last: raw,
            quantum: f64::INFINITY,
            is_whole: raw.fract() == 0.0,
            first: None,
            raw_per_deg: 0.0,
            apart: 0.0,
        }
    }

    fn add(&mut self, sensor: &SensorReading) {
        let raw = sensor.raw;
        let step = (raw - self.last).abs();
        if step > 0.0 {
            self.quantum = self.quantum.min(step);
        }
        self.last = raw;
        self.is_whole &= raw.fract() == 0.0;
        self.low = self.low.min(raw);
        self.high = self.high.max(raw);
        if sensor.clamped || !sensor.angle_rad.is_finite() {
            return;
        }
        let angle_deg = sensor.angle_rad.to_degrees();
        let (first_raw, first_deg) = *self.first.get_or_insert((raw, angle_deg));
        let (apart, turn) = ((raw - first_raw).abs(), (angle_deg - first_deg).abs());
        // The farther apart, the less a coupled sensor in between matters.
        if apart > self.apart && turn > 1e-9 {
            self.apart = apart;
            self.raw_per_deg = apart / turn;
        }
    }
}

/// A line with a range that leaves room beyond the usual one: a wearer goes a little farther now and then.
#[must_use]
pub(crate) fn with_room(mut line: SensorCalibration, sensor: GloveSensor) -> SensorCalibration {
    /// Room on each side, as a share of the usual range, and at least so many degrees.
    const ROOM: (f64, f64) = (0.15, 10.0);
    let (least, greatest) = usual_range_deg(sensor);
    let room = (ROOM.0 * (greatest - least)).max(ROOM.1);
    line.min_deg = least - room;
    line.max_deg = greatest + room;
    line
}

#[cfg(test)]
mod tests {
    use super::Scales;
    use crate::glove::sensor::GloveSensor;
    use crate::reading::{GloveReading, SensorReading};

    const SENSOR: GloveSensor = GloveSensor::IndexMcp;

    fn reading(raw: f64, angle_deg: f64, clamped: bool) -> GloveReading {
        let mut reading = GloveReading {
            angles_valid: true,
            ..GloveReading::empty(0, 0)
        };
        reading.sensors[SENSOR.slot()] = Some(SensorReading {
            raw,
            angle_rad: angle_deg.to_radians(),
            clamped,
        });
        reading
    }

    #[test]
    fn the_reach_comes_from_the_calibration_in_force_or_from_what_was_seen() {
        let mut scales = Scales::default();
        assert_eq!(scales.extremes(SENSOR), None);
        scales.add(&reading(100.0, 30.0, false));
        assert_eq!((scales.reach(SENSOR), scales.quantum(SENSOR)), (0.0, 0.0));
        scales.add(&reading(104.0, 32.0, false));
        assert!(
            (scales.reach(SENSOR) - 180.0).abs() < 1e-9,
            "90° at half a degree"
        );
        scales.add(&reading(400.0, 107.0, true));
        assert!(
            (scales.reach(SENSOR) - 300.0).abs() < 1e-9,
            "it went farther"
        );
        assert_eq!(scales.extremes(SENSOR), Some((100.0, 400.0)));
        assert_eq!(scales.quantum(SENSOR), 4.0);
    }

    #[test]
    fn the_ends_of_a_converter_are_known_by_what_it_sends() {
        let rails = |values: &[f64], raw: f64| {
            let mut scales = Scales::default();
            values
                .iter()
                .for_each(|raw| scales.add(&reading(*raw, 0.0, false)));
            scales.is_rail(raw)
        };
        assert!(rails(&[1.0, 254.0], 254.0) && rails(&[1.0, 254.0], 1.0));
        assert!(!rails(&[40.0, 600.0], 254.0) && rails(&[40.0, 1023.0], 1023.0));
        assert!(!rails(&[0.0, 4000.0], 1023.0) && rails(&[0.0, 4095.0], 4095.0));
        assert!(!rails(&[0.0, 12.5], 0.0), "degrees have no rails");
        assert!(!rails(&[-3.0, 90.0], 0.0), "degrees have no rails");
    }
}
