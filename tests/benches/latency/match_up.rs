//! Which frame belongs to which record.

use std::collections::BTreeMap;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::glove::Bends;

/// What one frame shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Distance of two joints, micrometres: one value per bend.
    pub(crate) distance_um: u64,
    /// When the step was made, wall clock, ns.
    pub(crate) step_ns: u64,
    /// When the frame arrived, wall clock, ns.
    pub(crate) arrival_ns: u64,
}

/// How long one record took.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Delay {
    /// From the byte to the step, µs.
    pub(crate) to_step_us: f64,
    /// From the byte to the subscriber, µs.
    pub(crate) whole_us: f64,
}

/// Frames and records, brought together.
#[derive(Debug, Default)]
pub(crate) struct MatchUp {
    /// For each distance, how often each bend was the newest when it first showed.
    learnt: BTreeMap<u64, BTreeMap<u64, u32>>,
    last_um: Option<u64>,
    /// One per record that showed.
    pub(crate) delays: Vec<Delay>,
    /// Frames seen.
    pub(crate) n_frames: u64,
    /// Frames that the daemon skipped for this subscriber.
    pub(crate) n_skipped: u64,
    /// Changes whose record is not known.
    pub(crate) n_unknown: u64,
}

impl MatchUp {
    /// Takes a frame in. While learning, the newest record is taken for the one that shows; a record takes less than its
    /// period as a rule, so the most frequent answer is the right one.
    pub(crate) fn take(&mut self, seen: &Seen, bends: &Bends, is_learning: bool) {
        self.n_frames += 1;
        if self.last_um.replace(seen.distance_um) == Some(seen.distance_um) {
            return;
        }
        if is_learning {
            if let Some((bend, _)) = bends.newest_before(seen.arrival_ns) {
                *self
                    .learnt
                    .entry(seen.distance_um)
                    .or_default()
                    .entry(bend)
                    .or_default() += 1;
            }
            return;
        }
        let bend = self
            .learnt
            .get(&seen.distance_um)
            .and_then(|votes| votes.iter().max_by_key(|(_, votes)| **votes));
        match bend.and_then(|(bend, _)| bends.written_before(*bend, seen.step_ns)) {
            Some(written_ns) => self.delays.push(Delay {
                to_step_us: seen.step_ns.saturating_sub(written_ns) as f64 / 1000.0,
                whole_us: seen.arrival_ns.saturating_sub(written_ns) as f64 / 1000.0,
            }),
            None => self.n_unknown += 1,
        }
    }
}

/// The wall clock, ns: that of the frames' stamps.
pub(crate) fn now_ns() -> u64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_nanos() as u64)
}
