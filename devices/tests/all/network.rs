//! The whole way over sockets of this machine: datagrams, connections made and taken, what is lost and comes back.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tsukamu_devices::clock::Clock;
use tsukamu_devices::driver::Driver;
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::source::{SentHand, SourceEmulator, SourceKind};
use tsukamu_devices::emulate::udp::UdpEmulator;
use tsukamu_devices::fault::Fault;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::cyberglove::settings::{CyberGloveSettings, SensorCount};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::network::{self, LinkSettings};
use tsukamu_devices::port::{Direction, PortEvent};
use tsukamu_devices::port_thread::PortThread;
use tsukamu_devices::session::{DeviceEvent, SessionState, SessionStats};

/// Far more than anything takes on an idle machine.
const PATIENCE: Duration = Duration::from_secs(20);

/// More than a test waits through.
const MOST_EVENTS: usize = 100_000;

#[expect(clippy::large_enum_variant, reason = "a test has few of them")]
#[derive(Debug)]
enum Heard {
    Device(DeviceEvent),
    Stats(SessionStats),
    Raw(Direction, Vec<u8>),
}

struct Served {
    thread: PortThread,
    heard: Receiver<Heard>,
}

impl Served {
    fn at(place: &str, driver: &Driver) -> Self {
        let (tell, heard) = sync_channel(MOST_EVENTS);
        let settings = LinkSettings {
            place: place.parse().unwrap(),
            bauds: Vec::new(),
            raw: true,
        };
        let thread = network::spawn(
            settings,
            driver.session(GloveCalibration::default()),
            Clock::new(Instant::now()),
            move |event| {
                let heard = match event {
                    PortEvent::Device(event) => Heard::Device(event),
                    PortEvent::Stats(stats) => Heard::Stats(stats),
                    PortEvent::Raw {
                        direction, bytes, ..
                    } => Heard::Raw(direction, bytes.to_vec()),
                };
                // The test may have ended.
                let _ = tell.try_send(heard);
            },
        );
        Self {
            thread: thread.unwrap(),
            heard,
        }
    }

    /// The first event from now on that gives something.
    fn wait<T>(&self, what: &str, found: impl Fn(&Heard) -> Option<T>) -> T {
        let end = Instant::now() + PATIENCE;
        let mut last = None;
        loop {
            let rest = end.saturating_duration_since(Instant::now());
            match self.heard.recv_timeout(rest) {
                Ok(heard) => match found(&heard) {
                    Some(found) => return found,
                    None => {
                        if let Heard::Device(DeviceEvent::State(change)) = heard {
                            last = Some(change);
                        }
                    }
                },
                Err(_) => panic!("no {what}; last: {last:?}"),
            }
        }
    }

    fn wait_for_state(&self, state: SessionState) {
        self.wait(&format!("{state:?}"), |heard| match heard {
            Heard::Device(DeviceEvent::State(change)) if change.state == state => Some(()),
            _ => None,
        });
    }

    fn wait_for_fault(&self, what: &str, is_it: impl Fn(&Fault) -> bool) -> Fault {
        self.wait(what, |heard| match heard {
            Heard::Device(DeviceEvent::State(change)) => {
                change.fault.clone().filter(|fault| is_it(fault))
            }
            _ => None,
        })
    }

    fn wait_for_glove(&self, pip_rad: f64) {
        self.wait(&format!("hand with {pip_rad}"), |heard| match heard {
            Heard::Device(DeviceEvent::Glove(reading)) => reading
                .angle_rad(GloveSensor::IndexPip)
                .filter(|angle| (angle - pip_rad).abs() < 0.01),
            _ => None,
        });
    }

    /// Stops, and fails if that takes long.
    fn stop(self) {
        let start = Instant::now();
        self.thread.stop();
        assert!(
            start.elapsed() < Duration::from_secs(5),
            "{:?}",
            start.elapsed()
        );
    }
}

/// A port that nobody has.
fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().port()
}

