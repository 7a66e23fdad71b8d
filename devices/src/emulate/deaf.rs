//! The time in which a device hears nothing, because it starts anew.

/// Until when.
#[derive(Debug, Clone, Default)]
pub(crate) struct Deafness {
    until_ns: Option<u64>,
}

impl Deafness {
    pub(crate) const fn begin(&mut self, end_ns: u64) {
        self.until_ns = Some(end_ns);
    }

    pub(crate) const fn is_on(&self) -> bool {
        self.until_ns.is_some()
    }

    /// Ends it when its time is over; true once, when it is.
    pub(crate) fn ends(&mut self, now_ns: u64) -> bool {
        let ends = self.until_ns.is_some_and(|end_ns| end_ns <= now_ns);
        if ends {
            self.until_ns = None;
        }
        ends
    }

    /// When it ends, ns.
    pub(crate) const fn end_ns(&self) -> Option<u64> {
        self.until_ns
    }
}
