//! What the tick thread shows of its own life, for those who must not take its word for it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Counts of what the tick thread alone does. It never waits for whoever reads them.
#[derive(Debug, Default)]
pub struct Pulse {
    /// Deadlines that were met with a step, and starts of the clock.
    steps: AtomicU64,
    /// Requests that were answered, and steps that were asked for.
    answers: AtomicU64,
    /// Whether steps are due by the clock: neither paused nor in lockstep.
    is_timed: AtomicBool,
}

impl Pulse {
    /// A step came due, and the thread was there.
    pub(super) fn note_step(&self) {
        self.steps.fetch_add(1, Ordering::Relaxed);
    }

    /// The thread did what it was asked for.
    pub(super) fn note_answer(&self) {
        self.answers.fetch_add(1, Ordering::Relaxed);
    }

    /// The clock was started, or stopped.
    pub(super) fn set_timed(&self, is_timed: bool) {
        self.is_timed.store(is_timed, Ordering::Relaxed);
        // A clock that has just been started has had no time for a step.
        self.note_step();
    }
}

/// Looks at a [`Pulse`] from time to time.
#[derive(Debug)]
pub struct Heartbeat {
    pulse: Arc<Pulse>,
    /// Steps and answers when it was last found to beat.
    seen: (u64, u64),
}

impl Heartbeat {
    /// Counts from now on.
    pub fn new(pulse: Arc<Pulse>) -> Self {
        let seen = now(&pulse);
        Self { pulse, seen }
    }

    /// Whether the thread has done, since this last was true, what shows that it lives: a step while the clock runs, an
    /// answer while it is paused or in lockstep. An answer alone is no sign of a clock that runs.
    pub fn has_beaten(&mut self) -> bool {
        let (steps, answers) = now(&self.pulse);
        let beats = if self.pulse.is_timed.load(Ordering::Relaxed) {
            steps != self.seen.0
        } else {
            answers != self.seen.1
        };
        if beats {
            self.seen = (steps, answers);
        }
        beats
    }
}

fn now(pulse: &Pulse) -> (u64, u64) {
    (
        pulse.steps.load(Ordering::Relaxed),
        pulse.answers.load(Ordering::Relaxed),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_runs_is_judged_by_its_steps_and_one_that_stands_by_its_answers() {
        let pulse = Arc::new(Pulse::default());
        let mut heart = Heartbeat::new(Arc::clone(&pulse));
        assert!(!heart.has_beaten(), "in lockstep, and nothing was asked");
        pulse.note_answer();
        assert!(heart.has_beaten());
        assert!(!heart.has_beaten(), "each sign counts once");
        pulse.set_timed(true);
        assert!(heart.has_beaten(), "the clock was started");
        pulse.note_answer();
        assert!(!heart.has_beaten(), "it answers and does not step");
        pulse.note_step();
        assert!(heart.has_beaten());
        pulse.set_timed(false);
        assert!(!heart.has_beaten(), "paused, and nothing was asked");
        pulse.note_answer();
        assert!(heart.has_beaten());
    }
}
