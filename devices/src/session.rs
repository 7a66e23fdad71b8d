//! The shape of every driver: a state machine that never touches a port or a clock.
//!
//! The caller pushes bytes with the time of their arrival, asks for events, sends what [`Session::poll_transmit`]
//! hands out, and calls [`Session::handle_timeout`] when [`Session::deadline`] has passed. All times are monotonic
//! nanoseconds from one origin of the caller's choice.

use std::net::Ipv4Addr;

use crate::core::Core;
use crate::fault::Fault;
use crate::feedback::Feedback;
use crate::glove::calibrate::{GloveCalibration, Handedness};
use crate::reading::{GloveReading, TrackerReading};

/// Where a device is between "not there" and "sending".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionState {
    /// The port is not there or is not open.
    Absent,
    /// The port is being opened for the first time.
    Opening,
    /// The device is being brought to a known state, and what it sent before is thrown away.
    Resetting,
    /// The device is being asked what it is, and is given its settings.
    Querying,
    /// Records arrive.
    Running,
    /// Records stopped or no longer decode; recovery is under way.
    Stalled,
}

/// A change of [`SessionState`], or of the fault that goes with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StateChange {
    /// Monotonic time of the change, ns.
    pub stamp_ns: u64,
    /// The state from now on.
    pub state: SessionState,
    /// What is wrong, if anything is.
    pub fault: Option<Fault>,
}

/// What a device said about itself.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceInfo {
    /// Device family, such as `CyberGlove`.
    pub family: &'static str,
    /// Firmware version in the device's own form; empty when it did not say.
    pub firmware: String,
    /// The device's own name or configuration text; empty when it has none.
    pub identity: String,
    /// Number of bend sensors of a glove, or of the stations asked for of a tracker.
    pub n_sensors: usize,
    /// Which hand a glove is made for; `None` for a tracker, or when the glove did not say.
    pub hand: Option<Handedness>,
    /// Nominal length of one tick of the device's own counter, ns; `None` when it has none or its unit is not known.
    pub tick_ns: Option<f64>,
    /// Samples per second that it says it sends, all its stations together; `None` where it does not say.
    pub rate_hz: Option<f64>,
}

/// What a session hands out.
#[expect(
    clippy::large_enum_variant,
    reason = "a box would cost an allocation for each of some hundred readings in a second"
)]
#[derive(Debug, Clone, PartialEq)]
pub enum DeviceEvent {
    /// A sample of a glove.
    Glove(GloveReading),
    /// A record of a tracker station.
    Tracker(TrackerReading),
    /// The state or the fault changed.
    State(StateChange),
    /// The device answered the questions of the start-up.
    Identified(DeviceInfo),
}

/// Counters since the session was made; they never go back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SessionStats {
    /// Bytes received.
    pub bytes: u64,
    /// Good records.
    pub records: u64,
    /// Times that the decoder lost step and looked for the next record.
    pub resyncs: u64,
    /// Records thrown away because a check failed.
    pub dropped_records: u64,
    /// Times that the device was asked to stop and start again, or the port was opened again.
    pub restarts: u64,
    /// Error codes that the device reported.
    pub device_errors: u64,
    /// Events that the caller did not take in time.
    pub dropped_events: u64,
}

/// What a session asks of the owner of its port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PortRequest {
    /// Apply the line settings again; one kind of glove has been seen to revive at this.
    ReapplySettings,
    /// Close the port, wait, and open it again, at the next baud rate if there are several.
    Reopen,
    /// Raise or lower the line RTS, which holds some devices in reset; a pseudo-terminal has none, and that is no fault.
    SetRts(bool),
}

/// What a network connection has beside its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LinkAbout {
    /// Unix time at the origin of the monotonic stamps, ns, for protocols that write the time into what they send.
    pub unix_origin_ns: u64,
    /// Own address and port at which datagrams are read; `None` when none are.
    pub datagrams_at: Option<(Ipv4Addr, u16)>,
}

/// A driver as a state machine: bytes in, events out, time as an argument.
pub trait Session {
    /// What every session keeps: state, counters, queues.
    fn core(&self) -> &Core;

    /// The same, to be changed.
    fn core_mut(&mut self) -> &mut Core;

    /// The port is about to be opened for the first time.
    fn port_opening(&mut self, now_ns: u64) {
        self.core_mut().enter(now_ns, SessionState::Opening, None);
    }

    /// The port is open; the start-up begins.
    fn port_opened(&mut self, now_ns: u64);

    /// The port could not be opened, or has gone.
    fn port_lost(&mut self, now_ns: u64, fault: Fault);

    /// Takes bytes that were read at `stamp_ns`.
    fn push(&mut self, stamp_ns: u64, bytes: &[u8]);

    /// Takes a datagram that was read at `stamp_ns` beside the bytes of a connection.
    fn push_datagram(&mut self, stamp_ns: u64, datagram: &[u8]) {
        self.push(stamp_ns, datagram);
    }

    /// Tells what a connection that is about to be opened has beside its bytes; a session without use for it ignores it.
    fn link_opening(&mut self, _link: LinkAbout) {}

    /// The next event, oldest first. Beyond a fixed number the oldest are dropped and counted.
    fn next_event(&mut self) -> Option<DeviceEvent> {
        self.core_mut().next_event()
    }

    /// When [`Session::handle_timeout`] is due, ns; `None` while nothing is awaited.
    fn deadline(&self) -> Option<u64>;

    /// Does what is due at `now_ns`; nothing if it is too early.
    fn handle_timeout(&mut self, now_ns: u64);

    /// The next bytes to send to the device.
    fn poll_transmit(&mut self) -> Option<Vec<u8>> {
        self.core_mut().next_transmit()
    }

    /// The next request to the owner of the port.
    fn poll_port_request(&mut self) -> Option<PortRequest> {
        self.core_mut().requests.pop_front()
    }

    /// The bytes that make the device quiet, to be sent before an orderly close.
    fn farewell(&self) -> &'static [u8] {
        &[]
    }

    /// Takes over a wearer's calibration from the next record on. A device without a glove's sensors ignores it.
    fn set_calibration(&mut self, _calibration: GloveCalibration) {}

    /// Asks for forces or vibration; the newest request stands. A device that cannot give any ignores it.
    fn set_feedback(&mut self, _now_ns: u64, _feedback: Feedback) {}

    /// The present state.
    fn state(&self) -> SessionState {
        self.core().state
    }

    /// What is wrong at present, if anything is.
    fn fault(&self) -> Option<&Fault> {
        self.core().fault.as_ref()
    }

    /// The counters.
    fn stats(&self) -> SessionStats {
        self.core().stats
    }
}
