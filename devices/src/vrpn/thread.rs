//! Joins a [`VrpnSession`](super::session::VrpnSession) to its server on a thread of its own, until it is told to stop.

use std::io::{ErrorKind, Read, Write};
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;

use super::address::Address;
use super::inbound::Inbound;
use super::link::{Connecting, Link};
use crate::clock::Clock;
use crate::fault::Fault;
use crate::port::{Direction, PortEvent};
use crate::port_thread::{PortThread, SessionHandle};
use crate::session::{DeviceEvent, LinkAbout, PortRequest, Session, SessionState};

/// First wait before a lost server is tried again; doubled at each failure.
const AGAIN_MIN: Duration = Duration::from_millis(100);
/// Longest wait: a server that is back is to be heard within a second.
const AGAIN_MAX: Duration = Duration::from_millis(500);
/// Longest that a request to stop goes unnoticed.
const STOP_LATENCY: Duration = Duration::from_millis(50);
/// How often the counters are handed out, ns.
const STATS_PERIOD_NS: u64 = 1_000_000_000;
/// Most reads of one socket before anything else is looked at again.
const BURST: usize = 64;
/// Bytes that may wait for the server; a client says a few hundred in all.
const MAX_UNSENT: usize = 16 * 1024;

/// Starts the thread. `deliver` is called on it and must not wait. With `raw`, the bytes are delivered too.
///
/// # Errors
/// When the system refuses a thread.
pub fn spawn<F>(
    address: Address,
    session: Box<dyn Session + Send>,
    clock: Clock,
    raw: bool,
    deliver: F,
) -> std::io::Result<PortThread>
where
    F: FnMut(PortEvent<'_>) + Send + 'static,
{
    PortThread::start("vrpn client", move |outside, stop| {
        let (mut session, mut deliver) = (session, deliver);
        let since_unix = SystemTime::now().duration_since(UNIX_EPOCH);
        let unix_ns = since_unix.map_or(0, |time| time.as_nanos() as u64);
        Service {
            address,
            session: session.as_mut(),
            outside,
            stop,
            clock,
            unix_origin_ns: unix_ns.saturating_sub(clock.now_ns()),
            raw,
            deliver: &mut deliver,
            unsent: Vec::new(),
            ran: false,
        }
        .run();
    })
}

enum End {
    Stopped,
    Lost(Fault),
    /// The session asks for a new connection; the fault is its own.
    Again,
}

struct Service<'a> {
    address: Address,
    session: &'a mut dyn Session,
    outside: &'a SessionHandle,
    stop: &'a AtomicBool,
    clock: Clock,
    unix_origin_ns: u64,
    raw: bool,
    deliver: &'a mut dyn FnMut(PortEvent<'_>),
    unsent: Vec<u8>,
    /// Whether records have arrived on this connection.
    ran: bool,
}

