//! Joins a session to a serial port until it is told to stop. The only file that names `serialport`.

use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::FileTypeExt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serialport::{SerialPort, TTYPort};

use crate::clock::Clock;
use crate::fault::Fault;
use crate::port_thread::SessionHandle;
use crate::session::{DeviceEvent, PortRequest, Session, SessionState, SessionStats};

/// First wait before a lost port is opened again; doubled at each failure.
pub const REOPEN_MIN: Duration = Duration::from_millis(100);
/// Longest wait before a lost port is opened again. It is cut short when a path that was missing appears.
pub const REOPEN_MAX: Duration = Duration::from_millis(500);
/// Reads that a backlog may take before what they brought is handed on; a terminal holds some 70 kB at most.
const READS_MAX: usize = 80;
/// Longest that a stop request goes unnoticed, and time between two looks for a path that is missing.
const STOP_LATENCY: Duration = Duration::from_millis(50);
/// Longest that a command may take to be written; it is dropped then, and the session's own deadline acts.
const WRITE_TIMEOUT: Duration = Duration::from_millis(200);
/// How often the counters are handed out.
const STATS_PERIOD: Duration = Duration::from_secs(1);

/// Where a device is and how its line is set; always 8 data bits, no parity, 1 stop bit, no flow control.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PortSettings {
    /// Path of the port, or of a link to it such as those in `/dev/serial/by-id`.
    pub path: String,
    /// Line rates in bit/s; when nothing answers at one, the next is tried. Empty means 115200.
    pub bauds: Vec<u32>,
    /// Whether [`PortEvent::Raw`] is delivered too.
    pub raw: bool,
}

/// Which way bytes went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From the device.
    Received,
    /// To the device.
    Sent,
}

/// What the thread of a port delivers.
#[expect(
    clippy::large_enum_variant,
    reason = "a box would cost an allocation for each of some hundred readings in a second"
)]
#[derive(Debug, Clone, PartialEq)]
pub enum PortEvent<'a> {
    /// A reading, or a change of the device's state.
    Device(DeviceEvent),
    /// The counters: once a second while the port is open, and at each change of state.
    Stats(SessionStats),
    /// Bytes as they went over the line, for a recording.
    Raw {
        /// Monotonic time at which they were read or written, ns.
        stamp_ns: u64,
        /// Which way they went.
        direction: Direction,
        /// The bytes.
        bytes: &'a [u8],
    },
}

enum End {
    Stopped,
    Lost(Fault),
    NextBaud,
}

