//! Connections: made to a device, or by a device to here.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use nix::poll::PollFlags;

use super::serve::{Heard, Link, is_passing, wait_for};
use crate::fault::Fault;
use crate::place::Place;

/// Longest that one address of a host may take to answer.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);
/// Longest that a command may take to be written.
const WRITE_TIMEOUT: Duration = Duration::from_millis(200);

/// A connection that is being made on a thread of its own: neither a name that does not resolve nor a host that does
/// not answer may keep the daemon from stopping.
#[derive(Debug)]
pub(super) struct Connecting(Receiver<io::Result<TcpStream>>);

impl Connecting {
    /// Starts.
    pub(super) fn start(host: &str, port: u16) -> io::Result<Self> {
        let (found, result) = sync_channel(1);
        let target = format!("{host}:{port}");
        std::thread::Builder::new()
            .name("connecting".to_owned())
            .spawn(move || {
                // Nobody waits any more: the daemon stops.
                let _ = found.send(connect(&target));
            })?;
        Ok(Self(result))
    }

    /// What came of it, `None` while it is not known after `wait`.
    pub(super) fn wait(&self, wait: Duration) -> Option<io::Result<TcpStream>> {
        match self.0.recv_timeout(wait) {
            Ok(result) => Some(result),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                Some(Err(io::Error::other("the attempt ended without a result")))
            }
        }
    }
}

fn connect(target: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
    for address in target.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT_TIMEOUT) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// A listening socket.
pub(super) fn listen(place: &Place, address: SocketAddr) -> Result<TcpListener, Fault> {
    TcpListener::bind(address)
        .and_then(|listener| listener.set_nonblocking(true).map(|()| listener))
        .map_err(|error| Fault::from_bind(place, &error))
}

/// An open connection, with the listener that it came through.
#[derive(Debug)]
pub(super) struct TcpLink<'a> {
    stream: TcpStream,
    listener: Option<&'a TcpListener>,
    place: &'a Place,
    bytes: Vec<u8>,
}

impl<'a> TcpLink<'a> {
    /// Takes a connection over; `listener` is where the device may come in anew.
    pub(super) fn new(
        place: &'a Place,
        stream: TcpStream,
        listener: Option<&'a TcpListener>,
    ) -> Result<Self, Fault> {
        prepare(&stream).map_err(|error| Fault::Unreachable {
            place: place.to_string(),
            detail: error.to_string(),
        })?;
        Ok(Self {
            stream,
            listener,
            place,
            bytes: vec![0; 4096],
        })
    }

    fn closed(&self) -> Fault {
        Fault::Disconnected {
            place: self.place.to_string(),
        }
    }
}

fn prepare(stream: &TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_nonblocking(true)
}

impl Link for TcpLink<'_> {
    fn sources(&self) -> Vec<BorrowedFd<'_>> {
        let listener = self.listener.map(AsFd::as_fd);
        [Some(self.stream.as_fd()), listener]
            .into_iter()
            .flatten()
            .collect()
    }

    fn hear(&mut self, _now_ns: u64) -> Heard<'_> {
        // A device that was reset connects anew before its old connection is known to be dead: the newest wins.
        if let Some(Ok((stream, _))) = self.listener.map(TcpListener::accept)
            && prepare(&stream).is_ok()
        {
            self.stream = stream;
            return Heard::Anew(self.closed());
        }
        match self.stream.read(&mut self.bytes) {
            Ok(0) => Heard::Gone(self.closed()),
            Ok(n_bytes) => Heard::Bytes(&self.bytes[..n_bytes]),
            Err(error) if is_passing(error.kind()) => Heard::Nothing,
            Err(_) => Heard::Gone(self.closed()),
        }
    }

    fn say(&mut self, mut bytes: &[u8]) -> Result<(), Fault> {
        let end = Instant::now() + WRITE_TIMEOUT;
        while !bytes.is_empty() {
            match self.stream.write(bytes) {
                Ok(0) => return Err(self.closed()),
                Ok(n_bytes) => bytes = &bytes[n_bytes..],
                // The rest is dropped, and the session's own deadline acts.
                Err(error) if is_passing(error.kind()) && Instant::now() >= end => return Ok(()),
                Err(error) if is_passing(error.kind()) => {
                    wait_for(
                        &[self.stream.as_fd()],
                        PollFlags::POLLOUT,
                        end - Instant::now(),
                    );
                }
                Err(_) => return Err(self.closed()),
            }
        }
        Ok(())
    }
}
