//! Serves a session over the network until it is told to stop.

use std::io::ErrorKind;
use std::net::TcpListener;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;

use super::tcp::{Connecting, TcpLink, listen};
use super::udp::UdpLink;
use crate::clock::Clock;
use crate::fault::Fault;
use crate::place::Place;
use crate::port::{Direction, PortEvent};
use crate::port_thread::SessionHandle;
use crate::session::{DeviceEvent, PortRequest, Session, SessionState, SessionStats, StateChange};

/// First wait before a lost place is opened again; doubled at each failure.
const REOPEN_MIN: Duration = Duration::from_millis(50);
/// Longest wait before a lost place is opened again: a device that answers is to be heard within a second.
const REOPEN_MAX: Duration = Duration::from_millis(500);
/// Longest that a request to stop goes unnoticed.
const STOP_LATENCY: Duration = Duration::from_millis(50);
/// How often the counters are handed out, ns.
const STATS_PERIOD_NS: u64 = 1_000_000_000;
/// Most datagrams or reads that are taken before anything else is looked at again.
const BURST: usize = 256;

/// What a link hears.
#[derive(Debug)]
pub(super) enum Heard<'a> {
    /// Nothing at present.
    Nothing,
    /// Bytes, or a whole datagram.
    Bytes(&'a [u8]),
    /// A datagram of a sender that is not heard.
    Refused,
    /// The device has come in anew; the fault says what became of the old connection.
    Anew(Fault),
    /// The link is lost.
    Gone(Fault),
}

/// An open way to a device.
pub(super) trait Link {
    /// What to wait for.
    fn sources(&self) -> Vec<BorrowedFd<'_>>;

    /// Takes what is there; never waits.
    fn hear(&mut self, now_ns: u64) -> Heard<'_>;

    /// Sends.
    fn say(&mut self, bytes: &[u8]) -> Result<(), Fault>;

    /// What is wrong with the link itself while it works.
    fn complaint(&self, _now_ns: u64) -> Option<Fault> {
        None
    }

    /// Datagrams that were refused.
    fn n_refused(&self) -> u64 {
        0
    }
}

/// Errors after which the next try may do.
pub(super) const fn is_passing(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::WouldBlock
            | ErrorKind::TimedOut
            | ErrorKind::Interrupted
            // Of an earlier answer to a sender that has gone.
            | ErrorKind::ConnectionRefused
    )
}

enum End {
    Stopped,
    Lost(Fault),
    /// The session asks for it.
    Reopen,
}

/// A session and all that its thread needs to serve it.
pub(super) struct Service<'a> {
    pub(super) place: &'a Place,
    pub(super) raw: bool,
    pub(super) session: &'a mut (dyn Session + Send),
    pub(super) outside: &'a SessionHandle,
    pub(super) stop: &'a AtomicBool,
    pub(super) clock: Clock,
    pub(super) deliver: &'a mut dyn FnMut(PortEvent<'_>),
}

