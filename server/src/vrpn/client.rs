//! One client's connection: a task that reads, writes and never waits for either alone.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use socket2::SockRef;
use tokio::io::Interest;
use tokio::net::{TcpStream, UdpSocket};
use tokio::sync::watch;
use tokio::time::Instant;
use tracing::info;
use tsukamu_devices::vrpn::cookie::COOKIE;
use tsukamu_devices::vrpn::inbound::Inbound;
use tsukamu_devices::vrpn::message::{Time, datagrams};

use super::peer::{Peer, PeerFault, Said};
use super::telling::Telling;
use super::{Pictures, stopped};
use crate::front::notice_silence;
use crate::metrics::Metrics;

/// How long bytes may wait for a client that does not take them.
pub const STALLED_MAX: Duration = Duration::from_secs(5);
/// How long a client may take to greet.
const COOKIE_MAX: Duration = Duration::from_secs(5);
/// What the system keeps for a client: little, for what waits there grows old.
const SEND_BUFFER: usize = 64 * 1024;
/// Bytes that wait, beyond which pings are not answered.
const ANSWERED_MAX: usize = 64 * 1024;
/// How often a picture that stands is sent again as datagrams: one may be lost, or come before the names that it needs.
const REPEAT: Duration = Duration::from_secs(1);

/// Why a connection has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// The daemon stops.
    Stopped,
    /// The client closed it, or it broke.
    Closed,
    /// The client took nothing for too long.
    Stalled,
    /// The client did not greet.
    Unheard,
    /// What the client says is wrong.
    Fault(PeerFault),
}

/// A connection and what it needs.
#[derive(Debug)]
pub(super) struct Client {
    stream: TcpStream,
    address: SocketAddr,
    is_written: bool,
    udp: Arc<UdpSocket>,
    pictures: Pictures,
    metrics: Arc<Metrics>,
    peer: Peer,
    telling: Telling,
    /// Where it takes datagrams.
    datagrams: Option<SocketAddr>,
    /// Messages for datagrams, which go behind the names in the outbox.
    urgent: Vec<u8>,
    /// When it was told a picture, or that again.
    told: Instant,
    /// Bytes for it, of which `n_sent` are sent.
    outbox: Vec<u8>,
    n_sent: usize,
    opened: Instant,
    /// Since when bytes wait.
    full: Option<Instant>,
    buffer: Vec<u8>,
}

impl Client {
    /// A connection that has just come about.
    pub(super) fn new(
        stream: TcpStream,
        address: SocketAddr,
        udp: Arc<UdpSocket>,
        pictures: Pictures,
        metrics: Arc<Metrics>,
    ) -> Self {
        // A socket that refuses is gone already.
        let _ = stream.set_nodelay(true);
        let _ = notice_silence(&stream);
        let _ = SockRef::from(&stream).set_send_buffer_size(SEND_BUFFER);
        Self {
            stream,
            address,
            is_written: true,
            udp,
            pictures,
            metrics,
            peer: Peer::default(),
            telling: Telling::default(),
            datagrams: None,
            urgent: Vec::new(),
            told: Instant::now(),
            outbox: COOKIE.to_vec(),
            n_sent: 0,
            opened: Instant::now(),
            full: None,
            buffer: vec![0; 4096],
        }
    }

    /// Serves it until it ends; `is_written` says whether the log tells of it.
    pub(super) async fn run(
        mut self,
        mut stopping: watch::Receiver<bool>,
        is_written: bool,
    ) -> Ending {
        self.is_written = is_written;
        let ending = tokio::select! {
            () = stopped(&mut stopping) => Ending::Stopped,
            ending = self.serve() => ending,
        };
        if self.peer.is_greeted() && is_written {
            info!(client = %self.address, ?ending, "VRPN client gone");
        }
        ending
    }

    async fn serve(&mut self) -> Ending {
        loop {
            if let Err(ending) = self.turn().await {
                return ending;
            }
        }
    }

    /// Waits for whatever comes first, and does what can be done.
    async fn turn(&mut self) -> Result<(), Ending> {
        self.fill();
        self.write()?;
        self.send_urgent();
        let is_full = self.waiting() > 0;
        let is_greeted = self.peer.is_greeted();
        let repeat = self.datagrams.filter(|_| is_greeted && !is_full);
        let repeat = repeat.map(|_| self.told + REPEAT);
        let interest = if is_full {
            Interest::READABLE | Interest::WRITABLE
        } else {
            Interest::READABLE
        };
        let (limit, ending) = match self.full {
            Some(since) => (Some(since + STALLED_MAX), Ending::Stalled),
            None => (
                (!is_greeted).then_some(self.opened + COOKIE_MAX),
                Ending::Unheard,
            ),
        };
        let is_readable = tokio::select! {
            ready = self.stream.ready(interest) => {
                let Ok(ready) = ready else { return Err(Ending::Closed) };
                ready.is_readable()
            }
            changed = self.pictures.changed(), if is_greeted && !is_full => {
                if changed.is_err() {
                    return Err(Ending::Stopped);
                }
                false
            }
            () = until(repeat), if repeat.is_some() => {
                self.repeat();
                false
            }
            () = until(limit), if limit.is_some() => return Err(ending),
        };
        if is_readable {
            self.read()?;
        }
        Ok(())
    }

