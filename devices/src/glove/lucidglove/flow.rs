//! One line back for each line of the glove.
//!
//! A firmware with force feedback sends a line and then waits up to a second for one of ours: a host that is silent
//! makes it send one sample in a second. A host that says more than it hears fills the glove's buffer instead, and
//! every later command waits behind what is in it. So each line is answered by exactly one; where a line or its answer
//! is lost, a silence of a few lines' time is broken by one more, and where that proves to have been one too many,
//! a later answer is left out.

/// Silence after which the glove is given a line unasked, ns; doubled as long as it lasts. The longest lines take 25 ms.
const NUDGE_NS: u64 = 40_000_000;
/// Longest time between such lines, ns.
const NUDGE_MAX_NS: u64 = 400_000_000;
/// Lines beyond those heard that are kept account of, and lines that are answered at once; a glove's buffer holds
/// hardly more.
const AHEAD_MAX: u32 = 64;

/// How many lines are owed to the glove.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flow {
    /// Lines heard and not answered yet.
    due: u32,
    /// Lines sent that may have been too many.
    ahead: u32,
    /// Whether the last answer was left out.
    skipped: bool,
    nudge_ns: u64,
    wait_ns: u64,
}

impl Flow {
    pub(super) const fn new() -> Self {
        Self {
            due: 0,
            ahead: 0,
            skipped: false,
            nudge_ns: 0,
            wait_ns: NUDGE_NS,
        }
    }

    /// A port was opened: nothing is owed, and the glove may be waiting.
    pub(super) const fn open(&mut self, now_ns: u64) {
        *self = Self::new();
        self.nudge_ns = now_ns;
    }

    pub(super) const fn heard(&mut self, now_ns: u64) {
        self.due = self.due.saturating_add(1);
        self.wait_ns = NUDGE_NS;
        self.nudge_ns = now_ns + NUDGE_NS;
    }

    /// How many lines to send now.
    pub(super) const fn take_due(&mut self) -> u32 {
        let due = if self.due < AHEAD_MAX {
            self.due
        } else {
            AHEAD_MAX
        };
        self.due = 0;
        if due == 0 {
            return 0;
        }
        self.skipped = self.ahead > 0;
        if self.skipped {
            self.ahead -= 1;
            return due - 1;
        }
        due
    }

    /// So many lines were sent beyond what was due.
    pub(super) fn note_extra(&mut self, n_lines: u32) {
        self.ahead = (self.ahead + n_lines).min(AHEAD_MAX);
    }

    /// When a line is to be sent unasked, ns.
    pub(super) const fn deadline_ns(&self) -> u64 {
        self.nudge_ns
    }

    /// Whether a line is to be sent unasked now.
    pub(super) fn nudges(&mut self, now_ns: u64) -> bool {
        if now_ns < self.nudge_ns {
            return false;
        }
        if self.skipped {
            // The answer that was left out was awaited after all.
            self.skipped = false;
        } else {
            self.note_extra(1);
        }
        self.nudge_ns = now_ns + self.wait_ns;
        self.wait_ns = (2 * self.wait_ns).min(NUDGE_MAX_NS);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::{Flow, NUDGE_NS};

    #[test]
    fn a_lost_answer_costs_two_nudges_and_no_line_stays_ahead() {
        let mut flow = Flow::new();
        flow.open(0);
        assert!(flow.nudges(0), "the glove may be waiting");
        flow.heard(1);
        assert_eq!(flow.take_due(), 0, "the nudge was one too many");
        assert!(!flow.nudges(1));
        assert!(flow.nudges(1 + NUDGE_NS), "or it was not");
        for time in 2..5 {
            flow.heard(time * NUDGE_NS);
            assert_eq!(flow.take_due(), 1);
        }
        // Three lines at once after a silence that only the line itself made.
        assert!(flow.nudges(6 * NUDGE_NS));
        for _ in 0..3 {
            flow.heard(7 * NUDGE_NS);
        }
        assert_eq!(flow.take_due(), 2);
        flow.heard(7 * NUDGE_NS);
        assert_eq!(flow.take_due(), 1);
    }
}
