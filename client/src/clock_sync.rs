use std::collections::VecDeque;

use thiserror::Error;

/// How fast two quartz clocks may drift apart, as a ratio: 100 ppm is twice what a bad one does.
/// Larger makes old samples worthless sooner; smaller makes the bound a lie on bad hardware.
const DRIFT: f64 = 100e-6;

/// One exchange with the daemon's `Clock.Ping`; all nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PingSample {
    /// Client's clock when it asked.
    pub t0_ns: u64,
    /// Daemon's clock when the question came.
    pub t1_ns: u64,
    /// Daemon's clock when the answer left.
    pub t2_ns: u64,
    /// Client's clock when the answer came.
    pub t3_ns: u64,
}

impl PingSample {
    /// Time on the way, there and back, nanoseconds. Negative only when a clock was set in between.
    pub fn round_trip_ns(&self) -> i64 {
        difference(self.t3_ns, self.t0_ns).saturating_sub(difference(self.t2_ns, self.t1_ns))
    }

    /// Daemon's clock minus client's clock, nanoseconds, taking both ways as equally long.
    pub fn offset_ns(&self) -> i64 {
        let there = i128::from(difference(self.t1_ns, self.t0_ns));
        let back = i128::from(difference(self.t2_ns, self.t3_ns));
        clamp((there + back) / 2)
    }
}

/// Why a sample is of no use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum PingFault {
    /// The answer came before the question, or was held longer than the whole exchange took: a clock was set.
    #[error("the times of this ping contradict each other: a clock was set while it was under way")]
    Contradiction,
}

/// What is known about the daemon's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockEstimate {
    /// Daemon's clock minus client's clock, nanoseconds.
    pub offset_ns: i64,
    /// The true offset lies within this of the estimate, nanoseconds: half the best round trip, and what the clocks
    /// may have drifted since.
    pub error_ns: u64,
    /// Round trip of the sample that was chosen, nanoseconds.
    pub round_trip_ns: u64,
}

impl ClockEstimate {
    /// The daemon's time at that time of the client, nanoseconds since the Unix epoch.
    pub fn server_ns(&self, client_ns: u64) -> u64 {
        client_ns.saturating_add_signed(self.offset_ns)
    }
}

/// Estimates the offset of two clocks from the exchanges of a short window.
///
/// The sample with the least bound is believed alone: a long round trip tells how long the queue was, not where the
/// clock stands (the minimum filter of NTP, Mills 1991).
#[derive(Clone, Debug)]
pub struct ClockSync {
    window: VecDeque<PingSample>,
    capacity: usize,
}

impl ClockSync {
    /// Keeps that many samples, at least one.
    pub fn new(capacity: usize) -> Self {
        Self {
            window: VecDeque::new(),
            capacity: capacity.max(1),
        }
    }

    /// Takes one exchange.
    ///
    /// # Errors
    /// When its times contradict each other; then it is not kept.
    pub fn push(&mut self, sample: PingSample) -> Result<(), PingFault> {
        if sample.t3_ns < sample.t0_ns || sample.t2_ns < sample.t1_ns || sample.round_trip_ns() < 0
        {
            return Err(PingFault::Contradiction);
        }
        if self.window.len() == self.capacity {
            self.window.pop_front();
        }
        self.window.push_back(sample);
        Ok(())
    }

    /// Forgets everything: the daemon is another one now.
    pub fn clear(&mut self) {
        self.window.clear();
    }

    /// The best estimate at the time of the newest sample; `None` before the first.
    pub fn estimate(&self) -> Option<ClockEstimate> {
        let now_ns = self.window.back()?.t3_ns;
        self.window
            .iter()
            .map(|sample| estimate_of(sample, now_ns))
            .min_by_key(|estimate| estimate.error_ns)
    }
}

fn estimate_of(sample: &PingSample, now_ns: u64) -> ClockEstimate {
    let round_trip_ns = sample.round_trip_ns().unsigned_abs();
    let age_ns = now_ns.saturating_sub(sample.t3_ns);
    let drift_ns = (age_ns as f64 * DRIFT).ceil() as u64;
    ClockEstimate {
        offset_ns: sample.offset_ns(),
        error_ns: round_trip_ns.div_ceil(2) + drift_ns,
        round_trip_ns,
    }
}

