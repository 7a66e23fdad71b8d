//! What emulated trackers have in common: rounds of records at an even pace, and deafness while they start anew.

/// Rounds sent at once by a unit that was not asked for long; older ones are lost.
const MAX_BACKLOG: u64 = 4;

/// When records are due.
#[derive(Debug, Default)]
pub(crate) struct Pace {
    next_ns: Option<u64>,
    deaf_until_ns: Option<u64>,
}

impl Pace {
    /// The first round comes after one period.
    pub(crate) fn start(&mut self, now_ns: u64, period_ns: u64) {
        self.next_ns = Some(now_ns + period_ns);
    }

    pub(crate) const fn stop(&mut self) {
        self.next_ns = None;
    }

    pub(crate) const fn is_running(&self) -> bool {
        self.next_ns.is_some()
    }

    /// Rounds that have become due.
    pub(crate) fn due(&mut self, now_ns: u64, period_ns: u64) -> u64 {
        let period_ns = period_ns.max(1);
        let Some(next_ns) = self.next_ns else {
            return 0;
        };
        let oldest_ns = now_ns.saturating_sub(MAX_BACKLOG * period_ns);
        let next_ns = next_ns.max(oldest_ns);
        let n_rounds = (now_ns + period_ns).saturating_sub(next_ns) / period_ns;
        self.next_ns = Some(next_ns + n_rounds * period_ns);
        n_rounds
    }

    /// Hears nothing until then.
    pub(crate) const fn be_deaf_until(&mut self, end_ns: u64) {
        self.deaf_until_ns = Some(end_ns);
    }

    pub(crate) const fn is_deaf(&self) -> bool {
        self.deaf_until_ns.is_some()
    }

    /// Ends the deafness when its time is over; true once, when it is.
    pub(crate) fn wakes(&mut self, now_ns: u64) -> bool {
        let wakes = self.deaf_until_ns.is_some_and(|end_ns| end_ns <= now_ns);
        if wakes {
            self.deaf_until_ns = None;
        }
        wakes
    }

    /// The next of all that, ns.
    pub(crate) fn deadline(&self) -> Option<u64> {
        [self.next_ns, self.deaf_until_ns]
            .into_iter()
            .flatten()
            .min()
    }
}

#[cfg(test)]
mod tests {
    use super::Pace;

    #[test]
    fn rounds_are_counted_once() {
        let mut pace = Pace::default();
        assert_eq!(pace.due(100, 10), 0);
        pace.start(100, 10);
        assert_eq!((pace.due(109, 10), pace.due(110, 10)), (0, 1));
        assert_eq!((pace.due(110, 10), pace.due(135, 10)), (0, 2));
        // 1000 periods later only the newest are left.
        assert_eq!(pace.due(10_135, 10), 5);
        assert_eq!(pace.deadline(), Some(10_145));
        pace.stop();
        assert_eq!(pace.due(20_000, 10), 0);
        pace.be_deaf_until(7);
        assert!(!pace.wakes(6) && pace.wakes(7) && !pace.wakes(8));
    }
}
