//! Evenly spaced times for samples of a device that has no clock.

use std::collections::VecDeque;

use super::envelope::{Envelope, Line};

/// Time over which the lowest of the arrivals are taken together, ns.
const BIN_NS: f64 = 0.25e9;
/// How many of them are looked back on: 4 s, after which another rate is the rate.
const N_BINS: usize = 16;
/// Samples and bins until the period is believed.
const N_MIN: u64 = 8;
const BINS_MIN: usize = 3;
/// Bins after which a rhythm must show, and the greatest error that is one, in periods.
const RHYTHM_BINS: usize = 8;
const RHYTHM_ERROR_MAX: f64 = 2.5;
/// Silence after which only the period is kept, ns, and in periods.
const GAP_NS: f64 = 1.0e9;
const GAP_PERIODS: f64 = 8.0;
/// How far the period may move from the one before the silence, as a share.
const PERIOD_CHANGE: f64 = 0.02;
/// Arrivals that must all be later than nearly all before until a sample counts as lost, and by how much, in periods.
const BLOCK: usize = 8;
const FEW_PERIODS: f64 = 0.75;
/// One arrival in so many is late for reasons of its own.
const USUAL_SHARE: usize = 16;
/// Arrivals that must be known, and that are remembered, for that.
const HISTORY_MIN: usize = 48;
const LATE_KEPT: usize = 128;
/// The same where many are lost.
const LATE_MANY: usize = 2;
const MANY_PERIODS: f64 = 4.0;
/// Arrivals that are early, or all late, by more than so many periods are those of another rate.
const DOUBT: f64 = 2.0;
/// Losses beyond which it is the rate that has changed: so many, and this share of the samples of the window.
const LOSSES_MAX: usize = 4;
const LOSS_SHARE_MAX: f64 = 0.03;
/// Beginnings within some time, ns, after which a source counts as having no rate for as long.
const RESTARTS_MAX: usize = 4;
const REST_NS: u64 = 30_000_000_000;
/// Furthest that a stamp is before its arrival, ns.
const BACK_MAX_NS: u64 = 250_000_000;

/// Estimates period and phase of a stream and gives each sample a time before its arrival, evenly spaced.
///
/// The number of a sample takes the place of a counter, and the line under the arrivals is followed as for a counter
/// (see the module `envelope`), with a shorter memory. A sample that is lost makes all later ones late: when enough of
/// them are, their numbers are set right. A source without any regularity, such as one that speaks only when something
/// moves, is left alone.
#[derive(Debug, Clone)]
pub struct DeJitter {
    envelope: Envelope,
    base_ns: u64,
    number: u64,
    last_ns: Option<u64>,
    /// How late the last arrivals were, ns.
    late: VecDeque<f64>,
    /// Numbers at which samples were lost.
    losses: VecDeque<u64>,
    /// When it began anew.
    restarts: VecDeque<u64>,
    rests_until_ns: u64,
    n_restarts: u64,
}

impl Default for DeJitter {
    fn default() -> Self {
        Self::new()
    }
}

