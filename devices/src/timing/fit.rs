//! A device's own counter, fitted to the daemon's clock.

use super::envelope::Envelope;

/// Time over which the lowest of the arrivals are taken together, ns.
const BIN_NS: f64 = 1.0e9;
/// How many of them a fit looks back on: about a minute, in which the rate of a crystal stays what it is.
const N_BINS: usize = 64;
/// How far a counter's rate may be from its nominal one, as a share. Crystals are within 0.0001, RC oscillators 0.01.
const RATE_ERROR_MAX: f64 = 0.02;
/// A record cannot arrive before it was sent: earlier by more than this, ns, and the counter has jumped.
const EARLY_MAX_NS: f64 = 50.0e6;
/// Records that are later than this, ns, have been waiting somewhere; or the counter has jumped.
const LATE_MAX_NS: f64 = 100.0e6;
/// It has jumped when all are so late for this long, ns.
const LATE_FOR_NS: u64 = 2_000_000_000;
/// Records and bins needed where the counter's unit is not known.
const N_MIN: u64 = 16;
/// Bins from which a nominal rate can be found to be wrong, and a drift be told.
const DRIFT_BINS: usize = 8;

/// Maps a device's counter to the daemon's monotonic time: offset and drift, with an error bound.
///
/// The line under the arrivals is followed (see the module `envelope`), so that queues and batches on the way do not
/// move it. What remains is the shortest time that a record takes to arrive: it cannot be seen from here, and a delay in
/// the settings is the place for it.
#[derive(Debug, Clone)]
pub struct ClockFit {
    /// Nominal length of a tick, ns.
    tick_ns: Option<f64>,
    /// Whether the counter was seen not to keep its nominal rate.
    is_nominal_wrong: bool,
    envelope: Envelope,
    /// The origin: counter and arrival of the first record.
    base: Option<(u64, u64)>,
    last_ticks: u64,
    late_since_ns: Option<u64>,
    n_restarts: u64,
}

impl ClockFit {
    /// A fit that has seen nothing. `tick_ns` is the nominal length of a tick, ns; `None` where it is not known.
    #[must_use]
    pub fn new(tick_ns: Option<f64>) -> Self {
        let mut fit = Self {
            tick_ns: usable(tick_ns),
            is_nominal_wrong: false,
            envelope: Envelope::new(BIN_NS, N_BINS),
            base: None,
            last_ticks: 0,
            late_since_ns: None,
            n_restarts: 0,
        };
        fit.forget();
        fit
    }

    /// When a record was sent, monotonic ns, never later than its arrival; `None` while that cannot be told. Arrivals
    /// must not fall.
    pub fn push(&mut self, ticks: u64, arrival_ns: u64) -> Option<u64> {
        if self.is_jump(ticks, arrival_ns) {
            // Late once more, and soon: it is not the counter that jumps, it is slower than was said.
            let is_young = self.envelope.n_bins() < DRIFT_BINS;
            let ran_on = self.late_since_ns.is_some() && ticks >= self.last_ticks;
            self.is_nominal_wrong |= is_young && ran_on && self.n_restarts > 0;
            self.restart();
        }
        let (base_ticks, base_ns) = *self.base.get_or_insert((ticks, arrival_ns));
        let y = arrival_ns.saturating_sub(base_ns) as f64;
        let x = difference(ticks, base_ticks);
        if ticks >= self.last_ticks || self.envelope.n() == 0 {
            self.last_ticks = ticks;
            self.envelope.push(x, y);
            self.doubt_nominal();
        }
        let is_known =
            self.limits().is_some() || (self.envelope.n() >= N_MIN && self.envelope.n_bins() >= 2);
        let line = self.envelope.line().filter(|_| is_known)?;
        // Before the origin there is nothing; a float to integer cast saturates.
        Some(
            base_ns
                .saturating_add(line.at(x).max(0.0) as u64)
                .min(arrival_ns),
        )
    }

    /// Begins anew with that nominal length of a tick, ns; one that was found to be wrong stays wrong.
    pub fn set_tick(&mut self, tick_ns: Option<f64>) {
        let tick_ns = usable(tick_ns);
        self.is_nominal_wrong &= self.tick_ns == tick_ns;
        self.tick_ns = tick_ns;
        self.restart();
    }

