//! The whole serial path of each device: emulator, pseudo-terminal, port, session. No test sleeps: each waits for
//! an event with a deadline.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use nalgebra::{Point3, UnitQuaternion};
use tsukamu_devices::clock::Clock;
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::fault::Fault;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::cyberglove::session::CyberGloveSession;
use tsukamu_devices::glove::cyberglove::settings::{CyberGloveSettings, SensorCount};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::port::{Direction, PortEvent, PortSettings};
use tsukamu_devices::port_thread::PortThread;
use tsukamu_devices::session::{DeviceEvent, Session, SessionState, StateChange};
use tsukamu_devices::tracker::fastrak::session::FastrakSession;
use tsukamu_devices::tracker::fastrak::settings::FastrakSettings;

/// Longest wait for anything, on a machine that is busy with other tests.
const PATIENCE: Duration = Duration::from_secs(20);

/// A directory of this test's own, removed at its end.
struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("tsukamu-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn link(&self) -> PathBuf {
        self.0.join("device")
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A port's thread and the events that it delivers; when the reader is slow the newest are dropped.
struct Port {
    _thread: PortThread,
    events: Receiver<DeviceEvent>,
}

impl Port {
    fn open(path: &Path, session: impl Session + Send + 'static) -> Self {
        let (sender, events) = sync_channel(10_000);
        let settings = PortSettings {
            path: path.to_str().unwrap().to_owned(),
            bauds: vec![115_200, 9_600],
            raw: false,
        };
        let clock = Clock::new(Instant::now());
        let thread = PortThread::spawn(settings, Box::new(session), clock, move |event| {
            if let PortEvent::Device(event) = event {
                let _ = sender.try_send(event);
            }
        });
        Self {
            _thread: thread.unwrap(),
            events,
        }
    }

    /// The first answer that `look` gives to an event.
    fn wait_for<T>(&self, what: &str, look: impl Fn(&DeviceEvent) -> Option<T>) -> T {
        let end = Instant::now() + PATIENCE;
        let mut seen = Vec::new();
        loop {
            match self
                .events
                .recv_timeout(end.saturating_duration_since(Instant::now()))
            {
                Ok(event) => {
                    if let Some(found) = look(&event) {
                        return found;
                    }
                    seen.push(event);
                }
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                    seen.drain(..seen.len().saturating_sub(5));
                    panic!("waited for {what}; last events: {seen:?}");
                }
            }
        }
    }

    fn wait_for_state(&self, state: SessionState) -> Option<Fault> {
        self.wait_for(&format!("{state:?}"), |event| match event {
            DeviceEvent::State(change) if change.state == state => Some(change.fault.clone()),
            _ => None,
        })
    }
}

fn glove_session() -> CyberGloveSession {
    CyberGloveSession::new(CyberGloveSettings::default(), GloveCalibration::default())
}

#[test]
fn a_glove_on_a_terminal_survives_being_unplugged() {
    let place = Place::new("glove");
    let settings = PtySettings {
        link: Some(place.link()),
        ..PtySettings::default()
    };
    let emulator = CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right);
    let mut emulated = PtyEmulator::spawn(emulator, settings, |_, _| {}).unwrap();
    let port = Port::open(&place.link(), glove_session());
    let bent = |raw: u8| {
        move |event: &DeviceEvent| match event {
            DeviceEvent::Glove(reading) => reading
                .sensor(GloveSensor::RingPip)
                .filter(|sensor| sensor.raw == f64::from(raw) && reading.angles_valid)
                .map(|sensor| sensor.angle_rad),
            _ => None,
        }
    };
    emulated.with(|glove| glove.set_sensor(GloveSensor::RingPip, 60));
    let angle_rad = port.wait_for("a bent finger", bent(60));
    assert!((angle_rad.to_degrees() - 10.0).abs() < 1e-9);

    let first = emulated.path().to_path_buf();
    emulated.unplug();
    let fault = port.wait_for_state(SessionState::Absent);
    assert!(
        matches!(fault, Some(Fault::Unplugged { .. } | Fault::Missing { .. })),
        "{fault:?}"
    );
    assert!(!place.link().exists());
    emulated.with(|glove| glove.set_sensor(GloveSensor::RingPip, 80));
    let second = emulated.plug().unwrap();
    assert_eq!(std::fs::read_link(place.link()).unwrap(), second);
    port.wait_for_state(SessionState::Running);
    let angle_rad = port.wait_for("the finger after the plug", bent(80));
    assert!(
        (angle_rad.to_degrees() - 20.0).abs() < 1e-9,
        "{first:?} {second:?}"
    );
}

