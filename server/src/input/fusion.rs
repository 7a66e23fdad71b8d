//! A glove's and a tracker's streams, joined by time into one hand.
//!
//! The two speak at rates and times of their own, and each is late by its own delay. Interpolated, the hand shows both at
//! one time `t`, which runs behind the clock by as little as both streams allow:
//!
//! ```text
//!   tracker  w0 ─────── w1 ───t─── w2           lag = the longer of both: how old a newest sample gets before the next
//!   glove      f0 ─────────── t ── f1           one is there, less what may be predicted
//! ```
//!
//! A stream is predicted no further than this needs: the other one may be slower still. The lag changes slowly and `t` never
//! runs back. Held, the hand takes the newest of both as they come, each predicted as far as its settings say: no lag, and
//! no common time.
//!
//! A stream that pauses stands; with both of them late the hand gives no sample, so that the world holds it where it is; and
//! likewise when one of them has been silent for `SILENCE_MAX_NS`.

use nalgebra::Isometry3;
use tsukamu_world::hand::sample::{FingerPose, HandSample, JointAngles, N_ANGLES};

use super::moving::Moving;
use super::predict::{FINGERS, WRIST};
use super::sources::Seen;
use super::stream::{Stream, StreamSettings, Times};

/// How old the newest sample of one stream may be, in nanoseconds: beyond it there is no hand.
pub const SILENCE_MAX_NS: u64 = 250_000_000;
/// How much faster or slower than the clock the hand's time may run while its lag changes.
const LAG_SLEW: f64 = 0.05;

/// What a hand does between two samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Between {
    /// It stands.
    Hold,
    /// It moves, a little later.
    #[default]
    Interpolate,
}

/// How two streams become a hand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FusionSettings {
    /// Between samples.
    pub between: Between,
    /// The tracker's stream.
    pub wrist: StreamSettings,
    /// The glove's stream.
    pub fingers: StreamSettings,
}

/// The two streams of one hand.
#[derive(Clone, Debug)]
pub struct Fusion {
    between: Between,
    wrist: Stream<Isometry3<f64>, 6>,
    fingers: Stream<JointAngles, N_ANGLES>,
    /// How far the hand's time is behind the clock, and when that was told, in nanoseconds.
    lag: Option<(f64, u64)>,
    /// The hand's time in the last step that showed it.
    shown_ns: Option<i64>,
    /// Whether a sample came since the last step.
    has_news: bool,
}

/// How one stream of a hand stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamReport {
    /// Known latency of the device, as the settings say, seconds.
    pub delay_s: f64,
    /// How far what the hand shows is behind what the device reported, in seconds, the device's own delay not counted:
    /// filter and joining, less the prediction. Negative is ahead.
    pub lag_s: f64,
    /// The filter's part of it, in seconds.
    pub filter_lag_s: f64,
    /// How far it is predicted, in seconds.
    pub lead_s: f64,
    /// Arrival of its newest sample, monotonic nanoseconds; `None` where there is none.
    pub arrival_ns: Option<u64>,
    /// Measured error of the prediction; `None` while nothing is predicted.
    pub error: Option<StreamErrors>,
}

/// Root mean square errors over the last five seconds: what was known of a time before, against the sample that came for it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamErrors {
    /// Of the prediction.
    pub predicted: StreamError,
    /// Of the sample that the prediction began with: how far the hand had moved meanwhile.
    pub unpredicted: StreamError,
}

/// How far off a stream is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamError {
    /// The wrist's place, in metres; `None` of fingers.
    pub position_m: Option<f64>,
    /// The wrist's rotation, or the joint angles on average, in radians.
    pub angle_rad: f64,
}

impl Fusion {
    /// Streams that have said nothing.
    pub fn new(settings: FusionSettings) -> Self {
        Self {
            between: settings.between,
            wrist: Stream::new(settings.wrist, WRIST),
            fingers: Stream::new(settings.fingers, FINGERS),
            lag: None,
            shown_ns: None,
            has_news: false,
        }
    }

    /// What it does between samples.
    pub const fn between(&self) -> Between {
        self.between
    }

    /// Takes what a device has seen. A whole hand is none of its business: devices speak of one half at a time.
    pub fn push(&mut self, times: Times, seen: &Seen) {
        match seen {
            Seen::Wrist(Some(wrist)) => {
                let lead_ns = self.lead_ns(&self.wrist);
                self.wrist.push(times, wrist, lead_ns);
            }
            Seen::Fingers(Some(angles)) => {
                let lead_ns = self.lead_ns(&self.fingers);
                self.fingers.push(times, angles, lead_ns);
            }
            Seen::Wrist(None) => self.wrist.lose(),
            Seen::Fingers(None) => self.fingers.lose(),
            Seen::Whole(_) => return,
        }
        self.has_news = true;
    }

