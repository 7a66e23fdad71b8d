//! The even pace of a device that sends by itself.

/// Records sent at once by a device that was not asked for long; older ones are lost.
const MAX_BACKLOG: u64 = 4;

/// When the next record is due.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Beat {
    period_ns: u64,
    next_ns: Option<u64>,
}

impl Beat {
    /// A device that does not send yet.
    pub(crate) const fn new(rate_hz: u64) -> Self {
        Self {
            period_ns: 1_000_000_000 / rate_hz,
            next_ns: None,
        }
    }

    /// Another rate from the next record on.
    pub(crate) const fn set_rate(&mut self, rate_hz: u64) {
        self.period_ns = 1_000_000_000 / rate_hz;
    }

    /// It sends from now on.
    pub(crate) const fn start(&mut self, now_ns: u64) {
        self.next_ns = Some(now_ns);
    }

    /// It sends no more.
    pub(crate) const fn stop(&mut self) {
        self.next_ns = None;
    }

    /// When the next record is due, ns; `None` while it does not send.
    pub(crate) const fn next_ns(&self) -> Option<u64> {
        self.next_ns
    }

    /// The time of one record that is due, ns; to be asked until there is none.
    pub(crate) fn due(&mut self, now_ns: u64) -> Option<u64> {
        let oldest_ns = now_ns.saturating_sub(MAX_BACKLOG * self.period_ns);
        let due_ns = self.next_ns?.max(oldest_ns);
        if due_ns > now_ns {
            return None;
        }
        self.next_ns = Some(due_ns + self.period_ns);
        Some(due_ns)
    }
}
