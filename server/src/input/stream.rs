//! One of the two streams that make a hand: a glove's joint angles or a tracker's poses, with the times they are of.
//!
//! A sample is filtered, then moved ahead in time by the prediction, and becomes a mark. The stream passes from mark to mark:
//!
//! ```text
//!   taken      s0 ─────── s1 ─────── s2                  times of the device, its known delay taken off
//!   marks         m0 ─────── m1 ─────── m2 ╌╌╌╌ s2       each later by the lead; behind the last one the lead fades out
//!                               t                        what is shown at a time lies between two marks
//! ```

use std::collections::VecDeque;

use super::moving::Moving;
use super::one_euro::{Filter, OneEuro};
use super::predict::{Habit, LEAD_MAX_S, Trend};
use super::score::{Errors, Score};

/// Longest time between two samples that is passed evenly, in nanoseconds: after a longer one the stream jumps.
pub const GAP_MAX_NS: i64 = 100_000_000;
/// Longest known latency of a device, in seconds.
pub const DELAY_MAX_S: f64 = 0.2;
/// Marks that are kept, at most: beyond the longest wait for the other stream at 1000 samples per second.
const N_MARKS: usize = 512;
/// Time in which a lead fades out when no further sample comes, in nanoseconds.
const FADE_NS: f64 = 100.0e6;
/// Nanoseconds per second.
const SECOND_NS: f64 = 1.0e9;

/// How a stream is treated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamSettings {
    /// Known latency of the device, seconds: its samples are so much older than their stamps.
    pub delay_s: f64,
    /// Its filter; `None` is off.
    pub filter: Option<OneEuro>,
    /// How far it may be predicted, seconds, at most [`LEAD_MAX_S`]; 0 is off.
    pub predict_s: f64,
}

/// When a sample came and when it was taken, both monotonic nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    /// When it arrived.
    pub arrival_ns: u64,
    /// When the device sent it, as far as that can be told; not later than the arrival.
    pub fitted_ns: u64,
}

/// One stream.
#[derive(Clone, Debug)]
pub struct Stream<T, const N: usize> {
    delay_ns: i64,
    predict_ns: i64,
    filter: Option<Filter<T, N>>,
    trend: Trend<T, N>,
    /// What it passes, oldest first, times rising.
    marks: VecDeque<Mark<T>>,
    newest: Option<Newest<T>>,
    /// What it showed last.
    shown: Option<Mark<T>>,
    wait: Wait,
    score: Score<T>,
}

#[derive(Clone, Debug)]
struct Mark<T> {
    at_ns: i64,
    value: T,
}

/// The newest sample, filtered.
#[derive(Clone, Debug)]
struct Newest<T> {
    times: Times,
    taken_ns: i64,
    lead_ns: i64,
    value: T,
}

impl<T: Moving<N>, const N: usize> Stream<T, N> {
    /// A stream that has said nothing, of something that moves like that.
    pub fn new(settings: StreamSettings, habit: Habit) -> Self {
        Self {
            delay_ns: (settings.delay_s.clamp(0.0, DELAY_MAX_S) * SECOND_NS) as i64,
            predict_ns: (settings.predict_s.clamp(0.0, LEAD_MAX_S) * SECOND_NS) as i64,
            filter: settings.filter.map(Filter::new),
            trend: Trend::new(habit),
            marks: VecDeque::with_capacity(N_MARKS),
            newest: None,
            shown: None,
            wait: Wait::default(),
            score: Score::default(),
        }
    }

    /// Takes a sample, and predicts it so far ahead, as far as the settings allow. Of stamps that fall back the order of
    /// arrival is believed.
    pub fn push(&mut self, times: Times, value: &T, lead_ns: i64) {
        let fitted_ns = times.fitted_ns.min(times.arrival_ns);
        let mut taken_ns = fitted_ns as i64 - self.delay_ns;
        let since = self
            .newest
            .as_ref()
            .map(|newest| taken_ns - newest.taken_ns);
        if since.is_none_or(|since| since.abs() > GAP_MAX_NS) {
            self.cut();
        } else if let Some(newest) = &self.newest {
            self.wait.note(times.arrival_ns as i64 - newest.taken_ns);
            taken_ns = taken_ns.max(newest.taken_ns + 1);
        }
        self.score.arrive(taken_ns, value);
        let value = match &mut self.filter {
            Some(filter) => filter.filtered(value, fitted_ns),
            None => value.clone(),
        };
        self.trend.push(taken_ns, &value);
        let mut lead_ns = lead_ns.clamp(0, self.predict_ns);
        if let Some(last) = self.stand_where_shown() {
            // Marks rise also while the lead shrinks.
            lead_ns = lead_ns.max((last + 1 - taken_ns).min(self.predict_ns));
        }
        let predicted = self.trend.ahead(&value, lead_ns as f64 / SECOND_NS);
        let at_ns = taken_ns + lead_ns;
        if lead_ns > 0 {
            self.score.expect(at_ns, predicted.clone(), value.clone());
        }
        if self.marks.len() == N_MARKS {
            self.marks.pop_front();
        }
        self.marks.push_back(Mark {
            at_ns,
            value: predicted,
        });
        self.newest = Some(Newest {
            times,
            taken_ns,
            lead_ns,
            value,
        });
    }

