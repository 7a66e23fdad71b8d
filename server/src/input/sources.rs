//! One source as seen from outside: its lane to the tick and its statistics.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use tokio::sync::watch;
use tsukamu_proto::v1;
use tsukamu_world::state::HandId;

use crate::convert::device::hand_stream;

pub use super::seen::{Arrived, Seen};

use super::feedback::Feel;
use super::fusion::StreamReport;
use super::meter::Meter;
use super::supervise::{Supervised, fill_gaps};

/// Kind of a hand that devices make.
pub const HAND: &str = "hand";
/// Age of its newest sample beyond which such a hand stands still, seconds.
const QUIET_S: f64 = 1.0;
/// Samples that wait for a step, at most: the newest wins, the others are kept for the recording only. A glove and a
/// tracker together send some 250 per second, and a scene may step as slowly as once in one.
const LANE_CAPACITY: usize = 1024;

/// What a source is, where it is, and how it does. Shared by whoever fills it, the tick, and those who ask.
#[derive(Debug)]
pub struct Source {
    /// Its name, unique among those that are there.
    pub name: String,
    /// `cyberglove`, `fastrak`, `csv`, `recording`, `synthetic`, `remote`.
    pub kind: &'static str,
    /// The port's path, the file, or the client's address.
    pub place: String,
    /// Id + 1 of the hand it drives, 0 for none.
    hand: AtomicU32,
    /// The glove that is told what the hand touches, if there is one.
    feel: OnceLock<Feel>,
    lane: Mutex<Lane>,
    changed: Arc<watch::Sender<u64>>,
}

#[derive(Debug)]
pub(super) struct Lane {
    waiting: VecDeque<Arrived>,
    pub(super) meter: Meter,
    pub(super) health: Health,
    /// What is known of a device beside its samples; `None` for another source.
    pub(super) supervised: Option<Box<Supervised>>,
    n_samples: u64,
    n_dropped: u64,
    n_superseded: u64,
}

/// What a source says about itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Health {
    /// `absent`, `opening`, `resetting`, `querying`, `running`, `stalled`, `ended`.
    pub state: &'static str,
    /// Why, when it is not running.
    pub error: String,
    /// Records that a device's decoder threw away.
    pub n_bad_records: u64,
    /// Times that a decoder lost step.
    pub n_resyncs: u64,
    /// Bytes received.
    pub n_bytes: u64,
    /// Times that a port was opened again.
    pub n_reconnects: u64,
    /// Lag that filter and joining add, in seconds.
    pub lag_s: f64,
    /// Of a hand of devices: the wrist's stream and the fingers'.
    pub streams: Option<[StreamReport; 2]>,
}

impl Source {
    /// Hands a sample to the tick, and counts it. One with a number that is not finite, or beyond the world's reach, is
    /// dropped and counted.
    pub fn offer(&self, arrived: Arrived) {
        let mut lane = self.lane();
        lane.note(arrived.arrival_ns);
        lane.push(arrived);
    }

    /// Hands a sample to the tick that was counted elsewhere.
    pub fn offer_uncounted(&self, arrived: Arrived) {
        self.lane().push(arrived);
    }

    /// Counts a record that arrived.
    pub fn note(&self, arrival_ns: u64) {
        self.lane().note(arrival_ns);
    }

    /// Moves everything that waits to `arrived`, oldest first.
    pub fn drain(&self, arrived: &mut Vec<Arrived>) {
        arrived.extend(self.lane().waiting.drain(..));
    }

    /// Counts a sample that is none.
    pub fn note_dropped(&self, arrival_ns: u64) {
        let mut lane = self.lane();
        lane.note(arrival_ns);
        lane.n_dropped += 1;
    }

    /// Samples that were refused so far.
    pub fn n_dropped(&self) -> u64 {
        self.lane().n_dropped
    }

    /// Counts samples that newer ones replaced.
    pub fn note_superseded(&self, n_superseded: u64) {
        if n_superseded > 0 {
            self.lane().n_superseded += n_superseded;
        }
    }

    /// Samples that newer ones replaced so far.
    pub fn n_superseded(&self) -> u64 {
        self.lane().n_superseded
    }

