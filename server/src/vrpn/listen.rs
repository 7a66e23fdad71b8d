//! Listening by TCP and UDP, connecting back, and the list of clients.

use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio::sync::{Semaphore, watch};
use tokio::task::JoinSet;
use tokio::time::Instant;
use tracing::debug;
use tsukamu_devices::vrpn::body::decode_request;

use super::client::{Client, Ending, Present};
use super::complaints::{Comings, Complaints, Trouble};
use super::{Pictures, VrpnFault, stopped};
use crate::metrics::Metrics;

/// Most clients at once.
const CLIENTS_MAX: usize = 1000;
/// Attempts to connect back at once.
const CONNECTING_MAX: usize = 32;
/// How long a client that asked may take to answer.
const CONNECT_BACK_MAX: Duration = Duration::from_secs(5);
/// Pause when the system has no room for another connection.
const NO_ROOM: Duration = Duration::from_millis(100);
/// Ports that are tried when any will do, until one is free for both TCP and UDP.
const PORT_TRIES: usize = 32;

/// The port of a server, TCP and UDP.
#[derive(Debug)]
pub struct Sockets {
    tcp: TcpListener,
    udp: UdpSocket,
    address: SocketAddr,
}

impl Sockets {
    /// Listens there; port 0 takes one that is free.
    ///
    /// # Errors
    /// When the address cannot be had.
    pub async fn bind(address: SocketAddr) -> Result<Self, VrpnFault> {
        let mut tries = if address.port() == 0 { PORT_TRIES } else { 1 };
        loop {
            tries -= 1;
            match Self::bind_both(address).await {
                Ok(sockets) => return Ok(sockets),
                Err(error) if error.kind() == io::ErrorKind::AddrInUse && tries > 0 => {}
                Err(error) if error.kind() == io::ErrorKind::AddrInUse => {
                    return Err(VrpnFault::InUse(address));
                }
                Err(source) => return Err(VrpnFault::Listen { address, source }),
            }
        }
    }

    async fn bind_both(address: SocketAddr) -> io::Result<Self> {
        let tcp = TcpListener::bind(address).await?;
        let address = tcp.local_addr()?;
        let udp = UdpSocket::bind(address).await?;
        Ok(Self { tcp, udp, address })
    }

    /// Where they listen.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }
}

/// What has become of a connection.
#[derive(Debug)]
struct Ended {
    address: SocketAddr,
    ending: Option<Ending>,
}

/// Everybody who is connected.
#[derive(Debug)]
pub(super) struct Clients {
    tcp: TcpListener,
    udp: Arc<UdpSocket>,
    pictures: Pictures,
    n_clients: watch::Sender<usize>,
    metrics: Arc<Metrics>,
    tasks: JoinSet<Ended>,
    /// Where we connect, or have connected, back to: a request is repeated until it is answered.
    called: BTreeMap<SocketAddr, ()>,
    connecting: Arc<Semaphore>,
    complaints: Complaints,
    comings: Comings,
}

impl Clients {
    pub(super) fn new(
        sockets: Sockets,
        pictures: Pictures,
        n_clients: watch::Sender<usize>,
        metrics: Arc<Metrics>,
    ) -> Self {
        Self {
            tcp: sockets.tcp,
            udp: Arc::new(sockets.udp),
            pictures,
            n_clients,
            metrics,
            tasks: JoinSet::new(),
            called: BTreeMap::new(),
            connecting: Arc::new(Semaphore::new(CONNECTING_MAX)),
            complaints: Complaints::default(),
            comings: Comings::default(),
        }
    }

    /// Until `stopping` says so.
    pub(super) async fn serve(mut self, stopping: watch::Receiver<bool>) {
        let mut stops = stopping.clone();
        let udp = Arc::clone(&self.udp);
        let mut datagram = [0; 512];
        loop {
            tokio::select! {
                () = stopped(&mut stops) => break,
                accepted = self.tcp.accept() => match accepted {
                    Ok((stream, address)) => self.admit(stream, address, &stopping),
                    Err(error) => {
                        let text = format!("no connection can be taken: {error}");
                        self.complaints.write(self.own_ip(), Trouble::NoConnection, &text);
                        tokio::time::sleep(NO_ROOM).await;
                    }
                },
                received = udp.recv_from(&mut datagram) => {
                    // An error is the answer to a datagram that somebody did not take.
                    if let Ok((n_bytes, from)) = received {
                        self.called_for(&datagram[..n_bytes], from, &stopping);
                    }
                }
                Some(ended) = self.tasks.join_next() => {
                    // A panic has been reported by the task itself.
                    if let Ok(ended) = ended {
                        self.note(ended);
                    }
                }
            }
        }
        while self.tasks.join_next().await.is_some() {}
    }