    /// A stream that waited for its next sample goes on from where it stands. Returns the time of the last mark.
    fn stand_where_shown(&mut self) -> Option<i64> {
        let last = self.marks.back_mut()?;
        if let Some(shown) = self.shown.as_ref().filter(|shown| shown.at_ns > last.at_ns) {
            last.clone_from(shown);
        }
        Some(last.at_ns)
    }

    /// What came before has nothing to do with what comes next.
    fn cut(&mut self) {
        self.marks.clear();
        self.shown = None;
        self.trend.forget();
        self.score.cut();
    }

    /// The device says that it sees nothing: until the next sample there is nothing to show.
    pub fn lose(&mut self) {
        self.cut();
        self.newest = None;
    }

    /// The stream at a time of its own samples; before the first mark it is there already, behind the last it stands.
    pub fn at(&mut self, at_ns: i64) -> Option<T> {
        while self
            .marks
            .get(1)
            .is_some_and(|second| second.at_ns <= at_ns)
        {
            self.marks.pop_front();
        }
        let first = self.marks.front()?;
        let since = (at_ns - first.at_ns) as f64;
        let value = match (self.marks.get(1), &self.newest) {
            _ if since <= 0.0 => first.value.clone(),
            (Some(second), _) => {
                let way = (second.at_ns - first.at_ns) as f64;
                first.value.toward(&second.value, since / way)
            }
            (None, Some(newest)) if newest.lead_ns > 0 => first
                .value
                .toward(&newest.value, (since / FADE_NS).min(1.0)),
            _ => first.value.clone(),
        };
        self.shown = Some(Mark {
            at_ns,
            value: value.clone(),
        });
        Some(value)
    }

    /// The newest mark, whatever its time.
    pub fn newest(&self) -> Option<&T> {
        self.marks.back().map(|mark| &mark.value)
    }

    /// Arrival of the newest sample, monotonic nanoseconds.
    pub fn arrival_ns(&self) -> Option<u64> {
        self.newest.as_ref().map(|newest| newest.times.arrival_ns)
    }

    /// Age of the newest sample by its stamp, in nanoseconds, the device's own delay not counted.
    pub fn age_ns(&self, now_ns: u64) -> Option<u64> {
        let newest = self.newest.as_ref()?;
        Some(now_ns.saturating_sub(newest.times.fitted_ns))
    }

    /// Whether the next sample is late by as much again as it may be; where nobody knows when it should come, by the
    /// longest gap.
    pub fn is_late(&self, now_ns: u64) -> bool {
        let patience_ns = self
            .wait
            .longest_ns()
            .map_or(GAP_MAX_NS, |wait| 2 * (wait - self.delay_ns));
        self.age_ns(now_ns)
            .is_none_or(|age_ns| age_ns as i64 > patience_ns)
    }

    /// How old the newest sample gets before the next one is there, in nanoseconds: what must be waited for to move
    /// evenly. `None` while nobody knows.
    pub const fn wait_ns(&self) -> Option<i64> {
        self.wait.longest_ns()
    }

    /// How far it may be predicted, in nanoseconds.
    pub const fn predict_ns(&self) -> i64 {
        self.predict_ns
    }

    /// Whether so little came as yet that the wait may change much.
    pub const fn is_settling(&self) -> bool {
        self.wait.n < N_SETTLING
    }

    /// Known latency of the device, in nanoseconds.
    pub const fn delay_ns(&self) -> i64 {
        self.delay_ns
    }

    /// How far the newest sample was predicted, in nanoseconds.
    pub fn lead_ns(&self) -> i64 {
        self.newest.as_ref().map_or(0, |newest| newest.lead_ns)
    }

    /// Lag of its filter at present, in seconds.
    pub fn filter_lag_s(&self) -> f64 {
        self.filter.as_ref().map_or(0.0, Filter::lag_s)
    }

    /// Measured errors of the prediction, at a monotonic time.
    pub fn errors(&self, now_ns: u64) -> Option<Errors> {
        self.score.errors(now_ns as i64)
    }
}