    /// Changes what the source says about itself; watchers are told when state or error changed.
    pub fn update(&self, change: impl FnOnce(&mut Health)) {
        let is_news = {
            let mut lane = self.lane();
            let (state, error) = (lane.health.state, lane.health.error.clone());
            change(&mut lane.health);
            lane.health.state != state || lane.health.error != error
        };
        if is_news {
            self.tell_change();
        }
    }

    /// Wakes those who watch the list.
    pub(super) fn tell_change(&self) {
        self.changed.send_modify(|n| *n += 1);
    }

    /// From now on that glove is told what the hand touches; only the first call counts.
    pub fn set_feel(&self, feel: Feel) {
        self.feel.get_or_init(|| feel);
    }

    /// The glove that is told what the hand touches.
    pub fn feel(&self) -> Option<&Feel> {
        self.feel.get()
    }

    /// The hand it drives, if it drives one.
    pub fn set_hand(&self, hand: Option<HandId>) {
        self.hand.store(
            hand.map_or(0, |hand| hand.0.saturating_add(1)),
            Ordering::Relaxed,
        );
    }

    /// How it does at a monotonic time in nanoseconds.
    pub fn device(&self, now_ns: u64) -> v1::Device {
        let lane = self.lane();
        let health = &lane.health;
        let mut device = v1::Device {
            name: self.name.clone(),
            kind: self.kind.to_owned(),
            place: self.place.clone(),
            state: health.state.to_owned(),
            error: health.error.clone(),
            rate_hz: lane.meter.rate_hz(now_ns),
            longest_gap_s: lane.meter.longest_gap_s(now_ns),
            age_s: lane.meter.age_s(now_ns),
            samples: lane.n_samples,
            dropped: lane.n_dropped + health.n_bad_records,
            resyncs: health.n_resyncs,
            bytes: health.n_bytes,
            reconnects: health.n_reconnects,
            hand: self.hand.load(Ordering::Relaxed),
            filter_lag_s: health.lag_s,
            wrist: health.streams.map(|[wrist, _]| hand_stream(&wrist, now_ns)),
            fingers: health
                .streams
                .map(|[_, fingers]| hand_stream(&fingers, now_ns)),
            superseded: lane.n_superseded,
            jitter_s: lane.meter.jitter_s(now_ns),
            ..v1::Device::default()
        };
        fill_gaps(&mut device, lane.meter.gaps());
        // A hand has no port that could be lost: what its devices send is all that is known of it.
        if self.kind == HAND && !(0.0..=QUIET_S).contains(&device.age_s) {
            "stalled".clone_into(&mut device.state);
            "its devices send nothing".clone_into(&mut device.error);
        }
        if let Some(supervised) = &lane.supervised {
            supervised.fill(&mut device, now_ns);
        }
        device
    }

    /// A panic elsewhere leaves counters and a queue: usable.
    pub(super) fn lane(&self) -> MutexGuard<'_, Lane> {
        self.lane.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Lane {
    pub(super) fn note(&mut self, arrival_ns: u64) {
        self.meter.note(arrival_ns);
        self.n_samples += 1;
    }

    fn push(&mut self, arrived: Arrived) {
        if !arrived.seen.is_valid() {
            self.n_dropped += 1;
            return;
        }
        if self.waiting.len() == LANE_CAPACITY {
            self.waiting.pop_front();
            self.n_superseded += 1;
        }
        self.waiting.push_back(arrived);
    }
}

/// The list of all sources; cheap to clone.
#[derive(Clone, Debug)]
pub struct Sources {
    list: Arc<Mutex<Vec<Arc<Source>>>>,
    changed: Arc<watch::Sender<u64>>,
}

impl Sources {
    /// An empty list.
    pub fn new() -> Self {
        Self {
            list: Arc::default(),
            changed: Arc::new(watch::Sender::new(0)),
        }
    }

