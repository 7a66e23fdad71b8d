//! How a connection to a VRPN server comes about: by TCP, or by a request over UDP that the server answers with TCP.
//! Nothing here waits longer than a slice of time, so that a stop is heeded.

use std::io::{self, ErrorKind};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs, UdpSocket};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use super::address::{Address, Transport};
use super::body::encode_request;
use crate::fault::Fault;

/// Longest that one address of a host may take to answer.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(2);
/// Time between requests to be connected back.
const REQUEST_PERIOD: Duration = Duration::from_millis(500);
/// How long the server may take to connect back before that is said.
const CONNECT_BACK: Duration = Duration::from_secs(3);

/// An open connection.
#[derive(Debug)]
pub(super) struct Link {
    /// The stream, non-blocking.
    pub(super) stream: TcpStream,
    /// Where low-latency messages come in, non-blocking, and what the server is told about it.
    pub(super) datagrams: Option<(UdpSocket, (Ipv4Addr, u16))>,
    /// The server; datagrams of others are not read.
    pub(super) server: IpAddr,
}

/// A connection that is being made.
#[derive(Debug)]
pub(super) struct Connecting {
    address: Address,
    attempt: Option<Receiver<io::Result<Reached>>>,
    request: Option<Request>,
}

/// What a helping thread, which may wait, has found.
#[derive(Debug)]
enum Reached {
    Stream(TcpStream),
    Server(SocketAddr),
}

/// A request to be connected back.
#[derive(Debug)]
struct Request {
    server: SocketAddr,
    listener: TcpListener,
    socket: UdpSocket,
    own: Ipv4Addr,
    text: Vec<u8>,
    begun: Instant,
    sent: Option<Instant>,
}

impl Connecting {
    pub(super) const fn new(address: Address) -> Self {
        Self {
            address,
            attempt: None,
            request: None,
        }
    }

    /// Goes on for at most `slice`. `None` while nothing is known yet.
    pub(super) fn go_on(&mut self, slice: Duration) -> Option<Result<Link, Fault>> {
        if self.request.is_some() {
            return self.await_connection(slice);
        }
        // An attempt that hangs in the resolver stays the only one.
        let attempt = match self.attempt.take() {
            Some(attempt) => attempt,
            None => match start(&self.address) {
                Ok(attempt) => attempt,
                Err(error) => return Some(Err(self.unreachable(&error))),
            },
        };
        match attempt.recv_timeout(slice) {
            Err(RecvTimeoutError::Timeout) => {
                self.attempt = Some(attempt);
                None
            }
            Err(RecvTimeoutError::Disconnected) => {
                let error = io::Error::other("the attempt ended without a result");
                Some(Err(self.unreachable(&error)))
            }
            Ok(Err(error)) => Some(Err(self.unreachable(&error))),
            Ok(Ok(Reached::Stream(stream))) => Some(self.link(stream, None)),
            Ok(Ok(Reached::Server(server))) => match Request::new(server) {
                Ok(request) => {
                    self.request = Some(request);
                    None
                }
                Err(error) => Some(Err(self.unreachable(&error))),
            },
        }
    }

    /// Asks the server again when it is time, and takes its connection when it comes.
    fn await_connection(&mut self, slice: Duration) -> Option<Result<Link, Fault>> {
        let request = self.request.as_mut()?;
        if let Err(error) = request.ask() {
            self.request = None;
            return Some(Err(self.unreachable(&error)));
        }
        match request.accept(slice) {
            Ok(Some(stream)) => {
                let own = request.own;
                self.request = None;
                Some(self.link(stream, Some(own)))
            }
            Ok(None) if request.begun.elapsed() < CONNECT_BACK => None,
            Ok(None) => {
                // The listener stays: a slow server may connect yet.
                request.begun = Instant::now();
                Some(Err(Fault::Unreachable {
                    place: self.address.to_string(),
                    detail: format!(
                        "no server has connected back; if one runs there, a firewall may be in between: {}@tcp://{} \
                         needs no connection back",
                        self.address.device, self.address.host
                    ),
                }))
            }
            Err(error) => {
                self.request = None;
                Some(Err(self.unreachable(&error)))
            }
        }
    }