/// Samples until the wait counts as known.
const N_SETTLING: u32 = 4;
/// How much of a new wait enters the estimate.
const WAIT_GAIN: f64 = 0.125;
/// Mean deviations beyond the mean that are waited for.
const N_DEVIATIONS: f64 = 3.0;
/// Least deviation that is reckoned with, in nanoseconds.
const DEVIATION_MIN_NS: f64 = 0.5e6;

/// How old a stream's newest sample gets before the next one is there: mean and mean deviation.
#[derive(Clone, Copy, Debug, Default)]
struct Wait {
    n: u32,
    mean_ns: f64,
    deviation_ns: f64,
}

impl Wait {
    fn note(&mut self, waited_ns: i64) {
        self.n = self.n.saturating_add(1);
        let gain = WAIT_GAIN.max(1.0 / f64::from(self.n));
        let off = waited_ns as f64 - self.mean_ns;
        self.mean_ns += gain * off;
        if self.n > 1 {
            self.deviation_ns += gain * (off.abs() - self.deviation_ns);
        }
    }

    const fn longest_ns(&self) -> Option<i64> {
        if self.n == 0 {
            return None;
        }
        let deviation = self.deviation_ns.max(DEVIATION_MIN_NS);
        Some((self.mean_ns + N_DEVIATIONS * deviation) as i64)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::super::predict::WRIST;
    use super::*;

    const MS: u64 = 1_000_000;

    fn stream(predict_s: f64) -> Stream<Point3<f64>, 3> {
        let settings = StreamSettings {
            predict_s,
            ..StreamSettings::default()
        };
        Stream::new(settings, WRIST)
    }

    fn push(stream: &mut Stream<Point3<f64>, 3>, arrival_ms: u64, x: f64) {
        let times = Times {
            arrival_ns: arrival_ms * MS,
            fitted_ns: arrival_ms * MS,
        };
        stream.push(times, &Point3::new(x, 0.0, 0.0), i64::MAX);
    }

    fn at(stream: &mut Stream<Point3<f64>, 3>, ms: u64) -> f64 {
        stream.at((ms * MS) as i64).expect("it has begun").x
    }

    #[test]
    fn memory_is_bounded_and_never_grows() {
        let mut stream = stream(0.1);
        let capacities = |stream: &Stream<_, 3>| stream.marks.capacity();
        let before = capacities(&stream);
        for k in 0..5_000 {
            push(&mut stream, k, 0.0);
        }
        assert_eq!((stream.marks.len(), capacities(&stream)), (N_MARKS, before));
    }

    #[test]
    fn a_late_sample_makes_it_stand_and_then_go_on_from_there() {
        let mut stream = stream(0.0);
        push(&mut stream, 0, 0.0);
        push(&mut stream, 10, 1.0);
        assert_eq!((at(&mut stream, 5), at(&mut stream, 10)), (0.5, 1.0));
        assert_eq!(at(&mut stream, 16), 1.0, "the next is late");
        push(&mut stream, 20, 2.0);
        let seen = [16, 18, 20].map(|ms| at(&mut stream, ms));
        assert_eq!(seen, [1.0, 1.5, 2.0], "no jump");
        push(&mut stream, 200, 9.0);
        assert_eq!(at(&mut stream, 190), 9.0, "a gap is jumped");
    }

    #[test]
    fn stamps_that_fall_back_keep_the_order_of_arrival() {
        let mut stream = stream(0.0);
        for (arrival_ms, fitted_ms, x) in [(10, 10, 1.0), (20, 5, 2.0), (30, 30, 3.0)] {
            let times = Times {
                arrival_ns: arrival_ms * MS,
                fitted_ns: fitted_ms * MS,
            };
            stream.push(times, &Point3::new(x, 0.0, 0.0), 0);
        }
        let seen = [10, 11, 30].map(|ms| at(&mut stream, ms));
        assert!(
            seen[0] == 1.0 && seen[1] > 2.0 && seen[2] == 3.0,
            "{seen:?}"
        );
    }

    #[test]
    fn how_long_the_next_sample_takes_is_learnt() {
        let mut stream = stream(0.0);
        assert_eq!(stream.wait_ns(), None);
        for k in 0..50 {
            push(&mut stream, 10 * k + k % 2, 0.0);
        }
        let wait_ms = stream.wait_ns().expect("known") as f64 / MS as f64;
        assert!(
            (12.5..13.5).contains(&wait_ms),
            "10 ms, and thrice 1: {wait_ms}"
        );
        assert!(!stream.is_late(500 * MS) && stream.is_late(520 * MS));
    }
}
