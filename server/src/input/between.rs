//! Between samples: held or interpolated.
//!
//! Held is the world's own way: a step without a sample leaves the hand where it is. Interpolated, a hand runs one
//! sample interval behind and moves in every step, so that a slow tracker does not make a thrown object jump.

use tsukamu_motion::track::between;
use tsukamu_world::hand::sample::HandSample;

/// What a hand does between two samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Between {
    /// It stands.
    #[default]
    Hold,
    /// It moves from the last sample but one to the last.
    Interpolate,
}

/// Longest interval that is interpolated, in nanoseconds: after a longer gap the hand jumps.
const INTERVAL_MAX_NS: u64 = 100_000_000;

/// The last two samples of a source.
#[derive(Clone, Debug, Default)]
pub struct Interpolator {
    before: Option<(u64, HandSample)>,
    last: Option<(u64, HandSample)>,
}

impl Interpolator {
    /// A sample arrived at a monotonic time in nanoseconds; `None` says that the hand is lost.
    pub fn push(&mut self, arrival_ns: u64, sample: Option<HandSample>) {
        self.before = self.last.take();
        self.last = sample.map(|sample| (arrival_ns, sample));
        if self.last.is_none() {
            self.before = None;
        }
    }

    /// Time between the last two samples, in nanoseconds; 0 where they are not to be joined.
    pub fn interval_ns(&self) -> u64 {
        let (Some((before, _)), Some((last, _))) = (&self.before, &self.last) else {
            return 0;
        };
        let interval = last.saturating_sub(*before);
        if interval <= INTERVAL_MAX_NS {
            interval
        } else {
            0
        }
    }

    /// The hand at a monotonic time; `None` when the last sample is over and no newer one came.
    pub fn at(&self, now_ns: u64) -> Option<HandSample> {
        let (arrival, last) = self.last.as_ref()?;
        let since = now_ns.saturating_sub(*arrival);
        let interval = self.interval_ns();
        match &self.before {
            Some((_, before)) if since < interval => {
                Some(between(before, last, since as f64 / interval as f64))
            }
            // The next one may be late by as much again.
            _ if since <= 2 * interval => Some(last.clone()),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};
    use tsukamu_world::hand::sample::{FingerPose, JointAngles};

    use super::*;

    fn sample(x: f64) -> HandSample {
        let wrist =
            Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), UnitQuaternion::identity());
        HandSample {
            wrist,
            fingers: FingerPose::Angles(JointAngles::default()),
        }
    }

    #[test]
    fn it_moves_evenly_one_interval_behind_and_stops_at_the_end() {
        let mut hand = Interpolator::default();
        assert!(hand.at(0).is_none());
        hand.push(0, Some(sample(0.0)));
        hand.push(10_000_000, Some(sample(1.0)));
        let x = |hand: &Interpolator, now| hand.at(now).map(|s| s.wrist.translation.x);
        for (now, expected) in [
            (10_000_000, 0.0),
            (15_000_000, 0.5),
            (20_000_000, 1.0),
            (30_000_000, 1.0),
        ] {
            let found = x(&hand, now).expect("a sample");
            assert!((found - expected).abs() < 1e-12, "{now}: {found}");
        }
        assert_eq!(x(&hand, 30_000_001), None);
        hand.push(1_000_000_000, Some(sample(5.0)));
        assert_eq!(x(&hand, 1_000_000_000), Some(5.0), "a gap is jumped");
        hand.push(1_010_000_000, None);
        assert_eq!(x(&hand, 1_010_000_000), None, "a lost hand is lost");
    }
}