    /// How far a stream's next sample is to be predicted.
    fn lead_ns<T: Moving<N>, const N: usize>(&self, stream: &Stream<T, N>) -> i64 {
        match (self.between, self.lag, stream.wait_ns()) {
            (Between::Interpolate, Some((lag_ns, _)), Some(wait_ns)) => wait_ns - lag_ns as i64,
            _ => i64::MAX,
        }
    }

    /// The hand at a monotonic time; `None` when there is no hand, or nothing new of it.
    pub fn at(&mut self, now_ns: u64) -> Option<HandSample> {
        let has_news = std::mem::take(&mut self.has_news);
        let is_silent = |age: Option<u64>| age.is_none_or(|age_ns| age_ns > SILENCE_MAX_NS);
        if is_silent(self.wrist.age_ns(now_ns)) || is_silent(self.fingers.age_ns(now_ns)) {
            return None;
        }
        let (wrist, angles) = match self.between {
            Between::Hold if has_news => (*self.wrist.newest()?, *self.fingers.newest()?),
            Between::Hold => return None,
            Between::Interpolate => {
                if self.wrist.is_late(now_ns) && self.fingers.is_late(now_ns) {
                    return None;
                }
                let at_ns = self.advance(now_ns);
                (self.wrist.at(at_ns)?, self.fingers.at(at_ns)?)
            }
        };
        Some(HandSample {
            wrist,
            fingers: FingerPose::Angles(angles),
        })
    }

    /// The hand's time at a monotonic time.
    fn advance(&mut self, now_ns: u64) -> i64 {
        let wanted_ns = self.wanted_lag_ns();
        let is_settling = self.wrist.is_settling() || self.fingers.is_settling();
        let lag_ns = match self.lag {
            Some((lag_ns, told_ns)) if !is_settling => {
                let most = LAG_SLEW * now_ns.saturating_sub(told_ns) as f64;
                lag_ns + (wanted_ns - lag_ns).clamp(-most, most)
            }
            _ => wanted_ns,
        };
        self.lag = Some((lag_ns, now_ns));
        let at_ns = now_ns as i64 - lag_ns as i64;
        let at_ns = self.shown_ns.map_or(at_ns, |shown_ns| at_ns.max(shown_ns));
        self.shown_ns = Some(at_ns);
        at_ns
    }

    /// The least lag at which both streams move evenly.
    fn wanted_lag_ns(&self) -> f64 {
        let of = |wait_ns: Option<i64>, predict_ns: i64| Some(wait_ns? - predict_ns);
        let wrist = of(self.wrist.wait_ns(), self.wrist.predict_ns());
        let fingers = of(self.fingers.wait_ns(), self.fingers.predict_ns());
        wrist.max(fingers).unwrap_or(0) as f64
    }

    /// Arrival of the sample that the hand stands by, monotonic nanoseconds: that of the half that was heard of longer ago.
    pub fn arrival_ns(&self) -> Option<u64> {
        Some(self.wrist.arrival_ns()?.min(self.fingers.arrival_ns()?))
    }

    /// How both streams stand: the wrist's and the fingers'.
    pub fn reports(&self, now_ns: u64) -> [StreamReport; 2] {
        [
            self.report(&self.wrist, now_ns),
            self.report(&self.fingers, now_ns),
        ]
    }

    fn report<T: Moving<N>, const N: usize>(
        &self,
        stream: &Stream<T, N>,
        now_ns: u64,
    ) -> StreamReport {
        let seconds = |ns: f64| ns * 1.0e-9;
        let (lead_ns, filter_lag_s) = (stream.lead_ns() as f64, stream.filter_lag_s());
        let joined_ns = match (self.between, self.lag) {
            (Between::Interpolate, Some((lag_ns, _))) => lag_ns - stream.delay_ns() as f64,
            _ => -lead_ns,
        };
        let error = stream.errors(now_ns).map(|errors| StreamErrors {
            predicted: stream_error::<T, N>(errors.predicted),
            unpredicted: stream_error::<T, N>(errors.unpredicted),
        });
        StreamReport {
            delay_s: seconds(stream.delay_ns() as f64),
            lag_s: seconds(joined_ns) + filter_lag_s,
            filter_lag_s,
            lead_s: seconds(lead_ns),
            arrival_ns: stream.arrival_ns(),
            error: error.filter(|_| lead_ns > 0.0),
        }
    }

    /// Forgets every sample, not how the streams come.
    pub fn forget(&mut self) {
        self.wrist.lose();
        self.fingers.lose();
        self.shown_ns = None;
        self.has_news = false;
    }
}

/// A pose has metres and radians; of joint angles the mean is over the joints too.
fn stream_error<T: Moving<N>, const N: usize>([first, second]: [f64; 2]) -> StreamError {
    if T::N_FIRST < N {
        StreamError {
            position_m: Some(first),
            angle_rad: second,
        }
    } else {
        StreamError {
            position_m: None,
            angle_rad: first / (N as f64).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests;
