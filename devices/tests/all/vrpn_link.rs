//! The client of VRPN on its thread, against servers of a few lines on loopback: who closes at once, who comes late.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

use tsukamu_devices::clock::Clock;
use tsukamu_devices::fault::Fault;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::port::{Direction, PortEvent};
use tsukamu_devices::port_thread::PortThread;
use tsukamu_devices::session::{DeviceEvent, SessionState, StateChange};
use tsukamu_devices::vrpn::body::decode_request;
use tsukamu_devices::vrpn::cookie::COOKIE;
use tsukamu_devices::vrpn::session::VrpnSession;
use tsukamu_devices::vrpn::settings::VrpnSettings;
use tsukamu_devices::vrpn::thread;

use crate::vrpn_session::{greeting, pose};

/// Far beyond what anything takes on a loaded machine.
const DEADLINE: Duration = Duration::from_secs(30);

/// A client on its thread.
struct Client {
    events: Receiver<DeviceEvent>,
    raw: Receiver<Vec<u8>>,
    thread: PortThread,
}

impl Client {
    fn start(text: &str) -> Self {
        let settings = VrpnSettings::tracker(text.parse().unwrap());
        let (event, events) = sync_channel(10_000);
        let (bytes_in, raw) = sync_channel(10_000);
        let deliver = move |delivered: PortEvent<'_>| match delivered {
            PortEvent::Device(device) => event.send(device).unwrap(),
            PortEvent::Raw {
                direction: Direction::Received,
                bytes,
                ..
            } => bytes_in.send(bytes.to_vec()).unwrap(),
            PortEvent::Raw { .. } | PortEvent::Stats(_) => {}
        };
        let session = VrpnSession::new(settings.clone(), GloveCalibration::default());
        let clock = Clock::new(Instant::now());
        let thread =
            thread::spawn(settings.address, Box::new(session), clock, true, deliver).unwrap();
        Self {
            events,
            raw,
            thread,
        }
    }

    /// Changes of state up to the first one that is as wanted.
    fn until(&self, wanted: impl Fn(&StateChange) -> bool) -> Vec<StateChange> {
        let mut changes = Vec::new();
        loop {
            if let DeviceEvent::State(change) = self.events.recv_timeout(DEADLINE).unwrap() {
                changes.push(change);
                if wanted(changes.last().unwrap()) {
                    return changes;
                }
            }
        }
    }

    fn until_running(&self) -> Vec<StateChange> {
        self.until(|change| change.state == SessionState::Running)
    }

    /// Stops it, which must not take long whatever it waits for.
    fn stop(self) {
        let begin = Instant::now();
        drop(self.events);
        drop(self.raw);
        self.thread.stop();
        assert!(begin.elapsed() < DEADLINE / 10, "{:?}", begin.elapsed());
    }
}

/// Greets a client and shows it a pose; gives what the client said first.
fn serve(stream: &mut TcpStream) -> Vec<u8> {
    let mut cookie = vec![0; COOKIE.len()];
    stream.read_exact(&mut cookie).unwrap();
    stream.write_all(&greeting("Tracker0")).unwrap();
    stream.write_all(&pose(0, 1_000_000, 1.0)).unwrap();
    cookie
}

#[test]
fn a_server_that_closes_at_once_is_tried_until_it_serves() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let client = Client::start(&format!("Tracker0@tcp://{address}"));
    let begin = Instant::now();
    for round in 0..6 {
        let (mut stream, _) = listener.accept().unwrap();
        // Some close without a word, some after their cookie.
        if round % 2 == 0 {
            stream.write_all(&COOKIE).unwrap();
        }
    }
    // Six waits of half a second at most.
    assert!(begin.elapsed() < DEADLINE);
    let (mut stream, _) = listener.accept().unwrap();
    assert_eq!(serve(&mut stream), COOKIE);
    let changes = client.until_running();
    let lost = changes
        .iter()
        .filter(|change| change.state == SessionState::Absent)
        .count();
    assert_eq!(lost, 1, "one line for the loss: {changes:?}");
    // The raw tap has every byte.
    let raw: usize = client.raw.try_iter().map(|bytes| bytes.len()).sum();
    let told = greeting("Tracker0").len() + pose(0, 1, 1.0).len();
    assert!(raw >= told && raw <= told + 3 * COOKIE.len());
    client.stop();
}

#[test]
fn a_server_that_comes_back_is_heard_again() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let client = Client::start(&format!("Tracker0@tcp://{address}"));
    let (mut stream, _) = listener.accept().unwrap();
    serve(&mut stream);
    client.until_running();
    drop(listener);
    drop(stream);
    let changes = client.until(|change| {
        matches!(&change.fault, Some(Fault::Unreachable { detail, .. }) if detail.contains("refused"))
    });
    assert!(matches!(changes[0].fault, Some(Fault::Disconnected { .. })));
    let listener = TcpListener::bind(address).unwrap();
    let (mut stream, _) = listener.accept().unwrap();
    serve(&mut stream);
    client.until_running();
    client.stop();
}

#[test]
fn a_request_is_repeated_until_somebody_connects_back() {
    // A server that is there and does not answer yet.
    let server = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = server.local_addr().unwrap();
    let client = Client::start(&format!("Tracker0@{address}"));
    let mut datagram = [0; 256];
    let ports: Vec<u16> = (0..3)
        .map(|_| {
            let (n_bytes, _) = server.recv_from(&mut datagram).unwrap();
            let (named, port) = decode_request(&datagram[..n_bytes]).unwrap();
            assert_eq!(named, "127.0.0.1");
            port
        })
        .collect();
    assert!(ports.windows(2).all(|pair| pair[0] == pair[1]), "{ports:?}");
    // A program that is no server closes; the request goes on with the same or another port.
    drop(TcpStream::connect(("127.0.0.1", ports[0])).unwrap());
    let stream = loop {
        let (n_bytes, _) = server.recv_from(&mut datagram).unwrap();
        let (_, port) = decode_request(&datagram[..n_bytes]).unwrap();
        if let Ok(stream) = TcpStream::connect(("127.0.0.1", port)) {
            break stream;
        }
    };
    let mut stream = stream;
    serve(&mut stream);
    client.until_running();
    client.stop();
}

#[test]
fn a_server_that_is_not_there_is_named_and_stopping_does_not_wait() {
    let free = UdpSocket::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let client = Client::start(&format!("Tracker0@{free}"));
    let changes = client.until(|change| change.fault.is_some());
    let fault = changes.last().unwrap().fault.clone().unwrap().to_string();
    assert!(fault.contains("does the VRPN server run"), "{fault}");
    client.stop();
    // One that is there and never connects back: a firewall, most likely.
    let silent = UdpSocket::bind("127.0.0.1:0").unwrap();
    let client = Client::start(&format!("Tracker0@{}", silent.local_addr().unwrap()));
    let changes = client.until(|change| change.fault.is_some());
    let fault = changes.last().unwrap().fault.clone().unwrap().to_string();
    assert!(
        fault.contains("firewall") && fault.contains("tcp://"),
        "{fault}"
    );
    client.stop();
    let client = Client::start("Tracker0@tcp://no.such.host.invalid");
    let changes = client.until(|change| change.fault.is_some());
    let change = changes.last().unwrap();
    assert_eq!(change.state, SessionState::Absent);
    assert!(matches!(change.fault, Some(Fault::Unreachable { .. })));
    client.stop();
}
