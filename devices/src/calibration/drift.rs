//! Whether the zeros of a wearer's calibration still fit: told while the glove runs, from its readings alone.
//!
//! A hand that works straightens its fingers now and then. A joint that moves and yet was never straight within a minute
//! has a zero that drifted: the glove has slipped, or sits on another hand. That an angle leaves the range altogether is
//! told by the readings themselves ([`SensorReading::clamped`](crate::reading::SensorReading::clamped)).

use crate::glove::quick_range::usual_range_deg;
use crate::glove::sensor::GloveSensor;
use crate::reading::GloveReading;

/// Parts of the minute that is looked at, and the length of one, ns.
const PARTS: (usize, u64) = (6, 10_000_000_000);
/// Readings before anything is said: some seconds of any glove.
const READINGS_MIN: u32 = 60;
/// How far a joint has to move within the minute before its zero is judged, as a share of its usual range.
const MOVES_SHARE: f64 = 0.4;
/// Least angle that a joint usually reaches for its zero to be judged, degrees.
const BENDS_DEG: f64 = 60.0;

#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    n: u32,
    least_deg: f64,
    greatest_deg: f64,
}

impl Part {
    const EMPTY: Self = Self {
        n: 0,
        least_deg: f64::INFINITY,
        greatest_deg: f64::NEG_INFINITY,
    };

    fn and(self, other: &Self) -> Self {
        Self {
            n: self.n.saturating_add(other.n),
            least_deg: self.least_deg.min(other.least_deg),
            greatest_deg: self.greatest_deg.max(other.greatest_deg),
        }
    }
}

/// Watches one glove. Costs a few comparisons for each sensor of a reading, and allocates nothing.
#[derive(Debug, Clone)]
pub struct DriftWatch {
    /// Which ten seconds each part is of, since the clock's start.
    indices: [u64; PARTS.0],
    parts: [[Part; GloveSensor::N_SLOTS]; PARTS.0],
}

impl Default for DriftWatch {
    fn default() -> Self {
        Self {
            indices: [0; PARTS.0],
            parts: [[Part::EMPTY; GloveSensor::N_SLOTS]; PARTS.0],
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
            part.n = part.n.saturating_add(1);
            part.least_deg = part.least_deg.min(angle_deg);
            part.greatest_deg = part.greatest_deg.max(angle_deg);
        }
    }

    /// The joint that stays farthest from straight, and how far, degrees, over the minute before a monotonic time, ns.
    /// `None` while every joint that moves straightens, or too little was seen.
    #[must_use]
    pub fn zero_shift(&self, now_ns: u64) -> Option<(GloveSensor, f64)> {
        let oldest = (now_ns / PARTS.1).saturating_sub(PARTS.0 as u64 - 1);
        let minute = |sensor: GloveSensor| {
            let parts = self.indices.iter().zip(&self.parts);
            let recent = parts.filter(|(index, _)| **index >= oldest);
            recent.fold(Part::EMPTY, |sum, (_, part)| sum.and(&part[sensor.slot()]))
        };
        let shifts = GloveSensor::ALL
            .into_iter()
            .filter_map(|sensor| Some((sensor, shift_deg(sensor, &minute(sensor))?)));
        shifts.max_by(|(_, a), (_, b)| a.total_cmp(b))
    }
}

/// How far from straight a joint stays that moves; `None` for one that straightens, hardly moves, or bends both ways.
fn shift_deg(sensor: GloveSensor, part: &Part) -> Option<f64> {
    let (least_deg, greatest_deg) = usual_range_deg(sensor);
    let is_judged = part.n >= READINGS_MIN && least_deg >= 0.0 && greatest_deg >= BENDS_DEG;
    let moves = part.greatest_deg - part.least_deg >= MOVES_SHARE * (greatest_deg - least_deg);
    (is_judged && moves && part.least_deg > 0.0).then_some(part.least_deg)
}

#[cfg(test)]
mod tests {
    use super::DriftWatch;
    use crate::glove::sensor::GloveSensor;
    use crate::reading::{GloveReading, SensorReading};

    const SECOND_NS: u64 = 1_000_000_000;

    /// A minute at 100 Hz in which one joint swings between two angles.
    fn swing(watch: &mut DriftWatch, start_s: u64, low_deg: f64, high_deg: f64) {
        for k in 0..6000_u64 {
            let angle_deg = low_deg + (high_deg - low_deg) * (k as f64 * 0.02).sin().powi(2);
            let mut reading = GloveReading {
                angles_valid: true,
                ..GloveReading::empty(start_s * SECOND_NS + k * SECOND_NS / 100, k)
            };
            reading.sensors[GloveSensor::IndexPip.slot()] = Some(SensorReading {
                raw: angle_deg,
                angle_rad: angle_deg.to_radians(),
                clamped: false,
            });
            watch.add(&reading);
        }
    }

    #[test]
    fn a_joint_that_moves_and_never_straightens_has_drifted() {
        let mut watch = DriftWatch::default();
        assert_eq!(watch.zero_shift(0), None, "nothing was seen");
        swing(&mut watch, 0, -2.0, 95.0);
        assert_eq!(watch.zero_shift(59 * SECOND_NS), None, "it straightens");
        swing(&mut watch, 60, 30.0, 95.0);
        let (sensor, shift_deg) = watch.zero_shift(119 * SECOND_NS).unwrap();
        assert_eq!(sensor, GloveSensor::IndexPip);
        assert!((shift_deg - 30.0).abs() < 1.0, "{shift_deg}");
        assert_eq!(watch.zero_shift(600 * SECOND_NS), None, "long ago");
        swing(&mut watch, 120, 80.0, 95.0);
        assert_eq!(
            watch.zero_shift(179 * SECOND_NS),
            None,
            "a fist is no drift"
        );
    }
}