fn sender(kind: SourceKind, port: u16, pip_rad: f64) -> UdpEmulator<SourceEmulator> {
    let mut emulator = SourceEmulator::new(kind);
    let mut sent = SentHand::flat();
    sent.angles[GloveSensor::IndexPip.slot()] = Some(pip_rad);
    emulator.set_hand(Handedness::Right, Some(sent));
    UdpEmulator::spawn(emulator, &format!("127.0.0.1:{port}"), |_, _| {}).unwrap()
}

#[test]
fn hands_arrive_as_datagrams_of_every_kind() {
    for (driver, kind) in [
        (Driver::Vmc, SourceKind::Vmc),
        (Driver::Rokoko(Default::default()), SourceKind::Rokoko),
        (Driver::Rokoko(Default::default()), SourceKind::RokokoLz4),
        (Driver::Udcap, SourceKind::Udcap),
    ] {
        let port = free_port();
        let served = Served::at(&format!("udp:{port}"), &driver);
        served.wait_for_state(SessionState::Querying);
        let emulator = sender(kind, port, 0.5);
        served.wait("raw datagram", |heard| match heard {
            Heard::Raw(Direction::Received, bytes) => (bytes.len() > 100).then_some(()),
            _ => None,
        });
        served.wait_for_state(SessionState::Running);
        served.wait_for_glove(0.5);
        emulator.set_unplugged(true);
        served.wait_for_fault("silence", |fault| {
            matches!(fault, Fault::NothingArrives { .. })
        });
        emulator.set_unplugged(false);
        served.wait_for_state(SessionState::Running);
        served.wait_for_glove(0.5);
        drop(emulator);
        served.stop();
    }
}

#[test]
fn bad_bytes_are_counted_and_good_frames_go_on() {
    let port = free_port();
    let served = Served::at(&format!("udp:{port}"), &Driver::Udcap);
    let emulator = sender(SourceKind::Udcap, port, 0.5);
    served.wait_for_glove(0.5);
    // Of 700 bytes half a dozen are bad, and some of those are digits only.
    emulator.spoil(0.01);
    served.wait("dropped records", |heard| match heard {
        Heard::Stats(stats) => (stats.dropped_records >= 5).then_some(()),
        _ => None,
    });
    emulator.spoil(0.0);
    served.wait_for_glove(0.5);
    served.stop();
}

#[test]
fn the_newest_of_two_senders_is_heard_and_the_other_told_of() {
    let port = free_port();
    let place = format!("udp:127.0.0.1:{port}");
    let served = Served::at(&place, &Driver::Vmc);
    let first = sender(SourceKind::Vmc, port, 0.25);
    served.wait_for_glove(0.25);
    let second = sender(SourceKind::Vmc, port, 0.75);
    served.wait_for_glove(0.75);
    let fault = served.wait_for_fault("complaint", |fault| {
        matches!(fault, Fault::SecondSender { .. })
    });
    assert!(fault.to_string().starts_with(&place), "{fault}");
    // From here on nothing of the first gets through.
    for _ in 0..50 {
        let pip = served.wait("hand", |heard| match heard {
            Heard::Device(DeviceEvent::Glove(reading)) => {
                Some(reading.angle_rad(GloveSensor::IndexPip).unwrap())
            }
            _ => None,
        });
        assert!((pip - 0.75).abs() < 0.01, "{pip}");
    }
    served.wait("refused datagrams", |heard| match heard {
        Heard::Stats(stats) => (stats.dropped_records > 0).then_some(()),
        _ => None,
    });
    drop(first);
    served.wait("end of the complaint", |heard| match heard {
        Heard::Device(DeviceEvent::State(change)) => change.fault.is_none().then_some(()),
        _ => None,
    });
    drop(second);
    served.stop();
}

#[test]
fn an_address_that_another_program_has_is_named_and_waited_for() {
    let other = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = other.local_addr().unwrap().port();
    let place = format!("udp:127.0.0.1:{port}");
    let served = Served::at(&place, &Driver::Vmc);
    let fault = served.wait_for_fault("busy address", |_| true);
    assert_eq!(fault, Fault::AddressInUse { place });
    drop(other);
    let _emulator = sender(SourceKind::Vmc, port, 0.5);
    served.wait_for_glove(0.5);
    served.stop();
}

