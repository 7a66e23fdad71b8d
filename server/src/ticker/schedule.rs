//! When steps are due: absolute deadlines from whole numbers, without drift.

/// Nanoseconds per second times micro-steps per step: `deadline = start + k · 10¹⁵ / (rate in µHz)`.
const NANO_MICRO: u128 = 1_000_000_000_000_000;

/// Deadlines of the steps since the clock was started.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    start_ns: u64,
    /// Steps per million seconds.
    rate_micro_hz: u128,
    /// Number of the step that comes next, from 1.
    next: u64,
}

impl Schedule {
    /// Deadlines from a monotonic time in nanoseconds on; the first step is due one step length later.
    pub fn new(start_ns: u64, rate_hz: f64) -> Self {
        Self {
            start_ns,
            rate_micro_hz: ((rate_hz * 1.0e6).round() as u128).max(1),
            next: 1,
        }
    }

    /// When the next step is due, in monotonic nanoseconds.
    pub fn deadline_ns(&self) -> u64 {
        self.at(self.next)
    }

    /// The next step begins at this time: gives how many steps are so late that they are skipped, and goes on to the
    /// one after. A step that is late by less than a step length is still made.
    pub fn advance(&mut self, now_ns: u64) -> u64 {
        let elapsed = u128::from(now_ns.saturating_sub(self.start_ns));
        let newest_due = (elapsed * self.rate_micro_hz / NANO_MICRO) as u64;
        let n_skipped = newest_due.saturating_sub(self.next);
        self.next += n_skipped + 1;
        n_skipped
    }

    fn at(&self, step: u64) -> u64 {
        self.start_ns + (u128::from(step) * NANO_MICRO / self.rate_micro_hz) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadlines_do_not_drift() {
        for (rate, n_steps, seconds) in [
            (240.0, 240 * 86_400, 86_400.0),
            (1.0, 10, 10.0),
            (59.94, 5994, 100.0),
        ] {
            let mut schedule = Schedule::new(17, rate);
            for _ in 1..n_steps.min(6000) {
                assert_eq!(schedule.advance(schedule.deadline_ns()), 0);
            }
            schedule.next = n_steps;
            let late = schedule.deadline_ns() as f64 - 17.0 - seconds * 1.0e9;
            assert!(late.abs() <= 1.0, "{rate} Hz: {late} ns after {seconds} s");
        }
    }

    #[test]
    fn late_steps_are_skipped_and_never_made_up() {
        let mut schedule = Schedule::new(0, 1000.0);
        assert_eq!(schedule.deadline_ns(), 1_000_000);
        assert_eq!(schedule.advance(1_900_000), 0, "late by less than a step");
        assert_eq!(schedule.deadline_ns(), 2_000_000);
        assert_eq!(
            schedule.advance(7_300_000),
            5,
            "steps 2 to 6 are skipped, 7 is made"
        );
        assert_eq!(schedule.deadline_ns(), 8_000_000);
        assert_eq!(schedule.advance(100), 0, "early by someone's clock");
    }
}
