//! Which frame belongs to which bend.

use std::time::{SystemTime, UNIX_EPOCH};

use crate::glove::Bends;

/// Share of a bend's way up to which the finger counts as where it was, or as there.
const STILL: f64 = 0.01;
/// Share of the way that may be left when the finger counts as nearly there.
const NEAR: f64 = 0.10;
/// Frames in which the two ends of the way are learnt.
const N_LEARNING: u64 = 2000;

/// What one frame shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Distance of two joints that a bend changes, metres.
    pub(crate) distance_m: f64,
    /// When the step was made, wall clock, ns.
    pub(crate) step_ns: u64,
    /// When the frame arrived, wall clock, ns.
    pub(crate) arrival_ns: u64,
}

/// How long one bend took, µs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Delay {
    /// From the byte to the first step that it moves the finger in.
    pub(crate) to_step_us: f64,
    /// From the byte to the subscriber's first frame with it.
    pub(crate) first_us: f64,
    /// From the byte to the subscriber's frame in which nine tenths of the way are done.
    pub(crate) near_us: f64,
}

/// Where the finger is between the two ends of its way.
#[derive(Clone, Copy, Debug)]
enum Phase {
    /// At one of the ends.
    Still { at_m: f64 },
    /// On the way from an end; the bend that moves it was written at this time.
    Leaving {
        from_m: f64,
        written_ns: u64,
        delay: Delay,
    },
    /// Nearly at the end.
    Nearly,
}

/// Frames and bends, brought together.
#[derive(Debug)]
pub(crate) struct MatchUp {
    /// The least and the largest distance.
    ends_m: [f64; 2],
    phase: Phase,
    /// One per bend that showed.
    pub(crate) delays: Vec<Delay>,
    /// Frames seen.
    pub(crate) n_frames: u64,
    /// Frames that the daemon skipped for this subscriber.
    pub(crate) n_skipped: u64,
    /// When the ends of the way were known, wall clock, ns.
    pub(crate) counting_since_ns: u64,
}

impl Default for MatchUp {
    fn default() -> Self {
        let ends_m = [f64::INFINITY, f64::NEG_INFINITY];
        Self {
            ends_m,
            phase: Phase::Nearly,
            delays: Vec::new(),
            n_frames: 0,
            n_skipped: 0,
            counting_since_ns: 0,
        }
    }
}

impl MatchUp {
    /// Takes a frame in. Bends are so far apart that the newest one before a step is the one that shows in it.
    pub(crate) fn take(&mut self, seen: &Seen, bends: &Bends) {
        self.n_frames += 1;
        if self.n_frames < N_LEARNING {
            self.ends_m = [
                self.ends_m[0].min(seen.distance_m),
                self.ends_m[1].max(seen.distance_m),
            ];
            self.counting_since_ns = seen.arrival_ns;
            return;
        }
        let way_m = self.ends_m[1] - self.ends_m[0];
        let share_from = |end_m: f64| (seen.distance_m - end_m).abs() / way_m;
        let since = |from_ns: u64, at_ns: u64| at_ns.saturating_sub(from_ns) as f64 / 1000.0;
        if let Phase::Still { at_m } = self.phase
            && share_from(at_m) > STILL
            && let Some(written_ns) = bends.newest_before(seen.step_ns)
        {
            let first_us = since(written_ns, seen.arrival_ns);
            let delay = Delay {
                to_step_us: since(written_ns, seen.step_ns),
                first_us,
                near_us: first_us,
            };
            self.phase = Phase::Leaving {
                from_m: at_m,
                written_ns,
                delay,
            };
        }
        if let Phase::Leaving {
            from_m,
            written_ns,
            delay,
        } = self.phase
            && share_from(from_m) >= 1.0 - NEAR
        {
            self.delays.push(Delay {
                near_us: since(written_ns, seen.arrival_ns),
                ..delay
            });
            self.phase = Phase::Nearly;
        }
        if let Phase::Nearly = self.phase {
            let end = self
                .ends_m
                .into_iter()
                .find(|end_m| share_from(*end_m) <= STILL);
            self.phase = end.map_or(self.phase, |at_m| Phase::Still { at_m });
        }
    }
}

/// The wall clock, ns: that of the frames' stamps.
pub(crate) fn now_ns() -> u64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_nanos() as u64)
}
