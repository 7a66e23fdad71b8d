//! A session and an emulator joined in memory, with time advanced by hand.

use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::line_fault::Noise;
use tsukamu_devices::reading::{GloveReading, TrackerReading};
use tsukamu_devices::session::{DeviceEvent, PortRequest, Session, SessionState};

pub(crate) const MS: u64 = 1_000_000;
pub(crate) const S: u64 = 1_000 * MS;

/// The bytes of a text like `47 01 4C`.
pub(crate) fn bytes(hex: &str) -> Vec<u8> {
    hex.split_whitespace()
        .map(|byte| u8::from_str_radix(byte, 16).unwrap())
        .collect()
}

/// Loses about one byte in `one_in`, the same ones at each run.
#[derive(Debug)]
pub(crate) struct Loss {
    one_in: u64,
    seed: u64,
}

impl Loss {
    pub(crate) fn one_in(one_in: u64) -> Self {
        Self {
            one_in,
            seed: 0x9E37_79B9_7F4A_7C15,
        }
    }

    fn keep(&mut self) -> bool {
        // xorshift64 (Marsaglia 2003).
        self.seed ^= self.seed << 13;
        self.seed ^= self.seed >> 7;
        self.seed ^= self.seed << 17;
        !self.seed.is_multiple_of(self.one_in)
    }
}

/// Both ends of a line, and everything that the session said.
pub(crate) struct Bench<S, E> {
    pub(crate) session: S,
    pub(crate) emulator: E,
    pub(crate) now_ns: u64,
    pub(crate) loss: Loss,
    pub(crate) noise: Noise,
    pub(crate) events: Vec<DeviceEvent>,
    pub(crate) requests: Vec<PortRequest>,
    pub(crate) sent: Vec<Vec<u8>>,
}

impl<Se: Session, E: Emulator> Bench<Se, E> {
    pub(crate) fn new(session: Se, emulator: E) -> Self {
        Self {
            session,
            emulator,
            now_ns: 0,
            loss: Loss::one_in(0),
            noise: Noise::new(0.0),
            events: Vec::new(),
            requests: Vec::new(),
            sent: Vec::new(),
        }
    }

    pub(crate) fn open(&mut self) {
        self.session.port_opening(self.now_ns);
        self.session.port_opened(self.now_ns);
    }

    /// Runs the line for a time, in steps of 1 ms. A request to open the port again is obeyed at once.
    pub(crate) fn run_for(&mut self, time_ns: u64) {
        let end_ns = self.now_ns + time_ns;
        while self.now_ns < end_ns {
            self.turn();
        }
    }

    /// Runs until the condition holds, for at most `limit_ns`; returns how long it took.
    pub(crate) fn run_until(&mut self, limit_ns: u64, done: impl Fn(&Self) -> bool) -> u64 {
        let start_ns = self.now_ns;
        while !done(self) {
            assert!(
                self.now_ns < start_ns + limit_ns,
                "not in {limit_ns} ns; last events: {:?}",
                &self.events[self.events.len().saturating_sub(5)..]
            );
            self.turn();
        }
        self.now_ns - start_ns
    }

    fn turn(&mut self) {
        self.now_ns += MS;
        self.session.handle_timeout(self.now_ns);
        while let Some(command) = self.session.poll_transmit() {
            self.emulator.push(self.now_ns, &command);
            self.sent.push(command);
        }
        while let Some(request) = self.session.poll_port_request() {
            self.requests.push(request);
            if request == PortRequest::Reopen {
                let fault = self.session.fault().cloned().unwrap();
                self.session.port_lost(self.now_ns, fault);
                self.session.port_opened(self.now_ns);
            }
        }
        let mut said = self.emulator.poll(self.now_ns);
        said.retain(|_| self.loss.keep());
        self.noise.spoil(&mut said);
        self.session.push(self.now_ns, &said);
        while let Some(event) = self.session.next_event() {
            self.events.push(event);
        }
    }

    pub(crate) fn states(&self) -> Vec<SessionState> {
        let mut states: Vec<SessionState> = self
            .events
            .iter()
            .filter_map(|event| match event {
                DeviceEvent::State(change) => Some(change.state),
                _ => None,
            })
            .collect();
        states.dedup();
        states
    }

    pub(crate) fn gloves(&self) -> Vec<GloveReading> {
        self.events
            .iter()
            .filter_map(|event| match event {
                DeviceEvent::Glove(reading) => Some(*reading),
                _ => None,
            })
            .collect()
    }

    pub(crate) fn trackers(&self) -> Vec<TrackerReading> {
        self.events
            .iter()
            .filter_map(|event| match event {
                DeviceEvent::Tracker(reading) => Some(*reading),
                _ => None,
            })
            .collect()
    }
}