    /// Begins anew, as after the device was gone.
    pub fn restart(&mut self) {
        if self.base.is_some() {
            self.n_restarts += 1;
        }
        self.forget();
    }

    /// How much faster the device's clock runs than the daemon's, parts per million; `None` while it is not known, or
    /// where the counter's unit is not.
    #[must_use]
    pub fn drift_ppm(&self) -> Option<f64> {
        let tick_ns = self.tick_ns.filter(|_| !self.is_nominal_wrong)?;
        let measured_ns = self.tick_s()? * 1.0e9;
        (self.envelope.n_bins() >= DRIFT_BINS).then(|| (tick_ns / measured_ns - 1.0) * 1.0e6)
    }

    /// Measured length of a tick, s; `None` while it is not known.
    #[must_use]
    pub fn tick_s(&self) -> Option<f64> {
        self.envelope.line().map(|line| line.slope * 1.0e-9)
    }

    /// How far a stamp may be off, s, beside the shortest time of arrival; `None` while nothing is known.
    #[must_use]
    pub fn error_s(&self) -> Option<f64> {
        let line = self.envelope.line()?;
        // The counter itself is no finer than its tick.
        let own_ns = line.slope.min(BIN_NS);
        Some((self.envelope.error_ns() + own_ns) * 1.0e-9)
    }

    /// Times that it began anew.
    #[must_use]
    pub const fn n_restarts(&self) -> u64 {
        self.n_restarts
    }

    fn forget(&mut self) {
        let limits = self.limits();
        self.envelope.restart(limits);
        self.base = None;
        self.last_ticks = 0;
        self.late_since_ns = None;
    }

    /// Least and greatest length of a tick, ns.
    fn limits(&self) -> Option<(f64, f64)> {
        let tick_ns = self.tick_ns.filter(|_| !self.is_nominal_wrong)?;
        Some((
            tick_ns * (1.0 - RATE_ERROR_MAX),
            tick_ns * (1.0 + RATE_ERROR_MAX),
        ))
    }

    /// Gives the nominal rate up when some time has shown another.
    fn doubt_nominal(&mut self) {
        let (Some((least, greatest)), Some(free)) = (self.limits(), self.envelope.free_slope())
        else {
            return;
        };
        if self.envelope.n_bins() >= DRIFT_BINS && !(least..=greatest).contains(&free) {
            self.is_nominal_wrong = true;
            self.envelope.unlimit();
        }
    }

    /// Whether a record's counter has nothing to do with those before.
    fn is_jump(&mut self, ticks: u64, arrival_ns: u64) -> bool {
        let (Some((base_ticks, base_ns)), Some(line)) = (self.base, self.envelope.line()) else {
            // Nothing tells the unit yet: a step back is a jump.
            return ticks < self.last_ticks;
        };
        let sent = line.at(difference(ticks, base_ticks));
        let late = arrival_ns.saturating_sub(base_ns) as f64 - sent;
        if late <= LATE_MAX_NS {
            self.late_since_ns = None;
        }
        // A young line may be off by as much as its slope may.
        let young = if self.envelope.n_bins() < DRIFT_BINS {
            0.1 * sent.abs()
        } else {
            0.0
        };
        if late < -EARLY_MAX_NS - young {
            return true;
        }
        if late <= LATE_MAX_NS {
            return false;
        }
        // A record out of order is no later than those before; a counter that went back is set anew.
        let since_ns = *self.late_since_ns.get_or_insert(arrival_ns);
        ticks < self.last_ticks || arrival_ns.saturating_sub(since_ns) > LATE_FOR_NS
    }
}

fn usable(tick_ns: Option<f64>) -> Option<f64> {
    tick_ns.filter(|tick_ns| tick_ns.is_finite() && *tick_ns > 0.0)
}

/// `a - b` where either may be greater.
fn difference(a: u64, b: u64) -> f64 {
    if a >= b {
        (a - b) as f64
    } else {
        -((b - a) as f64)
    }
}