    fn own_ip(&self) -> IpAddr {
        self.tcp
            .local_addr()
            .map_or(IpAddr::V4(Ipv4Addr::UNSPECIFIED), |address| address.ip())
    }

    fn has_room(&mut self, from: IpAddr) -> bool {
        let has_room = self.tasks.len() < CLIENTS_MAX;
        if !has_room {
            let text = format!("{CLIENTS_MAX} clients are connected; it is refused");
            self.complaints.write(from, Trouble::NoRoom, &text);
        }
        has_room
    }

    fn admit(&mut self, stream: TcpStream, address: SocketAddr, stopping: &watch::Receiver<bool>) {
        if self.has_room(address.ip()) {
            let (serving, stopping) = (self.serving(), stopping.clone());
            self.tasks.spawn(async move {
                let ending = Some(serving.run(stream, address, stopping).await);
                Ended { address, ending }
            });
        }
    }

    /// Connects back to whoever asks: to where the datagram came from, whatever address it names, so that nobody can
    /// make this machine call a third one.
    fn called_for(&mut self, datagram: &[u8], from: SocketAddr, stopping: &watch::Receiver<bool>) {
        let Some((named, port)) = decode_request(datagram) else {
            debug!(%from, "a datagram that is no VRPN request");
            return;
        };
        let address = SocketAddr::new(from.ip(), port);
        if self.called.contains_key(&address) || !self.has_room(from.ip()) {
            return;
        }
        let Ok(permit) = Arc::clone(&self.connecting).try_acquire_owned() else {
            debug!(%from, "too many requests to connect back at once");
            return;
        };
        debug!(%from, named, port, "VRPN request to connect back");
        self.called.insert(address, ());
        let (serving, mut stopping) = (self.serving(), stopping.clone());
        self.tasks.spawn(async move {
            let connected = tokio::select! {
                () = stopped(&mut stopping) => None,
                connected = tokio::time::timeout(CONNECT_BACK_MAX, TcpStream::connect(address)) => {
                    connected.ok().and_then(Result::ok)
                }
            };
            drop(permit);
            let ending = match connected {
                Some(stream) => Some(serving.run(stream, address, stopping).await),
                None => None,
            };
            Ended { address, ending }
        });
    }

    fn serving(&mut self) -> Serving {
        Serving {
            is_written: self.comings.is_due(Instant::now()),
            udp: Arc::clone(&self.udp),
            pictures: self.pictures.clone(),
            n_clients: self.n_clients.clone(),
            metrics: Arc::clone(&self.metrics),
        }
    }

    fn note(&mut self, ended: Ended) {
        let Ended { address, ending } = ended;
        self.called.remove(&address);
        let (trouble, text) = match ending {
            None => (
                Trouble::Unreachable,
                "it asked to be connected back, and cannot be reached".to_owned(),
            ),
            Some(Ending::Stopped | Ending::Closed) => return,
            Some(Ending::Stalled) => (
                Trouble::Stalled,
                "it took nothing for 5 s and is dropped".to_owned(),
            ),
            Some(Ending::Unheard) => (
                Trouble::Unheard,
                "it did not greet and is dropped".to_owned(),
            ),
            Some(Ending::Fault(fault)) => (Trouble::Wrong, format!("it is dropped: {fault}")),
        };
        self.metrics.vrpn.clients_dropped.inc();
        self.complaints.write(address.ip(), trouble, &text);
    }
}

/// What a client's task takes along.
#[derive(Debug)]
struct Serving {
    /// Whether the log says that it comes and goes.
    is_written: bool,
    udp: Arc<UdpSocket>,
    pictures: Pictures,
    n_clients: watch::Sender<usize>,
    metrics: Arc<Metrics>,
}

impl Serving {
    async fn run(
        self,
        stream: TcpStream,
        address: SocketAddr,
        stopping: watch::Receiver<bool>,
    ) -> Ending {
        let _present = Present::new(Arc::clone(&self.metrics), self.n_clients);
        let is_written = self.is_written;
        Client::new(stream, address, self.udp, self.pictures, self.metrics)
            .run(stopping, is_written)
            .await
    }
}
