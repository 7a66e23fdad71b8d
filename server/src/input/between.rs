//! Between samples: held or interpolated.
//!
//! Held is the world's own way: a step without a sample leaves the hand where it is. Interpolated, a hand runs a little
//! more than one sample interval behind and moves in every step, so that a slow tracker does not make a thrown object
//! jump.
//!
//! A glove and a tracker speak at rates and times of their own, so each half of the hand is interpolated by itself:
//!
//! ```text
//!   tracker  w0 ─────── w1 ─────── w2      a sample at every mark, but only one half of it is news:
//!   glove      f0 ───────── f1 ────────    joined as whole samples, the wrist would stand and jump by turns
//! ```

use tsukamu_motion::track::between;
use tsukamu_world::hand::sample::{FingerPose, HandSample};

use super::sources::News;

/// What a hand does between two samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Between {
    /// It stands.
    #[default]
    Hold,
    /// It moves from where it is to the last sample.
    Interpolate,
}

/// Longest interval that is interpolated, in nanoseconds: after a longer gap the hand jumps.
const INTERVAL_MAX_NS: u64 = 100_000_000;
/// The way to a sample takes so many intervals: one that is late by less does not make the hand stand.
const STRETCH: f64 = 1.25;
/// How much of a new interval enters the estimate of the interval.
const INTERVAL_GAIN: f64 = 0.125;

/// The hand of one source whose halves arrive together or by turns.
#[derive(Clone, Debug, Default)]
pub struct Joined {
    wrist: Interpolator,
    fingers: Interpolator,
}

impl Joined {
    /// A sample arrived at a monotonic time in nanoseconds; `None` says that the hand is lost.
    pub fn push(&mut self, arrival_ns: u64, sample: Option<&HandSample>, news: News) {
        let Some(sample) = sample else {
            *self = Self::default();
            return;
        };
        if news != News::Fingers || self.wrist.last.is_none() {
            self.wrist.push(arrival_ns, sample.clone());
        }
        if news != News::Wrist || self.fingers.last.is_none() {
            self.fingers.push(arrival_ns, sample.clone());
        }
    }

    /// How far the hand is behind its samples, in nanoseconds: the slower half.
    pub fn lag_ns(&self) -> u64 {
        self.wrist.way_ns().max(self.fingers.way_ns())
    }

    /// The hand at a monotonic time; `None` when the last samples are over and no newer one came.
    pub fn at(&self, now_ns: u64) -> Option<HandSample> {
        if self.wrist.is_over(now_ns) && self.fingers.is_over(now_ns) {
            return None;
        }
        let (wrist, fingers) = (self.wrist.at(now_ns)?, self.fingers.at(now_ns)?);
        let fingers = match fingers.fingers {
            FingerPose::Angles(angles) => FingerPose::Angles(angles),
            FingerPose::Points(points) => {
                let carried = wrist.wrist * fingers.wrist.inverse();
                FingerPose::Points(points.map(|point| point.map(|point| carried * point)))
            }
        };
        Some(HandSample {
            wrist: wrist.wrist,
            fingers,
        })
    }
}

/// One half, on its way to its last sample.
#[derive(Clone, Debug, Default)]
struct Interpolator {
    /// Where it was when the last sample came; `None` where the two are not to be joined.
    from: Option<HandSample>,
    last: Option<(u64, HandSample)>,
    /// Estimate of the time between two samples, in nanoseconds; 0 is unknown.
    interval_ns: f64,
}

impl Interpolator {
    fn push(&mut self, arrival_ns: u64, sample: HandSample) {
        let since = self
            .last
            .as_ref()
            .map(|(last, _)| arrival_ns.saturating_sub(*last));
        match since {
            Some(since) if since <= INTERVAL_MAX_NS => {
                let change = since as f64 - self.interval_ns;
                let gain = if self.interval_ns > 0.0 {
                    INTERVAL_GAIN
                } else {
                    1.0
                };
                // From where it is: an early sample does not make it jump.
                self.from = self.at(arrival_ns);
                self.interval_ns += gain * change;
            }
            _ => {
                self.from = None;
                self.interval_ns = 0.0;
            }
        }
        self.last = Some((arrival_ns, sample));
    }

    /// Time that the way to a sample takes, in nanoseconds.
    fn way_ns(&self) -> u64 {
        (STRETCH * self.interval_ns) as u64
    }

    /// Whether the next sample is late by as much again; where nobody knows when it should come, by the longest interval.
    fn is_over(&self, now_ns: u64) -> bool {
        let last = self.last.as_ref().map_or(0, |(arrival, _)| *arrival);
        let patience_ns = match self.way_ns() {
            0 => INTERVAL_MAX_NS,
            way_ns => 2 * way_ns,
        };
        now_ns.saturating_sub(last) > patience_ns
    }