impl DeJitter {
    /// One that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self {
            envelope: Envelope::new(BIN_NS, N_BINS),
            base_ns: 0,
            number: 0,
            last_ns: None,
            late: VecDeque::new(),
            losses: VecDeque::new(),
            restarts: VecDeque::new(),
            rests_until_ns: 0,
            n_restarts: 0,
        }
    }

    /// When a sample would have come without jitter, monotonic ns: never after its arrival, and at most 0.25 s before;
    /// `None` while no period is known. Arrivals must not fall.
    pub fn push(&mut self, arrival_ns: u64) -> Option<u64> {
        let before_ns = self.last_ns.replace(arrival_ns);
        if arrival_ns < self.rests_until_ns {
            return None;
        }
        let silence_ns = arrival_ns.saturating_sub(before_ns.unwrap_or(arrival_ns)) as f64;
        let period = self.line().map(|line| line.slope);
        if before_ns.is_none() || silence_ns > GAP_NS.max(GAP_PERIODS * period.unwrap_or(0.0)) {
            self.begin(arrival_ns, period);
        } else {
            self.number += 1;
            self.count_losses(arrival_ns, silence_ns);
        }
        let y = arrival_ns.saturating_sub(self.base_ns) as f64;
        self.envelope.push(self.number as f64, y);
        let line = self.rhythm()?;
        let sent = line.at(self.number as f64).max(0.0) as u64;
        let oldest_ns = arrival_ns.saturating_sub(BACK_MAX_NS);
        Some(
            self.base_ns
                .saturating_add(sent)
                .min(arrival_ns)
                .max(oldest_ns),
        )
    }

    /// Begins anew with the period that it knows, as after the device was gone.
    pub fn restart(&mut self) {
        self.last_ns = None;
    }

    /// Time between two samples, s; `None` while it is not known.
    #[must_use]
    pub fn period_s(&self) -> Option<f64> {
        self.rhythm().map(|line| line.slope * 1.0e-9)
    }

    /// How far a stamp may be off, s, beside the shortest time of arrival; `None` while no period is known.
    #[must_use]
    pub fn error_s(&self) -> Option<f64> {
        self.rhythm().map(|_| self.envelope.error_ns() * 1.0e-9)
    }

    /// Times that it began anew.
    #[must_use]
    pub const fn n_restarts(&self) -> u64 {
        self.n_restarts
    }

    fn line(&self) -> Option<Line> {
        let is_known = self.envelope.has_limits()
            || (self.envelope.n() >= N_MIN && self.envelope.n_bins() >= BINS_MIN);
        self.envelope.line().filter(|_| is_known)
    }

    /// The line, where samples keep to it: a source whose quickest samples are off by more than a period has no rhythm.
    fn rhythm(&self) -> Option<Line> {
        let is_young = self.envelope.n_bins() < RHYTHM_BINS;
        self.line()
            .filter(|line| is_young || self.envelope.error_ns() < RHYTHM_ERROR_MAX * line.slope)
    }

    fn begin(&mut self, arrival_ns: u64, period: Option<f64>) {
        let limits = period.map(|period| {
            (
                period * (1.0 - PERIOD_CHANGE),
                period * (1.0 + PERIOD_CHANGE),
            )
        });
        self.envelope.restart(limits);
        self.base_ns = arrival_ns;
        self.number = 0;
        self.late.clear();
        self.losses.clear();
    }

    /// Sets the number right when samples were lost; begins anew when it is the rate that has changed.
    fn count_losses(&mut self, arrival_ns: u64, silence_ns: f64) {
        let Some(line) = self.line() else { return };
        let period = line.slope;
        let mut late = arrival_ns.saturating_sub(self.base_ns) as f64 - line.at(self.number as f64);
        // Those that come together tell only once how late they are: by the last, which waited least.
        let is_apart = silence_ns > 0.5 * period;
        if is_apart && let Some((jump, n_late)) = self.jump(period) {
            let n_lost = (jump / period).round();
            self.number += n_lost as u64;
            late -= n_lost * period;
            let n_before = self.late.len() - n_late;
            for late in self.late.iter_mut().skip(n_before) {
                *late -= n_lost * period;
            }
            self.losses.push_back(self.number);
        }
        match self.late.back_mut() {
            Some(last) if !is_apart => *last = last.min(late),
            _ => {
                if self.late.len() == LATE_KEPT {
                    self.late.pop_front();
                }
                self.late.push_back(late);
            }
        }
        let n_window = self.envelope.n();
        let oldest = self.number.saturating_sub(n_window);
        self.losses.retain(|number| *number >= oldest);
        let is_lossy = self.losses.len() > LOSSES_MAX + (LOSS_SHARE_MAX * n_window as f64) as usize;
        let recent = self.late.len().saturating_sub(2 * BLOCK);
        let is_slower = recent > 0 && least(self.late.range(recent..)) > DOUBT * period;
        // A line that samples press down by more: a faster rate, or what was taken for lost and only waited.
        let is_faster = late < -DOUBT * period;
        if is_lossy || is_slower || is_faster {
            self.doubt(arrival_ns);
        }
    }

    /// By how much the last arrivals all are late, and how many of them. Those that are no later than others were are no
    /// loss, but batches that beat with the period.
    fn jump(&self, period: f64) -> Option<(f64, usize)> {
        let jump_of = |n_late: usize| {
            let before = self.late.len().checked_sub(n_late)?;
            let jump = least(self.late.range(before..));
            let n_as_late = self.late.range(..before).filter(|late| **late >= jump);
            (n_as_late.count() * USUAL_SHARE <= before).then_some((jump, n_late))
        };
        jump_of(LATE_MANY)
            .filter(|(jump, _)| *jump > MANY_PERIODS * period)
            .or_else(|| {
                jump_of(BLOCK).filter(|(jump, _)| {
                    *jump > FEW_PERIODS * period && self.late.len() >= HISTORY_MIN
                })
            })
    }

    /// Begins anew without a period; soon again and again, and the source has none.
    fn doubt(&mut self, arrival_ns: u64) {
        self.n_restarts += 1;
        self.begin(arrival_ns, None);
        self.restarts.push_back(arrival_ns);
        self.restarts.retain(|at_ns| at_ns + REST_NS > arrival_ns);
        if self.restarts.len() >= RESTARTS_MAX {
            self.restarts.clear();
            self.rests_until_ns = arrival_ns + REST_NS;
        }
    }
}

fn least<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    values.copied().fold(f64::INFINITY, f64::min)
}
