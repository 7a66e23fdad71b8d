//! A pose that is held: when the hand is still, and what the sensors read meanwhile.
//!
//! Stillness has no unit of its own, for gloves send counts of 8 or 12 bits or degrees: a sensor is still while its mean
//! over three thirds of a window stays within a few per cent of its reach, or within what its own noise
//! explains. A few restless sensors do not keep the others waiting.

use std::collections::VecDeque;

use crate::calibration::likeness::contradicts;
use crate::calibration::pose::CalibrationPose;
use crate::calibration::scale::Scales;
use crate::glove::sensor::GloveSensor;
use crate::reading::GloveReading;

/// How long a pose has to be held, ns.
pub const HOLD_NS: u64 = 1_500_000_000;
/// The same for a pose that, by the calibration in force, is another one, ns.
pub const DOUBTED_HOLD_NS: u64 = 4_500_000_000;
/// The window in which stillness is judged at every moment, ns.
const GLANCE_NS: u64 = 500_000_000;
/// Time between two judgements, ns.
const JUDGE_EVERY_NS: u64 = 50_000_000;
/// Readings closer together than this are left out, ns: it bounds the window to some thousand.
const SPACING_NS: u64 = 1_000_000;
/// Fewest readings in a glance, and in a hold, that say anything.
const READINGS_MIN: (usize, usize) = (3, 8);
/// Change of a third's mean that still counts as still, as a share of the reach.
const STILL_SHARE: f64 = 0.04;
/// The same, in standard errors of such a mean.
const STILL_ERRORS: f64 = 5.0;
/// Share of the changes from reading to reading, the largest, that are no noise.
const JUMP_SHARE: f64 = 0.05;
/// Share of the sensors that may be restless.
const RESTLESS_SHARE: f64 = 0.15;
/// How far a sensor has to be from the pose before for the hand to have moved, as a share of the reach.
const MOVED_SHARE: f64 = 0.15;
/// A hand that is still for so long is taken to be spread although nothing moved: a glove of one flexure per finger
/// cannot see it, ns. Every glove sees a fist, and that it opens again.
const UNMOVED_PATIENCE_NS: u64 = 5_000_000_000;

/// One sensor while a pose was held, raw units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// Median.
    pub median: f64,
    /// Standard deviation of the noise, from reading to reading.
    pub noise: f64,
    /// Share of the readings that are exactly the median: nearly all where a sensor ran into the end of its range.
    pub share_at_median: f64,
}

/// A pose that was held.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseCapture {
    /// Which.
    pub pose: CalibrationPose,
    /// By wire slot; `None` where the glove has no such sensor.
    pub sensors: [Option<Held>; GloveSensor::N_SLOTS],
    /// Readings that went into it.
    pub n_readings: usize,
    /// Whether no sensor had moved since the pose before.
    pub unmoved: bool,
}

impl PoseCapture {
    /// One sensor; `None` where the glove lacks it.
    #[must_use]
    pub fn sensor(&self, sensor: GloveSensor) -> Option<Held> {
        self.sensors[sensor.slot()]
    }
}

/// How far a hold is.
#[derive(Debug, Clone, PartialEq)]
pub enum HoldProgress {
    /// The glove sends nothing that can be used: it is not plugged in, or has no sensor.
    Blind,
    /// The hand is as in the pose before.
    Unmoved,
    /// These sensors move.
    Moving(Vec<GloveSensor>),
    /// The hand is still; the share of the time that is over, 0 to 1.
    Holding(f64),
    /// The same, of the longer time that a pose has to be held which, by the calibration in force, is another one: a
    /// wearer who is ahead or behind has time to see it, and a calibration that is far off keeps nobody from a new one.
    Doubtful(f64),
    /// It was held to the end.
    Done(Box<PoseCapture>),
}

#[derive(Debug, Clone, Copy)]
struct Frame {
    stamp_ns: u64,
    raw: [Option<f64>; GloveSensor::N_SLOTS],
}