    /// Adds a source. A name that is taken gets a number.
    pub fn add(
        &self,
        name: &str,
        kind: &'static str,
        place: String,
        state: &'static str,
    ) -> Arc<Source> {
        let mut list = self.list();
        let taken = |name: &str| list.iter().any(|source| source.name == name);
        let numbered = (2_u64..).map(|number| format!("{name} {number}"));
        let name = std::iter::once(name.to_owned())
            .chain(numbered)
            .find(|name| !taken(name))
            .unwrap_or_default();
        let source = Arc::new(Source {
            name,
            kind,
            place,
            hand: AtomicU32::new(0),
            feel: OnceLock::new(),
            lane: Mutex::new(Lane {
                waiting: VecDeque::new(),
                meter: Meter::default(),
                health: Health {
                    state,
                    ..Health::default()
                },
                supervised: None,
                n_samples: 0,
                n_dropped: 0,
                n_superseded: 0,
            }),
            changed: Arc::clone(&self.changed),
        });
        list.push(Arc::clone(&source));
        drop(list);
        self.changed.send_modify(|n| *n += 1);
        source
    }

    /// Takes a source off the list.
    pub fn remove(&self, source: &Arc<Source>) {
        self.list().retain(|other| !Arc::ptr_eq(other, source));
        self.changed.send_modify(|n| *n += 1);
    }

    /// All sources at a monotonic time in nanoseconds.
    pub fn devices(&self, now_ns: u64) -> Vec<v1::Device> {
        let device = |source: &Arc<Source>| source.device(now_ns);
        self.all().iter().map(device).collect()
    }

    /// All sources that are there.
    pub fn all(&self) -> Vec<Arc<Source>> {
        self.list().clone()
    }

    /// Changes whenever a source comes, goes, or changes its state.
    pub fn changes(&self) -> watch::Receiver<u64> {
        self.changed.subscribe()
    }

    /// Every change to the list is one push or retain: a panic elsewhere leaves it whole.
    fn list(&self) -> MutexGuard<'_, Vec<Arc<Source>>> {
        self.list.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Default for Sources {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3};
    use tsukamu_world::hand::sample::{FingerPose, HandSample, JointAngles};

    use super::*;

    fn arrived(arrival_ns: u64, x: f64) -> Arrived {
        let wrist = Isometry3::from_parts(
            Translation3::new(x, 0.0, 0.0),
            nalgebra::UnitQuaternion::identity(),
        );
        let fingers = FingerPose::Angles(JointAngles::default());
        Arrived {
            source_ns: 0,
            arrival_ns,
            fitted_ns: arrival_ns,
            ticks: None,
            seen: Seen::Whole(Some(HandSample { wrist, fingers })),
        }
    }

    #[test]
    fn a_lane_is_bounded_and_counts_what_it_drops() {
        let sources = Sources::new();
        let source = sources.add("a", "remote", String::new(), "running");
        let n = LANE_CAPACITY as u64 + 36;
        (0..n).for_each(|k| source.offer(arrived(k, 0.0)));
        for bad in [f64::NAN, f64::INFINITY, 1.0e300, -1.0e5] {
            source.offer(arrived(n, bad));
        }
        let mut all = Vec::new();
        source.drain(&mut all);
        assert_eq!(all.len(), LANE_CAPACITY);
        assert_eq!(all.last().map(|a| a.arrival_ns), Some(n - 1));
        let device = source.device(n);
        let counts = (device.samples, device.superseded, device.dropped);
        assert_eq!(counts, (n + 4, 36, 4));
    }

    #[test]
    fn names_are_unique_and_changes_are_told() {
        let sources = Sources::new();
        let mut changes = sources.changes();
        changes.mark_unchanged();
        let first = sources.add("a", "remote", String::new(), "running");
        let second = sources.add("a", "remote", String::new(), "running");
        assert_eq!((first.name.as_str(), second.name.as_str()), ("a", "a 2"));
        assert!(changes.has_changed().is_ok_and(|changed| changed));
        changes.mark_unchanged();
        first.update(|health| health.n_bytes = 7);
        assert!(changes.has_changed().is_ok_and(|changed| !changed));
        first.update(|health| health.state = "stalled");
        assert!(changes.has_changed().is_ok_and(|changed| changed));
        sources.remove(&first);
        assert_eq!(sources.devices(0).len(), 1);
    }
}