    fn at(&self, now_ns: u64) -> Option<HandSample> {
        let (arrival, last) = self.last.as_ref()?;
        let (since, way) = (now_ns.saturating_sub(*arrival), self.way_ns());
        match &self.from {
            Some(from) if since < way => Some(between(from, last, since as f64 / way as f64)),
            _ => Some(last.clone()),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};
    use tsukamu_world::hand::sample::JointAngles;

    use super::*;

    const MS: u64 = 1_000_000;

    fn sample(x: f64, palm_arch: f64) -> HandSample {
        let wrist =
            Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), UnitQuaternion::identity());
        HandSample {
            wrist,
            fingers: FingerPose::Angles(JointAngles {
                palm_arch,
                ..JointAngles::default()
            }),
        }
    }

    fn x(hand: &Joined, now: u64) -> Option<f64> {
        hand.at(now).map(|sample| sample.wrist.translation.x)
    }

    #[test]
    fn it_moves_to_its_last_sample_and_stops_there() {
        let mut hand = Joined::default();
        assert!(hand.at(0).is_none());
        hand.push(0, Some(&sample(0.0, 0.0)), News::Whole);
        hand.push(8 * MS, Some(&sample(1.0, 0.0)), News::Whole);
        for (now, expected) in [(8, 0.0), (13, 0.5), (18, 1.0), (28, 1.0)] {
            let found = x(&hand, now * MS).expect("a sample");
            assert!((found - expected).abs() < 1e-12, "{now}: {found}");
        }
        assert_eq!(x(&hand, 28 * MS + 1), None);
        hand.push(1000 * MS, Some(&sample(5.0, 0.0)), News::Whole);
        assert_eq!(x(&hand, 1000 * MS), Some(5.0), "a gap is jumped");
        hand.push(1010 * MS, None, News::Whole);
        assert_eq!(x(&hand, 1010 * MS), None, "a lost hand is lost");
    }

    /// A source that speaks seldom, and one that speaks again after a silence: every sample is seen, at whatever time
    /// the step comes after it.
    #[test]
    fn samples_far_apart_are_each_seen() {
        let mut hand = Joined::default();
        for k in 0..5_u64 {
            let arrival_ns = k * 200 * MS;
            hand.push(arrival_ns, Some(&sample(k as f64, 0.0)), News::Whole);
            assert_eq!(x(&hand, arrival_ns + 3 * MS), Some(k as f64), "jumped to");
            assert_eq!(x(&hand, arrival_ns + 101 * MS), None, "and then it is late");
        }
    }

    /// A hand that moves at 1 m/s and bends at 1 rad/s, its tracker at 120 Hz, its glove at 100 Hz, each up to 1 ms
    /// early or late: seen at 240 Hz, no step is much shorter or longer than the others.
    #[test]
    fn an_even_motion_is_even_in_every_step() {
        let jitter = |k: u64| (k * 7919) % (2 * MS);
        let wrist = (0..120).map(|k| (k * 8_333_333 + jitter(k), News::Wrist, k as f64 / 120.0));
        let fingers =
            (0..100).map(|k| (k * 10 * MS + jitter(3 * k), News::Fingers, k as f64 / 100.0));
        let mut all: Vec<_> = wrist.chain(fingers).collect();
        all.sort_by_key(|(arrival_ns, ..)| *arrival_ns);
        let (mut hand, mut next, mut now) = (Joined::default(), 0, (0.0, 0.0));
        let mut seen = Vec::new();
        for tick in 0..230_u64 {
            let at_ns = tick * 4_166_667;
            while let Some((arrival_ns, news, value)) = all.get(next).filter(|item| item.0 <= at_ns)
            {
                now = if *news == News::Wrist {
                    (*value, now.1)
                } else {
                    (now.0, *value)
                };
                hand.push(*arrival_ns, Some(&sample(now.0, now.1)), *news);
                next += 1;
            }
            seen.extend(hand.at(at_ns));
        }
        let arch = |sample: &HandSample| match &sample.fingers {
            FingerPose::Angles(angles) => angles.palm_arch,
            FingerPose::Points(_) => f64::NAN,
        };
        for pair in seen[60..].windows(2) {
            let speed = (pair[1].wrist.translation.x - pair[0].wrist.translation.x) * 240.0;
            let bend = (arch(&pair[1]) - arch(&pair[0])) * 240.0;
            assert!(
                (speed - 1.0).abs() < 0.3 && (bend - 1.0).abs() < 0.3,
                "{speed} m/s, {bend} rad/s"
            );
        }
    }
}
