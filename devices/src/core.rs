//! What every session keeps: its state, its counters and its queues, all of them bounded.

use std::collections::VecDeque;

use crate::fault::Fault;
use crate::session::{DeviceEvent, PortRequest, SessionState, SessionStats, StateChange};

/// Events kept for a caller that does not take them; about 4 s of a fast device.
const MAX_EVENTS: usize = 1024;
/// Commands kept for a caller that does not send them; a start-up needs about 20.
const MAX_TRANSMITS: usize = 64;

/// State, counters and bounded queues of a session.
#[derive(Debug)]
pub struct Core {
    pub(crate) state: SessionState,
    pub(crate) fault: Option<Fault>,
    pub(crate) stats: SessionStats,
    pub(crate) requests: VecDeque<PortRequest>,
    events: VecDeque<DeviceEvent>,
    transmits: VecDeque<Vec<u8>>,
}

impl Core {
    pub(crate) fn new() -> Self {
        Self {
            state: SessionState::Absent,
            fault: None,
            stats: SessionStats::default(),
            requests: VecDeque::new(),
            events: VecDeque::new(),
            transmits: VecDeque::new(),
        }
    }

    /// Sets state and fault, and reports them if either is new.
    pub(crate) fn enter(&mut self, stamp_ns: u64, state: SessionState, fault: Option<Fault>) {
        if self.state == state && self.fault == fault {
            return;
        }
        self.state = state;
        self.fault.clone_from(&fault);
        self.emit(DeviceEvent::State(StateChange {
            stamp_ns,
            state,
            fault,
        }));
    }

    /// Of a full queue the oldest reading goes: a caller that misses a state would believe the one before for ever.
    pub(crate) fn emit(&mut self, event: DeviceEvent) {
        if self.events.len() == MAX_EVENTS {
            let is_reading = |event: &DeviceEvent| {
                matches!(event, DeviceEvent::Glove(_) | DeviceEvent::Tracker(_))
            };
            let oldest = self.events.iter().position(is_reading).unwrap_or(0);
            self.events.remove(oldest);
            self.stats.dropped_events += 1;
        }
        self.events.push_back(event);
    }

    pub(crate) fn next_event(&mut self) -> Option<DeviceEvent> {
        self.events.pop_front()
    }

    pub(crate) fn send(&mut self, bytes: impl Into<Vec<u8>>) {
        if self.transmits.len() == MAX_TRANSMITS {
            self.transmits.pop_front();
        }
        self.transmits.push_back(bytes.into());
    }

    pub(crate) fn next_transmit(&mut self) -> Option<Vec<u8>> {
        self.transmits.pop_front()
    }

    /// Asks the owner of the port, unless the same request still waits.
    pub(crate) fn request(&mut self, request: PortRequest) {
        if !self.requests.contains(&request) {
            self.requests.push_back(request);
        }
    }

    /// Forgets what was meant for a port that is no longer open.
    pub(crate) fn forget_port(&mut self) {
        self.transmits.clear();
        self.requests.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::{Core, MAX_EVENTS};
    use crate::reading::GloveReading;
    use crate::session::{DeviceEvent, SessionState, StateChange};

    #[test]
    fn a_state_outlives_the_readings_behind_it() {
        let mut core = Core::new();
        core.enter(1, SessionState::Running, None);
        for sequence in 0..2 * MAX_EVENTS as u64 {
            core.emit(DeviceEvent::Glove(GloveReading::empty(2, sequence)));
        }
        let first = core.next_event();
        let running = StateChange {
            stamp_ns: 1,
            state: SessionState::Running,
            fault: None,
        };
        assert_eq!(first, Some(DeviceEvent::State(running)));
        let rest: Vec<DeviceEvent> = std::iter::from_fn(|| core.next_event()).collect();
        assert_eq!(rest.len(), MAX_EVENTS - 1);
        let newest = GloveReading::empty(2, 2 * MAX_EVENTS as u64 - 1);
        assert_eq!(rest.last(), Some(&DeviceEvent::Glove(newest)));
        assert_eq!(core.stats.dropped_events, MAX_EVENTS as u64 + 1);
    }

    #[test]
    fn states_alone_are_bounded_too() {
        let mut core = Core::new();
        for round in 0..3 * MAX_EVENTS as u64 {
            let states = [SessionState::Stalled, SessionState::Resetting];
            core.enter(round, states[round as usize % 2], None);
        }
        let all: Vec<DeviceEvent> = std::iter::from_fn(|| core.next_event()).collect();
        assert_eq!(all.len(), MAX_EVENTS);
        let is_newest = |event: &DeviceEvent| matches!(event, DeviceEvent::State(change) if change.state == core.state);
        assert!(all.last().is_some_and(is_newest));
    }
}