/// Opens the port, serves the session, and opens it again whenever it goes, until `stop` is set.
///
/// `deliver` is called on this thread and must not wait: the caller decides what happens when its reader is slow
/// (newest-wins for readings). Readings arrive in order.
pub fn run_port(
    settings: &PortSettings,
    session: &mut dyn Session,
    outside: &SessionHandle,
    stop: &AtomicBool,
    clock: Clock,
    deliver: &mut dyn FnMut(PortEvent<'_>),
) {
    let bauds: &[u32] = match settings.bauds.as_slice() {
        [] => &[115_200],
        bauds => bauds,
    };
    let mut tries = bauds.iter().cycle();
    let mut baud = *tries.next().unwrap_or(&115_200);
    let mut wait = REOPEN_MIN;
    session.port_opening(clock.now_ns());
    while !stop.load(Ordering::Acquire) {
        hand_out(session, deliver);
        match open(&settings.path, baud) {
            Err(fault) => session.port_lost(clock.now_ns(), fault),
            Ok(mut port) => {
                session.port_opened(clock.now_ns());
                let mut line = Line {
                    port: &mut port,
                    settings,
                    clock,
                    baud,
                    ran: false,
                };
                let end = line.serve(session, outside, stop, deliver);
                if line.ran {
                    wait = REOPEN_MIN;
                }
                match end {
                    End::Stopped => break,
                    End::Lost(fault) => session.port_lost(clock.now_ns(), fault),
                    End::NextBaud => {
                        baud = *tries.next().unwrap_or(&baud);
                        let fault = session
                            .fault()
                            .cloned()
                            .unwrap_or_else(|| unplugged(settings));
                        session.port_lost(clock.now_ns(), fault);
                    }
                }
            }
        }
        hand_out(session, deliver);
        wait = match pause(wait, &settings.path, stop) {
            // Its rights may be set a moment later: try quickly again.
            Pause::Appeared => REOPEN_MIN,
            Pause::Over => (wait * 2).min(REOPEN_MAX),
        };
    }
    hand_out(session, deliver);
    deliver(PortEvent::Stats(session.stats()));
}

fn hand_out(session: &mut dyn Session, deliver: &mut dyn FnMut(PortEvent<'_>)) {
    while let Some(event) = session.next_event() {
        let changed = matches!(event, DeviceEvent::State(_));
        deliver(PortEvent::Device(event));
        if changed {
            deliver(PortEvent::Stats(session.stats()));
        }
    }
}

enum Pause {
    Over,
    /// The path was missing and is there.
    Appeared,
}

/// Waits, and looks now and then whether a path that is missing appears: a look costs some microseconds.
fn pause(wait: Duration, path: &str, stop: &AtomicBool) -> Pause {
    let end = Instant::now() + wait;
    let mut was_missing = false;
    while !stop.load(Ordering::Acquire) {
        let is_there = std::fs::metadata(path).is_ok();
        if was_missing && is_there {
            return Pause::Appeared;
        }
        // A port that is just going may still have its name: that is no appearance.
        was_missing = !is_there;
        let rest = end.saturating_duration_since(Instant::now());
        if rest.is_zero() {
            break;
        }
        std::thread::park_timeout(rest.min(STOP_LATENCY));
    }
    Pause::Over
}

struct Line<'a> {
    port: &'a mut TTYPort,
    settings: &'a PortSettings,
    clock: Clock,
    baud: u32,
    /// Whether records have arrived since the port was opened.
    ran: bool,
}

impl Line<'_> {
    fn serve(
        &mut self,
        session: &mut dyn Session,
        outside: &SessionHandle,
        stop: &AtomicBool,
        deliver: &mut dyn FnMut(PortEvent<'_>),
    ) -> End {
        let mut bytes = [0; 1024];
        let mut stats_ns = self.clock.now_ns();
        loop {
            if stop.load(Ordering::Acquire) {
                // The device may be gone already, and nothing more can be done for it.
                let _ = self.send(session.farewell(), deliver);
                return End::Stopped;
            }
            outside.tell(self.clock.now_ns(), session);
            if let Some(end) = self.obey(session, deliver) {
                return end;
            }
            if let Err(fault) = self.take(session, &mut bytes, deliver) {
                return End::Lost(fault);
            }
            session.handle_timeout(self.clock.now_ns());
            self.ran |= session.state() == SessionState::Running;
            hand_out(session, deliver);
            if self.clock.now_ns() >= stats_ns + STATS_PERIOD.as_nanos() as u64 {
                stats_ns = self.clock.now_ns();
                deliver(PortEvent::Stats(session.stats()));
            }
        }
    }

    /// Reads what is there, all of it: a backlog goes to the session in one go, so that nothing old is handed on while
    /// something newer waits.
    fn take(
        &mut self,
        session: &mut dyn Session,
        bytes: &mut [u8],
        deliver: &mut dyn FnMut(PortEvent<'_>),
    ) -> Result<(), Fault> {
        let mut deadline_ns = session.deadline();
        for _ in 0..READS_MAX {
            let size = bytes.len();
            let received = match self.read(deadline_ns, bytes) {
                Ok(received) => received,
                Err(None) => return Ok(()),
                Err(Some(fault)) => return Err(fault),
            };
            let stamp_ns = self.clock.now_ns();
            self.tell(stamp_ns, Direction::Received, received, deliver);
            session.push(stamp_ns, received);
            if received.len() < size {
                return Ok(());
            }
            // More may wait; nothing else is waited for.
            deadline_ns = Some(0);
        }
        Ok(())
    }

    /// Sends what the session wants to send, and does what it asks for.
    fn obey(
        &mut self,
        session: &mut dyn Session,
        deliver: &mut dyn FnMut(PortEvent<'_>),
    ) -> Option<End> {
        while let Some(request) = session.poll_port_request() {
            match request {
                PortRequest::Reopen => return Some(End::NextBaud),
                PortRequest::ReapplySettings => {
                    if let Err(error) = self.port.set_baud_rate(self.baud) {
                        return Some(End::Lost(fault_from_open(&self.settings.path, &error)));
                    }
                }
                PortRequest::SetRts(raised) => {
                    // ENOTTY of a pseudo-terminal; a port that has gone shows it at the next read.
                    let _ = self.port.write_request_to_send(raised);
                }
            }
        }
        while let Some(command) = session.poll_transmit() {
            if let Err(fault) = self.send(&command, deliver) {
                return Some(End::Lost(fault));
            }
        }
        None
    }

    fn send(
        &mut self,
        command: &[u8],
        deliver: &mut dyn FnMut(PortEvent<'_>),
    ) -> Result<(), Fault> {
        // Setting a time-out only stores it, and cannot fail.
        let _ = self.port.set_timeout(WRITE_TIMEOUT);
        match self.port.write_all(command) {
            Ok(()) => {
                self.tell(self.clock.now_ns(), Direction::Sent, command, deliver);
                Ok(())
            }
            Err(error) if passing(error.kind()) => Ok(()),
            Err(_) => Err(unplugged(self.settings)),
        }
    }

    /// Bytes; or nothing in time, or why the port is gone.
    fn read<'b>(
        &mut self,
        deadline_ns: Option<u64>,
        bytes: &'b mut [u8],
    ) -> Result<&'b [u8], Option<Fault>> {
        let rest = deadline_ns.map_or(STOP_LATENCY, |deadline_ns| {
            Duration::from_nanos(deadline_ns.saturating_sub(self.clock.now_ns()))
        });
        let _ = self.port.set_timeout(rest.min(STOP_LATENCY));
        match self.port.read(bytes) {
            // With this crate no data is a time-out, so 0 is the hang-up of the other side.
            Ok(0) => Err(Some(unplugged(self.settings))),
            Ok(n_bytes) => Ok(&bytes[..n_bytes]),
            Err(error) if passing(error.kind()) => Err(None),
            // EIO, EPIPE, ENODEV and ENXIO are all the same event.
            Err(_) => Err(Some(unplugged(self.settings))),
        }
    }

    fn tell(
        &self,
        stamp_ns: u64,
        direction: Direction,
        bytes: &[u8],
        deliver: &mut dyn FnMut(PortEvent<'_>),
    ) {
        if self.settings.raw {
            deliver(PortEvent::Raw {
                stamp_ns,
                direction,
                bytes,
            });
        }
    }
}

const fn passing(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock
    )
}

fn unplugged(settings: &PortSettings) -> Fault {
    Fault::Unplugged {
        path: settings.path.clone(),
    }
}

fn open(path: &str, baud: u32) -> Result<TTYPort, Fault> {
    // Asked first, because opening a file or a pipe as a terminal gives errors that name nothing.
    match std::fs::metadata(path) {
        Ok(metadata) if !metadata.file_type().is_char_device() => {
            return Err(Fault::NotSerial {
                path: path.to_owned(),
            });
        }
        Err(error) if error.kind() == ErrorKind::NotFound => {
            return Err(Fault::Missing {
                path: path.to_owned(),
            });
        }
        // What else is wrong shows in opening it.
        Ok(_) | Err(_) => {}
    }
    serialport::new(path, baud)
        .timeout(STOP_LATENCY)
        .open_native()
        .map_err(|error| fault_from_open(path, &error))
}

fn fault_from_open(path: &str, error: &serialport::Error) -> Fault {
    let path = path.to_owned();
    let text = error.to_string();
    match error.kind() {
        serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => Fault::PermissionDenied { path },
        serialport::ErrorKind::Io(ErrorKind::NotFound) => Fault::Missing { path },
        // EBUSY of the exclusive open, or the lock of another opener.
        serialport::ErrorKind::NoDevice => Fault::Busy { path },
        // These have no kind of their own there: ENODEV, ENXIO and the EIO of a port that is just going.
        _ if text.contains("No such device") || text.contains("I/O error") => {
            Fault::Missing { path }
        }
        _ if text.contains("Inappropriate ioctl") || text.contains("Not a typewriter") => {
            Fault::NotSerial { path }
        }
        _ => Fault::Port { path, detail: text },
    }
}

#[cfg(test)]
mod tests {
    use std::io::ErrorKind::{NotFound, PermissionDenied, WouldBlock};

    use serialport::{Error, ErrorKind};

    use super::fault_from_open;
    use crate::fault::Fault;

    #[test]
    fn each_refusal_has_its_name() {
        let path = || "/dev/ttyX".to_owned();
        let cases = [
            (
                ErrorKind::Io(PermissionDenied),
                "",
                Fault::PermissionDenied { path: path() },
            ),
            (ErrorKind::Io(NotFound), "", Fault::Missing { path: path() }),
            (
                ErrorKind::NoDevice,
                "Device or resource busy",
                Fault::Busy { path: path() },
            ),
            (
                ErrorKind::Unknown,
                "No such device or address",
                Fault::Missing { path: path() },
            ),
            (
                ErrorKind::Unknown,
                "Inappropriate ioctl for device",
                Fault::NotSerial { path: path() },
            ),
            (
                ErrorKind::Io(WouldBlock),
                "odd",
                Fault::Port {
                    path: path(),
                    detail: "odd".to_owned(),
                },
            ),
        ];
        for (kind, text, expected) in cases {
            assert_eq!(
                fault_from_open("/dev/ttyX", &Error::new(kind, text)),
                expected
            );
        }
    }
}