impl Service<'_> {
    /// Until `stop` is set.
    pub(super) fn run(&mut self) {
        self.session.port_opening(self.clock.now_ns());
        self.hand_out(None);
        match self.place {
            // The caller sends these elsewhere.
            Place::Serial(_) | Place::Vrpn(_) => {}
            Place::Udp(address) => {
                let (place, address) = (self.place, *address);
                self.again_and_again(|service| {
                    UdpLink::open(place, address)
                        .map_or_else(End::Lost, |mut link| service.serve(&mut link))
                });
            }
            Place::Tcp { host, port } => {
                self.again_and_again(|service| service.connect_and_serve(host, *port));
            }
            Place::TcpListen(address) => {
                let (place, address) = (self.place, *address);
                self.again_and_again(|service| match listen(place, address) {
                    Ok(listener) => service.accept_and_serve(&listener),
                    Err(fault) => End::Lost(fault),
                });
            }
        }
        self.hand_out(None);
        (self.deliver)(PortEvent::Stats(self.session.stats()));
    }

    /// Opens and serves with growing pauses until `stop` is set; the pause is short again after records have come.
    fn again_and_again(&mut self, mut once: impl FnMut(&mut Self) -> End) {
        let mut wait = REOPEN_MIN;
        while !self.stopped() {
            let before = self.session.stats().records;
            match once(self) {
                End::Stopped => return,
                End::Lost(fault) => self.lose(fault),
                End::Reopen => {
                    let fault = self.session.fault().cloned();
                    self.lose(fault.unwrap_or_else(|| Fault::Disconnected {
                        place: self.place.to_string(),
                    }));
                }
            }
            if self.session.stats().records > before {
                wait = REOPEN_MIN;
            }
            self.pause(wait);
            wait = (wait * 2).min(REOPEN_MAX);
        }
    }

    fn connect_and_serve(&mut self, host: &str, port: u16) -> End {
        let place = self.place;
        let unreachable = |error: std::io::Error| {
            End::Lost(Fault::Unreachable {
                place: place.to_string(),
                detail: error.to_string(),
            })
        };
        let connecting = match Connecting::start(host, port) {
            Ok(connecting) => connecting,
            Err(error) => return unreachable(error),
        };
        loop {
            if self.stopped() {
                return End::Stopped;
            }
            match connecting.wait(STOP_LATENCY) {
                None => {}
                Some(Err(error)) => return unreachable(error),
                Some(Ok(stream)) => {
                    return TcpLink::new(place, stream, None)
                        .map_or_else(End::Lost, |mut link| self.serve(&mut link));
                }
            }
        }
    }

    fn accept_and_serve(&mut self, listener: &TcpListener) -> End {
        let place = self.place;
        loop {
            if self.stopped() {
                return End::Stopped;
            }
            match listener.accept() {
                Ok((stream, _)) => match TcpLink::new(place, stream, Some(listener)) {
                    Ok(mut link) => match self.serve(&mut link) {
                        End::Lost(fault) => self.lose(fault),
                        end => return end,
                    },
                    Err(fault) => self.lose(fault),
                },
                Err(error) if is_passing(error.kind()) => {
                    // One that has just left is more worth telling than that nobody is there.
                    if self.session.fault().is_none() {
                        self.lose(Fault::NobodyConnected {
                            place: place.to_string(),
                        });
                    }
                    wait_for(&[listener.as_fd()], PollFlags::POLLIN, STOP_LATENCY);
                }
                Err(error) => return End::Lost(Fault::from_bind(place, &error)),
            }
        }
    }

    /// Serves an open link.
    fn serve(&mut self, link: &mut dyn Link) -> End {
        self.session.port_opened(self.clock.now_ns());
        let mut stats_ns = self.clock.now_ns();
        let mut complaint = None;
        loop {
            if self.stopped() {
                // The device may be gone already, and nothing more can be done for it.
                let _ = self.say(link, self.session.farewell());
                return End::Stopped;
            }
            self.outside.tell(self.clock.now_ns(), self.session);
            if let Some(end) = self.obey(link) {
                return end;
            }
            wait_for(&link.sources(), PollFlags::POLLIN, self.rest());
            if let Some(fault) = self.listen_to(link) {
                return End::Lost(fault);
            }
            let now_ns = self.clock.now_ns();
            self.session.handle_timeout(now_ns);
            let changed = link.complaint(now_ns);
            self.hand_out(changed.as_ref());
            if changed != complaint {
                self.tell_state(changed.clone());
                complaint = changed;
            }
            if now_ns >= stats_ns + STATS_PERIOD_NS {
                stats_ns = now_ns;
                let stats = self.stats(link);
                (self.deliver)(PortEvent::Stats(stats));
            }
        }
    }

    /// Takes what has arrived; what is wrong if the link is lost.
    fn listen_to(&mut self, link: &mut dyn Link) -> Option<Fault> {
        for _ in 0..BURST {
            let stamp_ns = self.clock.now_ns();
            match link.hear(stamp_ns) {
                Heard::Nothing => return None,
                Heard::Refused => {}
                Heard::Gone(fault) => return Some(fault),
                Heard::Anew(fault) => {
                    self.session.port_lost(stamp_ns, fault);
                    self.session.port_opened(stamp_ns);
                }
                Heard::Bytes(bytes) => {
                    if self.raw {
                        (self.deliver)(PortEvent::Raw {
                            stamp_ns,
                            direction: Direction::Received,
                            bytes,
                        });
                    }
                    self.session.push(stamp_ns, bytes);
                }
            }
        }
        None
    }

    /// Sends what the session wants to send, and does what it asks for.
    fn obey(&mut self, link: &mut dyn Link) -> Option<End> {
        while let Some(request) = self.session.poll_port_request() {
            match request {
                PortRequest::Reopen => return Some(End::Reopen),
                // A network has no line settings.
                PortRequest::ReapplySettings | PortRequest::SetRts(_) => {}
            }
        }
        while let Some(command) = self.session.poll_transmit() {
            if let Err(fault) = self.say(link, &command) {
                return Some(End::Lost(fault));
            }
        }
        None
    }

    fn say(&mut self, link: &mut dyn Link, bytes: &[u8]) -> Result<(), Fault> {
        if bytes.is_empty() {
            return Ok(());
        }
        link.say(bytes)?;
        if self.raw {
            (self.deliver)(PortEvent::Raw {
                stamp_ns: self.clock.now_ns(),
                direction: Direction::Sent,
                bytes,
            });
        }
        Ok(())
    }

    /// Tells the session of a loss, once.
    fn lose(&mut self, fault: Fault) {
        let told =
            self.session.state() == SessionState::Absent && self.session.fault() == Some(&fault);
        if !told {
            self.session.port_lost(self.clock.now_ns(), fault);
        }
        self.hand_out(None);
    }

    /// Hands over the session's events; where it has nothing to complain of, the link may.
    fn hand_out(&mut self, complaint: Option<&Fault>) {
        while let Some(mut event) = self.session.next_event() {
            if let DeviceEvent::State(change) = &mut event {
                if change.fault.is_none() {
                    change.fault = complaint.cloned();
                }
                (self.deliver)(PortEvent::Device(event));
                (self.deliver)(PortEvent::Stats(self.session.stats()));
            } else {
                (self.deliver)(PortEvent::Device(event));
            }
        }
    }

    /// The session's state with a complaint of the link, or without one from now on.
    fn tell_state(&mut self, complaint: Option<Fault>) {
        let fault = self.session.fault().cloned().or(complaint);
        (self.deliver)(PortEvent::Device(DeviceEvent::State(StateChange {
            stamp_ns: self.clock.now_ns(),
            state: self.session.state(),
            fault,
        })));
    }

    /// Refused datagrams count as dropped records.
    fn stats(&self, link: &dyn Link) -> SessionStats {
        let stats = self.session.stats();
        SessionStats {
            dropped_records: stats.dropped_records + link.n_refused(),
            ..stats
        }
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Acquire)
    }

    /// How long nothing is due.
    fn rest(&self) -> Duration {
        self.session.deadline().map_or(STOP_LATENCY, |deadline_ns| {
            let rest_ns = deadline_ns.saturating_sub(self.clock.now_ns());
            Duration::from_nanos(rest_ns).min(STOP_LATENCY)
        })
    }

    fn pause(&self, wait: Duration) {
        let end = Instant::now() + wait;
        while !self.stopped() {
            let rest = end.saturating_duration_since(Instant::now());
            if rest.is_zero() {
                return;
            }
            std::thread::park_timeout(rest.min(STOP_LATENCY));
        }
    }
}

/// Waits until one of the sources is ready, for a time at most.
pub(super) fn wait_for(sources: &[BorrowedFd<'_>], ready: PollFlags, wait: Duration) {
    let mut watched: Vec<PollFd<'_>> = sources
        .iter()
        .map(|source| PollFd::new(*source, ready))
        .collect();
    // Whether it ended by time, by data or by a signal, the caller looks at everything.
    let _ = ppoll(&mut watched, Some(TimeSpec::from(wait)), None);
}
