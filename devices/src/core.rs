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

    pub(crate) fn emit(&mut self, event: DeviceEvent) {
        if self.events.len() == MAX_EVENTS {
            self.events.pop_front();
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