#[test]
fn an_address_of_another_machine_cannot_be_had() {
    let served = Served::at("udp:192.0.2.1:39539", &Driver::Vmc);
    served.wait_for_fault("fault", |fault| matches!(fault, Fault::CannotBind { .. }));
    served.stop();
}

/// A glove at the other end of a connection, until it is dropped.
struct Glove {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Glove {
    fn on(mut stream: TcpStream, pip_count: u8) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let mut glove = CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right);
            let mut slots = [100; GloveSensor::N_SLOTS];
            slots[GloveSensor::IndexPip.slot()] = pip_count;
            glove.set_slots(&slots);
            stream
                .set_read_timeout(Some(Duration::from_millis(2)))
                .unwrap();
            let origin = Instant::now();
            let mut bytes = [0; 512];
            while !stopped.load(Ordering::Acquire) {
                let now_ns = origin.elapsed().as_nanos() as u64;
                match stream.read(&mut bytes) {
                    Ok(0) => return,
                    Ok(n_bytes) => glove.push(now_ns, &bytes[..n_bytes]),
                    Err(error)
                        if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                    Err(_) => return,
                }
                if stream.write_all(&glove.poll(now_ns)).is_err() {
                    return;
                }
            }
        });
        Self {
            stop,
            thread: Some(thread),
        }
    }
}

impl Drop for Glove {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn cyberglove() -> Driver {
    Driver::CyberGlove(CyberGloveSettings::default())
}

/// The angle of a count by the glove's own defaults: half a degree, 0 at 40.
fn angle_of(count: u8) -> f64 {
    (0.5 * (f64::from(count) - 40.0)).to_radians()
}

#[test]
fn a_glove_behind_a_serial_server_is_found_lost_and_found_again() {
    let port = free_port();
    let served = Served::at(&format!("tcp:localhost:{port}"), &cyberglove());
    served.wait_for_fault("refusal", |fault| {
        matches!(fault, Fault::Unreachable { .. })
    });
    let listener = TcpListener::bind(("127.0.0.1", port)).unwrap();
    for count in [60, 120, 180] {
        let (stream, _) = listener.accept().unwrap();
        let glove = Glove::on(stream, count);
        served.wait_for_glove(angle_of(count));
        drop(glove);
        served.wait_for_fault("loss", |fault| matches!(fault, Fault::Disconnected { .. }));
    }
    served.stop();
}

#[test]
fn a_glove_that_connects_is_served_and_a_newer_connection_replaces_it() {
    let port = free_port();
    let served = Served::at(&format!("tcp-listen:{port}"), &cyberglove());
    served.wait_for_fault("nobody", |fault| {
        matches!(fault, Fault::NobodyConnected { .. })
    });
    let connect = || TcpStream::connect(("127.0.0.1", port)).unwrap();
    let first = Glove::on(connect(), 60);
    served.wait_for_glove(angle_of(60));
    drop(first);
    served.wait_for_fault("loss", |fault| matches!(fault, Fault::Disconnected { .. }));
    // It comes back, and is then reset without a word: the old connection stays open.
    let _dead = Glove::on(connect(), 120);
    served.wait_for_glove(angle_of(120));
    let _alive = Glove::on(connect(), 180);
    served.wait_for_glove(angle_of(180));
    served.stop();
}

#[test]
fn whoever_waits_for_a_device_stops_at_once() {
    let port = free_port();
    for (place, driver) in [
        (format!("udp:{port}"), Driver::Vmc),
        (format!("tcp-listen:{port}"), cyberglove()),
        // Nobody answers there at all.
        (format!("tcp:192.0.2.1:{port}"), cyberglove()),
        (format!("tcp:no-such-host.invalid:{port}"), cyberglove()),
        (format!("tcp:127.0.0.1:{port}"), cyberglove()),
    ] {
        let served = Served::at(&place, &driver);
        served.wait_for_state(SessionState::Opening);
        served.stop();
    }
}