    fn waiting(&self) -> usize {
        self.outbox.len() - self.n_sent
    }

    /// Takes the newest picture, if nothing else waits to be sent: newest wins.
    fn fill(&mut self) {
        if !self.peer.is_greeted() || self.waiting() > 0 {
            return;
        }
        // Of the picture before.
        self.send_urgent();
        let newest = self.pictures.borrow_and_update().clone();
        let Some((bytes, n_missed)) = newest.and_then(|picture| self.telling.tell(&picture)) else {
            return;
        };
        self.told = Instant::now();
        self.metrics.vrpn.pictures_sent.inc();
        self.metrics.vrpn.pictures_skipped.inc_by(n_missed);
        self.outbox.extend_from_slice(&bytes.certain);
        match self.datagrams {
            None => self.outbox.extend_from_slice(&bytes.urgent),
            Some(_) => self.urgent = bytes.urgent,
        }
    }

    /// Tells a picture that stands once more.
    fn repeat(&mut self) {
        self.told = Instant::now();
        if let Some(picture) = self.pictures.borrow().as_ref() {
            self.urgent = self.telling.again(picture);
        }
    }

    fn send_urgent(&mut self) {
        let urgent = std::mem::take(&mut self.urgent);
        let Some(to) = self.datagrams else { return };
        for datagram in datagrams(&urgent) {
            // What does not go at once is old when it does.
            if self.udp.try_send_to(datagram, to).is_ok() {
                self.metrics.vrpn.bytes_sent.inc_by(datagram.len() as u64);
            }
        }
    }

    /// Writes what goes without waiting.
    fn write(&mut self) -> Result<(), Ending> {
        while self.waiting() > 0 {
            match self.stream.try_write(&self.outbox[self.n_sent..]) {
                Ok(0) => return Err(Ending::Closed),
                Ok(n_bytes) => {
                    self.n_sent += n_bytes;
                    self.metrics.vrpn.bytes_sent.inc_by(n_bytes as u64);
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    self.full.get_or_insert_with(Instant::now);
                    return Ok(());
                }
                Err(_) => return Err(Ending::Closed),
            }
        }
        self.outbox.clear();
        self.n_sent = 0;
        self.full = None;
        Ok(())
    }

    /// Reads once, and answers.
    fn read(&mut self) -> Result<(), Ending> {
        let n_bytes = match self.stream.try_read(&mut self.buffer) {
            Ok(0) => return Err(Ending::Closed),
            Ok(n_bytes) => n_bytes.min(Inbound::MAX_PUSH),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
            Err(_) => return Err(Ending::Closed),
        };
        let mut said = Vec::new();
        let result = self.peer.push(&self.buffer[..n_bytes], &mut said);
        said.into_iter().for_each(|said| self.answer(said));
        result.map_err(Ending::Fault)
    }

    fn answer(&mut self, said: Said) {
        let time = match self.pictures.borrow().as_ref() {
            Some(picture) => picture.time,
            None => now(),
        };
        match said {
            Said::Greeted(version) => {
                let greeting = self.telling.greeting(time);
                self.outbox.extend_from_slice(&greeting);
                if self.is_written {
                    info!(client = %self.address, version, "VRPN client");
                }
            }
            Said::Opened(name) => self.telling.open(name),
            Said::Ping(name) => {
                // What was opened just now is described first.
                self.fill();
                if self.waiting() <= ANSWERED_MAX
                    && let Some(pong) = self.telling.pong(time, &name)
                {
                    self.outbox.extend_from_slice(&pong);
                }
            }
            Said::Datagrams(port) => {
                self.datagrams = Some(SocketAddr::new(self.address.ip(), port));
            }
        }
    }
}

/// The time, before there is a picture to take it from.
fn now() -> Time {
    let since_unix = SystemTime::now().duration_since(UNIX_EPOCH);
    Time::from_unix_ns(since_unix.map_or(0, |time| time.as_nanos() as u64))
}

/// Counts a client as long as it is there.
#[derive(Debug)]
pub(super) struct Present {
    metrics: Arc<Metrics>,
    n_clients: watch::Sender<usize>,
}

impl Present {
    pub(super) fn new(metrics: Arc<Metrics>, n_clients: watch::Sender<usize>) -> Self {
        metrics.vrpn.clients.fetch_add(1, Ordering::AcqRel);
        n_clients.send_modify(|n| *n += 1);
        Self { metrics, n_clients }
    }
}

impl Drop for Present {
    fn drop(&mut self) {
        self.metrics.vrpn.clients.fetch_sub(1, Ordering::AcqRel);
        self.n_clients.send_modify(|n| *n = n.saturating_sub(1));
    }
}

async fn until(limit: Option<Instant>) {
    if let Some(limit) = limit {
        tokio::time::sleep_until(limit).await;
    }
}
