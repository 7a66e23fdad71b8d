//! Whether a device is there. Of all that a session goes through, people are told when one is lost and when it is back.
//! Pure.

use tsukamu_devices::fault::Fault;
use tsukamu_devices::session::{SessionState, StateChange};

/// What is worth telling.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// It runs for the first time.
    Runs,
    /// It has not run yet, and this stands in the way.
    Waited {
        /// What is wrong, and what to do.
        reason: String,
    },
    /// It ran and is gone.
    Lost {
        /// What is wrong, and what to do.
        reason: String,
    },
    /// It was lost and runs again.
    Returned {
        /// Time since it was lost, seconds.
        absent_s: f64,
    },
}

/// What is known of one device.
#[derive(Clone, Debug, Default)]
pub struct Presence {
    /// Whether it has ever run.
    has_run: bool,
    /// Since when it is lost, monotonic nanoseconds.
    lost_ns: Option<u64>,
    /// What was told of a device that has not run yet.
    told: Option<Fault>,
}

impl Presence {
    /// Takes a change of its session's state.
    pub fn change(&mut self, change: &StateChange) -> Option<News> {
        match change.state {
            SessionState::Running => {
                self.told = None;
                if let Some(lost_ns) = self.lost_ns.take() {
                    let absent_s = change.stamp_ns.saturating_sub(lost_ns) as f64 * 1.0e-9;
                    return Some(News::Returned { absent_s });
                }
                let is_first = !std::mem::replace(&mut self.has_run, true);
                is_first.then_some(News::Runs)
            }
            SessionState::Absent if !self.has_run => self.wait(change.fault.as_ref()?),
            SessionState::Absent if self.lost_ns.is_none() => {
                self.lost_ns = Some(change.stamp_ns);
                let reason = change
                    .fault
                    .as_ref()
                    .map_or_else(String::new, Fault::to_string);
                Some(News::Lost { reason })
            }
            _ => None,
        }
    }

    /// A device that has not run yet is told of once for each thing that is wrong.
    fn wait(&mut self, fault: &Fault) -> Option<News> {
        let kind = std::mem::discriminant(fault);
        let is_known = self
            .told
            .as_ref()
            .is_some_and(|told| std::mem::discriminant(told) == kind);
        if is_known {
            return None;
        }
        self.told = Some(fault.clone());
        Some(News::Waited {
            reason: fault.to_string(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    fn change(second: u64, state: SessionState, fault: Option<Fault>) -> StateChange {
        StateChange {
            stamp_ns: second * S,
            state,
            fault,
        }
    }

    #[test]
    fn one_loss_and_one_return_whatever_happens_between() {
        let path = || "/dev/glove".to_owned();
        let mut presence = Presence::default();
        let mut tell = |second, state, fault| presence.change(&change(second, state, fault));
        let missing = || Some(Fault::Missing { path: path() });
        assert_eq!(tell(0, SessionState::Opening, None), None);
        let reason = missing().map(|fault| fault.to_string());
        let waited = reason.map(|reason| News::Waited { reason });
        assert_eq!(tell(0, SessionState::Absent, missing()), waited);
        assert_eq!(tell(1, SessionState::Absent, missing()), None, "known");
        assert_eq!(tell(2, SessionState::Resetting, None), None);
        assert_eq!(tell(2, SessionState::Running, None), Some(News::Runs));
        for round in 1..4 {
            let start = 100 * round;
            let unplugged = Fault::Unplugged { path: path() };
            let reason = unplugged.to_string();
            let lost = tell(start, SessionState::Absent, Some(unplugged));
            assert_eq!(lost, Some(News::Lost { reason }));
            let denied = Some(Fault::PermissionDenied { path: path() });
            for (second, state, fault) in [
                (start + 1, SessionState::Absent, missing()),
                (start + 2, SessionState::Absent, denied),
                (start + 3, SessionState::Resetting, None),
                (start + 4, SessionState::Querying, None),
                (start + 5, SessionState::Absent, missing()),
                (start + 6, SessionState::Querying, None),
            ] {
                assert_eq!(tell(second, state, fault), None);
            }
            let absent_s = 7.0;
            let back = tell(start + 7, SessionState::Running, None);
            assert_eq!(back, Some(News::Returned { absent_s }));
            assert_eq!(tell(start + 8, SessionState::Stalled, None), None);
            assert_eq!(tell(start + 9, SessionState::Running, None), None);
        }
    }
}