/// Waits until a pose is held. Readings go in, progress comes out.
#[derive(Debug, Clone)]
pub struct PoseHold {
    pose: CalibrationPose,
    before: Option<PoseCapture>,
    frames: VecDeque<Frame>,
    still_since_ns: Option<u64>,
    /// When the hand looked like another pose the last time.
    doubted_ns: u64,
    judged_ns: Option<u64>,
    progress: HoldProgress,
}

impl PoseHold {
    /// Waits for a pose that comes after another one.
    #[must_use]
    pub fn new(pose: CalibrationPose, before: Option<PoseCapture>) -> Self {
        Self {
            pose,
            before,
            frames: VecDeque::new(),
            still_since_ns: None,
            doubted_ns: 0,
            judged_ns: None,
            progress: HoldProgress::Moving(Vec::new()),
        }
    }

    /// Takes a reading that `scales` has seen already.
    pub fn push(&mut self, reading: &GloveReading, scales: &Scales) -> &HoldProgress {
        if matches!(self.progress, HoldProgress::Done(_)) {
            return &self.progress;
        }
        let raw = reading
            .sensors
            .map(|sensor| sensor.map(|s| s.raw).filter(|raw| raw.is_finite()));
        if !reading.angles_valid || raw.iter().all(Option::is_none) {
            self.frames.clear();
            self.still_since_ns = None;
            self.progress = HoldProgress::Blind;
            return &self.progress;
        }
        let now_ns = reading.stamp_ns;
        let is_close = |frame: &Frame| now_ns < frame.stamp_ns.saturating_add(SPACING_NS);
        if self.frames.back().is_some_and(is_close) {
            return &self.progress;
        }
        self.frames.push_back(Frame {
            stamp_ns: now_ns,
            raw,
        });
        let oldest = now_ns.saturating_sub(HOLD_NS + GLANCE_NS);
        while self
            .frames
            .front()
            .is_some_and(|frame| frame.stamp_ns < oldest)
        {
            self.frames.pop_front();
        }
        if self
            .judged_ns
            .is_none_or(|judged| now_ns >= judged.saturating_add(JUDGE_EVERY_NS))
        {
            self.judged_ns = Some(now_ns);
            self.progress = self.judge(now_ns, scales, contradicts(reading, self.pose));
        }
        &self.progress
    }

    fn judge(&mut self, now_ns: u64, scales: &Scales, is_doubted: bool) -> HoldProgress {
        let start_ns = now_ns.saturating_sub(GLANCE_NS);
        let is_full = self
            .frames
            .front()
            .is_some_and(|frame| frame.stamp_ns <= start_ns);
        let glance = self.since(start_ns);
        if !is_full || glance.len() < READINGS_MIN.0 {
            return HoldProgress::Moving(Vec::new());
        }
        let restless = restless(&glance, scales);
        if too_many(&restless, &glance) {
            self.still_since_ns = None;
            return HoldProgress::Moving(restless);
        }
        let still_since = *self.still_since_ns.get_or_insert(start_ns);
        let held_ns = now_ns.saturating_sub(still_since);
        if is_doubted {
            self.doubted_ns = now_ns;
        }
        let unmoved = self.is_unmoved(&glance, scales);
        let is_unseen = self.pose == CalibrationPose::Spread && held_ns >= UNMOVED_PATIENCE_NS;
        if unmoved && !is_unseen {
            return HoldProgress::Unmoved;
        }
        let whole = self.since(now_ns.saturating_sub(HOLD_NS).max(still_since));
        if is_doubted && held_ns < DOUBTED_HOLD_NS {
            return HoldProgress::Doubtful(held_ns as f64 / DOUBTED_HOLD_NS as f64);
        }
        // A hand that has slipped into the pose so that few sensors saw it move has to hold it from then on.
        let clear_ns = if is_doubted {
            held_ns
        } else {
            now_ns.saturating_sub(still_since.max(self.doubted_ns))
        };
        if clear_ns < HOLD_NS || whole.len() < READINGS_MIN.1 {
            return HoldProgress::Holding((clear_ns as f64 / HOLD_NS as f64).min(1.0));
        }
        // A creeping hand is still at every glance and yet elsewhere in the end.
        let crept = self::restless(&whole, scales);
        if too_many(&crept, &whole) {
            self.still_since_ns = None;
            return HoldProgress::Moving(crept);
        }
        HoldProgress::Done(Box::new(capture(self.pose, &whole, unmoved)))
    }