impl Service<'_> {
    fn run(&mut self) {
        let mut connecting = Connecting::new(self.address.clone());
        let mut wait = AGAIN_MIN;
        self.session.port_opening(self.clock.now_ns());
        self.hand_out();
        while !self.stops() {
            let Some(result) = connecting.go_on(STOP_LATENCY) else {
                continue;
            };
            self.ran = false;
            match result.map_or_else(End::Lost, |link| self.serve(link)) {
                End::Stopped => break,
                End::Lost(fault) => self.session.port_lost(self.clock.now_ns(), fault),
                End::Again => {
                    let fault = self.session.fault().cloned();
                    let fault = fault.unwrap_or_else(|| self.disconnected());
                    self.session.port_lost(self.clock.now_ns(), fault);
                }
            }
            self.hand_out();
            wait = if self.ran {
                AGAIN_MIN
            } else {
                (wait * 2).min(AGAIN_MAX)
            };
            self.pause(wait);
        }
        self.hand_out();
        (self.deliver)(PortEvent::Stats(self.session.stats()));
    }

    fn stops(&self) -> bool {
        self.stop.load(Ordering::Acquire)
    }

    fn pause(&self, wait: Duration) {
        let end = Instant::now() + wait;
        while !self.stops() {
            let rest = end.saturating_duration_since(Instant::now());
            if rest.is_zero() {
                return;
            }
            std::thread::park_timeout(rest.min(STOP_LATENCY));
        }
    }

    fn hand_out(&mut self) {
        while let Some(event) = self.session.next_event() {
            let changed = matches!(event, DeviceEvent::State(_));
            (self.deliver)(PortEvent::Device(event));
            if changed {
                (self.deliver)(PortEvent::Stats(self.session.stats()));
            }
        }
    }

    fn disconnected(&self) -> Fault {
        Fault::Disconnected {
            place: self.address.to_string(),
        }
    }

    fn serve(&mut self, mut link: Link) -> End {
        let mut bytes = vec![0; Inbound::MAX_PUSH];
        let mut stats_ns = self.clock.now_ns();
        self.unsent.clear();
        self.session.link_opening(LinkAbout {
            unix_origin_ns: self.unix_origin_ns,
            datagrams_at: link.datagrams.as_ref().map(|(_, at)| *at),
        });
        self.session.port_opened(self.clock.now_ns());
        while !self.stops() {
            self.outside.tell(self.clock.now_ns(), self.session);
            if self.session.poll_port_request() == Some(PortRequest::Reopen) {
                return End::Again;
            }
            let is_sent = self.send(&mut link);
            self.wait(&link);
            let is_open = is_sent
                && self.receive(&mut link, &mut bytes)
                && self.receive_datagrams(&mut link, &mut bytes);
            if !is_open {
                // What the server said last may be why it closes.
                return match self.session.poll_port_request() {
                    Some(PortRequest::Reopen) => End::Again,
                    _ => End::Lost(self.disconnected()),
                };
            }
            self.session.handle_timeout(self.clock.now_ns());
            self.ran |= self.session.state() == SessionState::Running;
            self.hand_out();
            if self.clock.now_ns() >= stats_ns + STATS_PERIOD_NS {
                stats_ns = self.clock.now_ns();
                (self.deliver)(PortEvent::Stats(self.session.stats()));
            }
        }
        End::Stopped
    }

    /// Sends what waits, as far as it goes; false when the connection is gone.
    fn send(&mut self, link: &mut Link) -> bool {
        while let Some(command) = self.session.poll_transmit() {
            self.unsent.extend_from_slice(&command);
            self.tell(Direction::Sent, &command);
        }
        while !self.unsent.is_empty() {
            match link.stream.write(&self.unsent) {
                Ok(0) => return false,
                Ok(n_bytes) => drop(self.unsent.drain(..n_bytes)),
                Err(error) if is_passing(error.kind()) => break,
                Err(_) => return false,
            }
        }
        self.unsent.len() <= MAX_UNSENT
    }

    /// Waits for something to read, or until something is due.
    fn wait(&self, link: &Link) {
        let rest = self.session.deadline().map_or(STOP_LATENCY, |deadline_ns| {
            Duration::from_nanos(deadline_ns.saturating_sub(self.clock.now_ns()))
        });
        let rest = rest.min(STOP_LATENCY);
        match &link.datagrams {
            Some((socket, _)) => wait_for_input(&[&link.stream, socket], rest),
            None => wait_for_input(&[&link.stream], rest),
        }
    }

    /// Reads all there is, within reason; false when the connection is gone.
    fn receive(&mut self, link: &mut Link, bytes: &mut [u8]) -> bool {
        for _ in 0..BURST {
            match link.stream.read(bytes) {
                Ok(0) => return false,
                Ok(n_bytes) => {
                    let stamp_ns = self.clock.now_ns();
                    self.tell(Direction::Received, &bytes[..n_bytes]);
                    self.session.push(stamp_ns, &bytes[..n_bytes]);
                }
                Err(error) if is_passing(error.kind()) => return true,
                Err(_) => return false,
            }
        }
        true
    }

    /// The same of datagrams. Names come by TCP: before a datagram is looked into, what came with it is read there.
    fn receive_datagrams(&mut self, link: &mut Link, bytes: &mut [u8]) -> bool {
        let mut datagram = [0; Inbound::MAX_PUSH];
        for _ in 0..BURST {
            let Some((socket, _)) = &link.datagrams else {
                return true;
            };
            match socket.recv_from(&mut datagram) {
                Ok((n_bytes, from)) if from.ip() == link.server => {
                    if !self.receive(link, bytes) {
                        return false;
                    }
                    let stamp_ns = self.clock.now_ns();
                    self.tell(Direction::Received, &datagram[..n_bytes]);
                    self.session.push_datagram(stamp_ns, &datagram[..n_bytes]);
                }
                Ok(_) => {}
                // A datagram socket has no connection to lose.
                Err(_) => return true,
            }
        }
        true
    }

    fn tell(&mut self, direction: Direction, bytes: &[u8]) {
        if self.raw {
            (self.deliver)(PortEvent::Raw {
                stamp_ns: self.clock.now_ns(),
                direction,
                bytes,
            });
        }
    }
}

const fn is_passing(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// Waits until one of them can be read, or for that long. What is wrong with them shows in reading.
pub(super) fn wait_for_input(sources: &[&dyn AsFd], wait: Duration) {
    let mut fds: Vec<PollFd<'_>> = sources
        .iter()
        .map(|source| PollFd::new(source.as_fd(), PollFlags::POLLIN))
        .collect();
    let _ = ppoll(&mut fds, Some(TimeSpec::from_duration(wait)), None);
}