#[test]
fn a_tracker_on_a_terminal_survives_being_unplugged() {
    let place = Place::new("tracker");
    let settings = PtySettings {
        link: Some(place.link()),
        ..PtySettings::default()
    };
    let move_to = |tracker: &mut FastrakEmulator, x: f64| {
        tracker.set_pose(1, Point3::new(x, 0.1, 0.2), UnitQuaternion::identity());
    };
    let mut emulated = PtyEmulator::spawn(FastrakEmulator::new(), settings, |_, _| {}).unwrap();
    let session = FastrakSession::new(FastrakSettings::default());
    let port = Port::open(&place.link(), session);
    let at = |z: f64| {
        move |event: &DeviceEvent| match event {
            DeviceEvent::Tracker(reading) => reading
                .world_from_sensor()
                .filter(|pose| (pose.translation.z - z).abs() < 1e-6),
            _ => None,
        }
    };
    emulated.with(|tracker| move_to(tracker, 0.4));
    let pose = port.wait_for("a pose", at(-0.4));
    assert!((pose.translation.x - 0.1).abs() < 1e-6 && (pose.translation.y + 0.2).abs() < 1e-6);

    emulated.unplug();
    port.wait_for_state(SessionState::Absent);
    emulated.with(|tracker| move_to(tracker, 0.5));
    emulated.plug().unwrap();
    port.wait_for("the pose after the plug", at(-0.5));
}

#[test]
fn what_is_wrong_with_a_path_is_named() {
    let place = Place::new("paths");
    let file = place.0.join("file");
    std::fs::write(&file, "text").unwrap();
    type Check = fn(&Fault) -> bool;
    let cases: [(&Path, Check); 3] = [
        (&place.link(), |fault| {
            matches!(fault, Fault::Missing { .. })
        }),
        (&file, |fault| matches!(fault, Fault::NotSerial { .. })),
        (Path::new("/dev/null"), |fault| {
            matches!(fault, Fault::NotSerial { .. })
        }),
    ];
    for (path, check) in cases {
        let port = Port::open(path, glove_session());
        let fault = port.wait_for_state(SessionState::Absent).unwrap();
        assert!(check(&fault), "{fault:?}");
        assert!(fault.to_string().contains(path.to_str().unwrap()));
    }
}

#[test]
fn a_port_in_use_is_called_busy_and_taken_when_free() {
    let emulator = CyberGloveEmulator::new(SensorCount::Eighteen, Handedness::Right);
    let emulated = PtyEmulator::spawn(emulator, PtySettings::default(), |_, _| {}).unwrap();
    let first = Port::open(emulated.path(), glove_session());
    first.wait_for_state(SessionState::Running);
    let second = Port::open(emulated.path(), glove_session());
    let fault = second.wait_for_state(SessionState::Absent).unwrap();
    assert!(matches!(fault, Fault::Busy { .. }), "{fault:?}");
    drop(first);
    second.wait_for_state(SessionState::Running);
}

#[test]
fn a_silent_device_is_reopened_at_the_next_rate() {
    let mut emulator = FastrakEmulator::new();
    emulator.faults.freeze();
    let emulated = PtyEmulator::spawn(emulator, PtySettings::default(), |_, _| {}).unwrap();
    let session = FastrakSession::new(FastrakSettings::default());
    let port = Port::open(emulated.path(), session);
    let fault = port.wait_for_state(SessionState::Absent);
    assert_eq!(fault, Some(Fault::Silent { device: "Fastrak" }));
    emulated.with(|tracker| tracker.faults.thaw());
    port.wait_for_state(SessionState::Running);
}

#[test]
fn raw_bytes_and_states_are_delivered_and_stopping_is_quick() {
    let emulator = CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right);
    let bend = |now_ns: u64, glove: &mut CyberGloveEmulator| {
        glove.set_sensors(&[(now_ns / 10_000_000 % 200) as u8 + 20; 22]);
    };
    let emulated = PtyEmulator::spawn(emulator, PtySettings::default(), bend).unwrap();
    let (sender, received) = sync_channel(1_000);
    let settings = PortSettings {
        path: emulated.path().to_str().unwrap().to_owned(),
        bauds: Vec::new(),
        raw: true,
    };
    let thread = PortThread::spawn(
        settings,
        Box::new(glove_session()),
        Clock::new(Instant::now()),
        move |event| {
            let seen = match event {
                PortEvent::Raw {
                    direction, bytes, ..
                } => (Some(direction), bytes.to_vec(), None),
                PortEvent::Device(DeviceEvent::State(StateChange { state, .. })) => {
                    (None, Vec::new(), Some(state))
                }
                _ => return,
            };
            let _ = sender.try_send(seen);
        },
    )
    .unwrap();
    let mut sent = Vec::new();
    let mut said = Vec::new();
    let end = Instant::now() + PATIENCE;
    loop {
        let (direction, bytes, state) = received
            .recv_timeout(end.saturating_duration_since(Instant::now()))
            .unwrap();
        match direction {
            Some(Direction::Sent) => sent.extend(bytes),
            Some(Direction::Received) => said.extend(bytes),
            None => {}
        }
        if state == Some(SessionState::Running) {
            break;
        }
    }
    assert!(sent.starts_with(b"\x03?G?S"), "{sent:02X?}");
    assert!(
        said.windows(4).any(|part| part == b"?S\x16\0"),
        "{said:02X?}"
    );
    let begin = Instant::now();
    thread.stop();
    assert!(begin.elapsed() < Duration::from_secs(2));
    // The last thing that goes out makes the glove quiet.
    let last = received
        .try_iter()
        .filter(|(direction, ..)| *direction == Some(Direction::Sent))
        .last();
    assert_eq!(last.map(|(_, bytes, _)| bytes), Some(vec![3]));
}