    fn since(&self, start_ns: u64) -> Vec<Frame> {
        let first = self
            .frames
            .partition_point(|frame| frame.stamp_ns < start_ns);
        self.frames.range(first..).copied().collect()
    }

    fn is_unmoved(&self, glance: &[Frame], scales: &Scales) -> bool {
        let Some(before) = &self.before else {
            return false;
        };
        GloveSensor::ALL.into_iter().all(|sensor| {
            let (Some(held), Some(mean)) = (before.sensor(sensor), mean(&values(glance, sensor)))
            else {
                return true;
            };
            (mean - held.median).abs() <= MOVED_SHARE * scales.reach(sensor)
        })
    }
}

/// The raw values of one sensor.
fn values(frames: &[Frame], sensor: GloveSensor) -> Vec<f64> {
    frames
        .iter()
        .filter_map(|frame| frame.raw[sensor.slot()])
        .collect()
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Standard deviation of what changes from one value to the next; a slow drift hardly counts, nor does a single jump.
fn noise(values: &[f64]) -> f64 {
    let mut squares: Vec<f64> = values
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).powi(2))
        .collect();
    squares.sort_by(f64::total_cmp);
    let n_jumps = (JUMP_SHARE * squares.len() as f64).ceil() as usize;
    squares.truncate(squares.len() - n_jumps);
    if squares.is_empty() {
        return 0.0;
    }
    (squares.iter().sum::<f64>() / squares.len() as f64 / 2.0).sqrt()
}

/// The sensors that are not still.
fn restless(frames: &[Frame], scales: &Scales) -> Vec<GloveSensor> {
    let is_restless = |sensor: &GloveSensor| {
        let values = values(frames, *sensor);
        let third = values.len().div_ceil(3).max(1);
        let means: Vec<f64> = values.chunks(third).filter_map(mean).collect();
        let low = means.iter().copied().fold(f64::INFINITY, f64::min);
        let high = means.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let standard_error = noise(&values) * (2.0 / third as f64).sqrt();
        high - low > (STILL_SHARE * scales.reach(*sensor)).max(STILL_ERRORS * standard_error)
    };
    GloveSensor::ALL.into_iter().filter(is_restless).collect()
}

fn too_many(restless: &[GloveSensor], frames: &[Frame]) -> bool {
    let n_sensors = frames
        .last()
        .map_or(0, |frame| frame.raw.iter().flatten().count());
    restless.len() as f64 > (RESTLESS_SHARE * n_sensors as f64).floor()
}

fn capture(pose: CalibrationPose, frames: &[Frame], unmoved: bool) -> PoseCapture {
    let mut sensors = [None; GloveSensor::N_SLOTS];
    for sensor in GloveSensor::ALL {
        let values = values(frames, sensor);
        let noise = noise(&values);
        let mut sorted = values;
        sorted.sort_by(f64::total_cmp);
        if sorted.is_empty() {
            continue;
        }
        let median = f64::midpoint(sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]);
        let n_at_median = sorted.iter().filter(|raw| **raw == median).count();
        sensors[sensor.slot()] = Some(Held {
            median,
            noise,
            share_at_median: n_at_median as f64 / sorted.len() as f64,
        });
    }
    PoseCapture {
        pose,
        sensors,
        n_readings: frames.len(),
        unmoved,
    }
}