    fn link(&self, stream: TcpStream, own: Option<Ipv4Addr>) -> Result<Link, Fault> {
        Link::new(stream, own).map_err(|error| self.unreachable(&error))
    }

    fn unreachable(&self, error: &io::Error) -> Fault {
        let detail = match error.kind() {
            ErrorKind::ConnectionRefused => {
                "connection refused: does the VRPN server run?".to_owned()
            }
            ErrorKind::TimedOut => "no answer from the host".to_owned(),
            _ => error.to_string(),
        };
        Fault::Unreachable {
            place: self.address.to_string(),
            detail,
        }
    }
}

impl Link {
    fn new(stream: TcpStream, own: Option<Ipv4Addr>) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_nonblocking(true)?;
        let server = stream.peer_addr()?.ip();
        let datagrams = match own {
            None => None,
            Some(own) => {
                let socket = UdpSocket::bind((own, 0))?;
                socket.set_nonblocking(true)?;
                let port = socket.local_addr()?.port();
                Some((socket, (own, port)))
            }
        };
        Ok(Self {
            stream,
            datagrams,
            server,
        })
    }
}

impl Request {
    fn new(server: SocketAddr) -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
        // A connected socket knows which of our addresses leads there, and is told when nobody listens.
        socket.connect(server)?;
        socket.set_nonblocking(true)?;
        let IpAddr::V4(own) = socket.local_addr()?.ip() else {
            return Err(io::Error::other("asking by UDP needs IPv4; use tcp://"));
        };
        let listener = TcpListener::bind((own, 0))?;
        listener.set_nonblocking(true)?;
        let text = encode_request(own, listener.local_addr()?.port());
        Ok(Self {
            server,
            listener,
            socket,
            own,
            text,
            begun: Instant::now(),
            sent: None,
        })
    }

    fn ask(&mut self) -> io::Result<()> {
        if self
            .sent
            .is_some_and(|sent| sent.elapsed() < REQUEST_PERIOD)
        {
            return Ok(());
        }
        self.sent = Some(Instant::now());
        match self.socket.send(&self.text) {
            Ok(_) => Ok(()),
            Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// The server's connection; those of others are closed.
    fn accept(&self, slice: Duration) -> io::Result<Option<TcpStream>> {
        super::thread::wait_for_input(&[&self.listener, &self.socket], slice);
        // Reading shows whether the request was refused.
        match self.socket.recv(&mut [0; 64]) {
            Err(error) if error.kind() == ErrorKind::ConnectionRefused => return Err(error),
            Ok(_) | Err(_) => {}
        }
        match self.listener.accept() {
            Ok((stream, from)) if from.ip() == self.server.ip() => Ok(Some(stream)),
            Ok(_) => Ok(None),
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::WouldBlock | ErrorKind::Interrupted | ErrorKind::ConnectionAborted
                ) =>
            {
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }
}

/// Resolves and connects on a thread of its own: neither a name that does not resolve nor a host that does not answer
/// may keep the daemon from stopping.
fn start(address: &Address) -> io::Result<Receiver<io::Result<Reached>>> {
    let (found, result) = sync_channel(1);
    let address = address.clone();
    std::thread::Builder::new()
        .name("vrpn connecting".to_owned())
        .spawn(move || {
            // Nobody waits any more: the daemon stops.
            let _ = found.send(reach(&address));
        })?;
    Ok(result)
}

fn reach(address: &Address) -> io::Result<Reached> {
    let mut last = io::Error::new(ErrorKind::NotFound, "the name has no address");
    for target in (address.host.as_str(), address.port).to_socket_addrs()? {
        match address.transport {
            Transport::UdpRequest if target.is_ipv4() => return Ok(Reached::Server(target)),
            Transport::UdpRequest => {
                last = io::Error::other("asking by UDP needs IPv4; use tcp://");
            }
            Transport::Tcp => match TcpStream::connect_timeout(&target, CONNECT_TIMEOUT) {
                Ok(stream) => return Ok(Reached::Stream(stream)),
                Err(error) => last = error,
            },
        }
    }
    Err(last)
}
