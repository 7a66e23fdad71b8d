//! A VRPN client of a few lines, and our own.

use std::net::SocketAddr;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tsukamu_devices::clock::Clock;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::port::PortEvent;
use tsukamu_devices::port_thread::PortThread;
use tsukamu_devices::session::DeviceEvent;
use tsukamu_devices::vrpn::body::{PosQuat, decode_channels};
use tsukamu_devices::vrpn::cookie::COOKIE;
use tsukamu_devices::vrpn::inbound::{Inbound, Item};
use tsukamu_devices::vrpn::message::{Header, Time, encode_with, system};
use tsukamu_devices::vrpn::names::{
    ANALOG_CHANNEL, Names, PING, POS_QUAT, describe_sender, describe_type,
};
use tsukamu_devices::vrpn::session::VrpnSession;
use tsukamu_devices::vrpn::settings::VrpnSettings;
use tsukamu_devices::vrpn::thread;
use tsukamu_server::daemon::{Daemon, DaemonConfig, start};
use tsukamu_server::settings::Mode;
use tsukamu_server::settings::vrpn::VrpnSettings as ServerSettings;
use tsukamu_world::scene::Scene;

use super::support::{config, soon};

/// A daemon with a VRPN server.
pub(crate) fn vrpn_config(scene: Scene, mode: Mode, rate_hz: f64) -> DaemonConfig {
    DaemonConfig {
        vrpn: Some(ServerSettings {
            rate_hz,
            ..ServerSettings::new(SocketAddr::from(([127, 0, 0, 1], 0)))
        }),
        ..config(scene, mode)
    }
}

pub(crate) async fn vrpn_daemon(scene: Scene, mode: Mode, rate_hz: f64) -> Daemon {
    start(vrpn_config(scene, mode, rate_hz))
        .await
        .expect("it starts")
}

pub(crate) fn address(daemon: &Daemon) -> SocketAddr {
    daemon.vrpn_addr().expect("a VRPN server")
}

/// A message with names in place of numbers.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    pub(crate) sender: String,
    pub(crate) kind: String,
    pub(crate) header: Header,
    pub(crate) body: Vec<u8>,
}

impl Seen {
    /// A pose of that sender.
    pub(crate) fn pose_of(&self, sender: &str) -> Option<PosQuat> {
        (self.sender == sender && self.kind == POS_QUAT)
            .then(|| PosQuat::decode(&self.body).expect("a pose"))
    }

    /// The channels of that sender.
    pub(crate) fn channels_of(&self, sender: &str) -> Option<Vec<f64>> {
        (self.sender == sender && self.kind == ANALOG_CHANNEL)
            .then(|| decode_channels(&self.body).expect("channels"))
    }
}

/// A client that is there to look at everything.
pub(crate) struct Probe {
    pub(crate) stream: TcpStream,
    inbound: Inbound,
    pub(crate) senders: Names,
    types: Names,
    n_opened: i32,
}

impl Probe {
    /// Connected by TCP, the cookie sent.
    pub(crate) async fn connect(to: SocketAddr) -> Self {
        Self::over(soon(TcpStream::connect(to)).await.expect("it listens")).await
    }

    /// On a connection, the cookie sent.
    pub(crate) async fn over(mut stream: TcpStream) -> Self {
        stream.write_all(&COOKIE).await.expect("sent");
        Self {
            stream,
            inbound: Inbound::default(),
            senders: Names::default(),
            types: Names::default(),
            n_opened: 0,
        }
    }

    /// Opens a device as VRPN's own clients do: its name, the type, a ping.
    pub(crate) async fn open(&mut self, name: &str) {
        let mut out = Vec::new();
        describe_sender(Time::default(), self.n_opened, name, &mut out);
        describe_type(Time::default(), 40, PING, &mut out);
        let ping = Header {
            sender: self.n_opened,
            kind: 40,
            ..Header::default()
        };
        encode_with(&ping, &mut out, |_| {});
        self.n_opened += 1;
        self.stream.write_all(&out).await.expect("sent");
    }

    /// The next message that is no description; `None` when the connection has ended.
    pub(crate) async fn next(&mut self) -> Option<Seen> {
        soon(self.next_within()).await
    }

    async fn next_within(&mut self) -> Option<Seen> {
        let mut bytes = [0; 8192];
        loop {
            loop {
                let seen = match self.inbound.next_item().expect("whole messages") {
                    None => break,
                    Some(Item::Cookie(_)) => continue,
                    Some(Item::Message(message)) => message,
                };
                match seen.header.kind {
                    system::SENDER_DESCRIPTION => {
                        self.senders.learn(&seen).expect("a name");
                    }
                    system::TYPE_DESCRIPTION => {
                        self.types.learn(&seen).expect("a name");
                    }
                    kind => {
                        let header = seen.header;
                        let sender = self.senders.get(header.sender);
                        let kind = self.types.get(kind);
                        return Some(Seen {
                            sender: sender.expect("described before it is used").to_owned(),
                            kind: kind.expect("described before it is used").to_owned(),
                            header,
                            body: seen.body.to_vec(),
                        });
                    }
                }
            }
            match self.stream.read(&mut bytes).await {
                Ok(0) | Err(_) => return None,
                Ok(n_bytes) => self.inbound.push(&bytes[..n_bytes]),
            }
        }
    }

    /// The first message that is as wanted.
    pub(crate) async fn find<T>(&mut self, wanted: impl Fn(&Seen) -> Option<T>) -> T {
        loop {
            let seen = self.next().await.expect("the connection goes on");
            if let Some(found) = wanted(&seen) {
                return found;
            }
        }
    }

    /// The tick of the next picture.
    pub(crate) async fn tick(&mut self) -> u64 {
        self.find(|seen| seen.channels_of("World").map(|world| world[1] as u64))
            .await
    }
}

/// Our own client, on its thread; it ends when this is dropped.
pub(crate) struct OurClient {
    events: Receiver<DeviceEvent>,
    _thread: PortThread,
}

impl OurClient {
    pub(crate) fn start(settings: VrpnSettings) -> Self {
        let (sender, events) = sync_channel(100_000);
        let address = settings.address.clone();
        let session = VrpnSession::new(settings, GloveCalibration::default());
        let deliver = move |event: PortEvent<'_>| {
            if let PortEvent::Device(event) = event {
                let _ = sender.send(event);
            }
        };
        let clock = Clock::new(Instant::now());
        let thread =
            thread::spawn(address, Box::new(session), clock, false, deliver).expect("a thread");
        Self {
            events,
            _thread: thread,
        }
    }

    /// The first event that is as wanted; waits, but not for ever.
    pub(crate) fn find<T>(&self, wanted: impl Fn(&DeviceEvent) -> Option<T>) -> T {
        loop {
            let event = self
                .events
                .recv_timeout(Duration::from_secs(30))
                .expect("it comes within the deadline");
            if let Some(found) = wanted(&event) {
                return found;
            }
        }
    }
}