fn difference(later: u64, earlier: u64) -> i64 {
    clamp(i128::from(later) - i128::from(earlier))
}

fn clamp(value: i128) -> i64 {
    value.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An exchange begun at `t0`, with these times on the way, against a daemon that is `offset` ahead.
    fn ping(t0: u64, there: u64, back: u64, offset: i64) -> PingSample {
        let t1 = (t0 + there).checked_add_signed(offset).unwrap();
        PingSample {
            t0_ns: t0,
            t1_ns: t1,
            t2_ns: t1 + 7,
            t3_ns: t0 + there + 7 + back,
        }
    }

    fn check(samples: &[PingSample], offset_ns: i64, error_ns: u64) {
        let mut sync = ClockSync::new(8);
        for sample in samples {
            sync.push(*sample).unwrap();
        }
        let estimate = sync.estimate().unwrap();
        assert_eq!(
            (estimate.offset_ns, estimate.error_ns),
            (offset_ns, error_ns)
        );
    }

    #[test]
    fn one_exchange() {
        check(&[ping(1_000, 100, 100, 0)], 0, 100);
        check(&[ping(1_000, 100, 100, 5_000)], 5_000, 100);
        check(&[ping(10_000, 100, 100, -5_000)], -5_000, 100);
        // All the way there, none back: off by half the round trip, just inside the bound.
        check(&[ping(1_000, 200, 0, 5_000)], 5_100, 100);
    }

    #[test]
    fn the_shortest_round_trip_is_believed() {
        check(
            &[
                ping(1_000, 900, 100, 50),
                ping(3_000, 10, 10, 50),
                ping(5_000, 100, 4_000, 50),
            ],
            50,
            11,
        );
    }

    #[test]
    fn an_old_sample_loses_to_drift() {
        // A second later the first one is good to 10 + 100 000 ns, the second to 2 000 ns.
        check(
            &[
                ping(1_000, 10, 10, 50),
                ping(1_000_001_000, 2_000, 2_000, 70),
            ],
            70,
            2_000,
        );
    }

    #[test]
    fn the_window_is_bounded() {
        let mut sync = ClockSync::new(2);
        for (t0, trip) in [(0, 1), (100, 50), (300, 60)] {
            sync.push(ping(t0, trip, trip, 0)).unwrap();
        }
        assert_eq!(sync.estimate().unwrap().round_trip_ns, 100);
        sync.clear();
        assert_eq!(sync.estimate(), None);
    }

    #[test]
    fn contradictions_are_refused() {
        let mut sync = ClockSync::new(2);
        for sample in [
            PingSample {
                t0_ns: 10,
                t1_ns: 1,
                t2_ns: 2,
                t3_ns: 9,
            },
            PingSample {
                t0_ns: 10,
                t1_ns: 2,
                t2_ns: 1,
                t3_ns: 20,
            },
            PingSample {
                t0_ns: 10,
                t1_ns: 0,
                t2_ns: 100,
                t3_ns: 20,
            },
        ] {
            assert_eq!(sync.push(sample), Err(PingFault::Contradiction));
        }
        assert_eq!(sync.estimate(), None);
    }

    #[test]
    fn the_true_offset_is_within_the_bound() {
        for there in [0, 3, 40, 1_000] {
            for back in [0, 5, 70, 2_000] {
                let mut sync = ClockSync::new(4);
                sync.push(ping(1_000_000, there, back, -777)).unwrap();
                let estimate = sync.estimate().unwrap();
                assert!(
                    (estimate.offset_ns + 777).unsigned_abs() <= estimate.error_ns,
                    "{there} there, {back} back"
                );
                assert_eq!(
                    estimate.server_ns(2_000_000),
                    2_000_000u64.saturating_add_signed(estimate.offset_ns)
                );
            }
        }
    }
}
