//! Every kind and model of `tsukamud emulate`, plugged into a terminal and read by the driver that the settings printed
//! with it ask for: what the emulated hand does is what is read, through noise and pulled cables.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

use nalgebra::Isometry3;
use tsukamu_devices::clock::Clock;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::glove::quick_range::usual_range_deg;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::port::{PortEvent, PortSettings};
use tsukamu_devices::port_thread::PortThread;
use tsukamu_devices::reading::GloveReading;
use tsukamu_devices::session::{DeviceEvent, SessionState};
use tsukamu_motion::synthetic::{SceneInfo, build};
use tsukamu_server::emulate::kinds::{KINDS, Kind};
use tsukamu_server::emulate::{Played, Plug, Plugged, TrackerPlace, Worn};
use tsukamu_server::offline::hands::Motion;
use tsukamu_server::scene_file::load;
use tsukamu_server::settings::overrides::Overrides;
use tsukamu_server::settings::parse;

/// Longest wait for anything, on a machine that is busy with other tests.
const PATIENCE: Duration = Duration::from_secs(60);
/// Rounding of 8 bits to the nearest, as a share of a finger's bend.
const BEND_TOLERANCE: f64 = 0.01;
/// Rounding of the coarsest tracker, 14 bits of 0.9 m, and of its angles, m and rad.
const POSE_TOLERANCE: f64 = 0.002;
/// Kinds that come as datagrams, and have no terminal.
const ON_NETWORK: [&str; 3] = ["vmc", "rokoko", "udcap"];

/// An emulated device and the thread that reads it.
struct Pair {
    name: String,
    plugged: Box<dyn Plugged>,
    _thread: PortThread,
    events: Receiver<DeviceEvent>,
    link: PathBuf,
}

impl Drop for Pair {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.link);
    }
}

/// A hand that stays as it is at its beginning.
fn still_hand() -> Played {
    let scene = load("operations/free").expect("a built-in scene").scene;
    let hand = build("free?start=600", &SceneInfo::from(&scene)).expect("a synthetic hand");
    Played {
        motion: Motion::Synthetic(Box::new(hand)),
        repeats: false,
    }
}

impl Pair {
    fn new(kind: &Kind, model: &'static str, played: &Played) -> Self {
        let name = format!("{}-{model}", kind.name);
        let file = format!("tsukamu-emulated-{name}-{}", std::process::id());
        let link = std::env::temp_dir().join(file);
        let plugged = (kind.spawn)(Worn {
            played: played.clone(),
            calibration: GloveCalibration::default(),
            place: TrackerPlace::default(),
            model,
            to: None,
            plug: Plug {
                link: Some(link.clone()),
                baud: Some((kind.baud)(model)),
            },
        })
        .expect("a pseudo-terminal");
        let text = format!(
            "[[device]]\nname = 'x'\nkind = {:?}\nport = {:?}\n{}",
            kind.name,
            link.display().to_string(),
            (kind.settings)(model)
        );
        let settings = parse("test.toml", &text, Path::new(""), &Overrides::default())
            .unwrap_or_else(|mistakes| panic!("{mistakes}"));
        let device = &settings.devices[0];
        let port = PortSettings {
            path: link.display().to_string(),
            bauds: device.bauds.clone(),
            raw: false,
        };
        let session = device.driver.session(GloveCalibration::default());
        let (sender, events) = sync_channel(100_000);
        let clock = Clock::new(Instant::now());
        let thread = PortThread::spawn(port, session, clock, move |event| {
            if let PortEvent::Device(event) = event {
                // A reader that is so slow has seen enough.
                let _ = sender.try_send(event);
            }
        });
        Self {
            name,
            plugged,
            _thread: thread.expect("a thread"),
            events,
            link,
        }
    }

    /// Waits for an event.
    fn wait_for(&self, what: &str, suits: impl Fn(&DeviceEvent) -> bool) {
        let end = Instant::now() + PATIENCE;
        let mut states = Vec::new();
        loop {
            let rest = end.saturating_duration_since(Instant::now());
            match self.events.recv_timeout(rest) {
                Ok(event) if suits(&event) => return,
                Ok(DeviceEvent::State(change)) => states.push(change),
                Ok(_) => {}
                Err(fault) => panic!("{}: waited for {what}: {fault}; {states:?}", self.name),
            }
        }
    }

    fn wait_for_state(&self, state: SessionState) {
        self.wait_for(
            &format!("{state:?}"),
            |event| matches!(event, DeviceEvent::State(change) if change.state == state),
        );
    }
}

/// How far a finger is bent, 0 to 1: the mean of its two main joints, which a simple glove cannot tell apart.
fn bend(angle_rad: impl Fn(GloveSensor) -> Option<f64>, joints: [GloveSensor; 2]) -> Option<f64> {
    let mut sum = 0.0;
    for joint in joints {
        let (min_deg, max_deg) = usual_range_deg(joint);
        sum += (angle_rad(joint)?.to_degrees() - min_deg) / (max_deg - min_deg);
    }
    Some(sum / 2.0)
}

fn is_the_hand(reading: &GloveReading, played: &Played) -> bool {
    let angles = played.sensor_angles_at(0).expect("all joints are computed");
    let fingers = [
        [GloveSensor::IndexMcp, GloveSensor::IndexPip],
        [GloveSensor::RingMcp, GloveSensor::RingPip],
    ];
    fingers.into_iter().all(|joints| {
        let read = bend(|joint| reading.angle_rad(joint), joints);
        let worn = bend(|joint| angles[joint.slot()], joints);
        read.zip(worn)
            .is_some_and(|(read, worn)| (read - worn).abs() < BEND_TOLERANCE)
    })
}

fn is_the_wrist(world_from_sensor: &Isometry3<f64>, played: &Played) -> bool {
    let wrist = played.sample_at(0).expect("the hand is tracked").wrist;
    let between = wrist.inverse() * world_from_sensor;
    between.translation.vector.norm() < POSE_TOLERANCE && between.rotation.angle() < POSE_TOLERANCE
}

fn is_right(event: &DeviceEvent, played: &Played) -> bool {
    match event {
        DeviceEvent::Glove(reading) => is_the_hand(reading, played),
        DeviceEvent::Tracker(reading) => {
            let pose = reading.world_from_sensor();
            reading.station == 1 && pose.is_some_and(|pose| is_the_wrist(&pose, played))
        }
        _ => false,
    }
}

#[test]
fn every_emulated_device_is_read_by_its_driver() {
    let played = Arc::new(still_hand());
    let models = KINDS
        .iter()
        .filter(|kind| !ON_NETWORK.contains(&kind.name))
        .flat_map(|kind| kind.models.iter().map(move |model| (kind, *model)));
    let mut pairs: Vec<Pair> = models
        .map(|(kind, model)| Pair::new(kind, model, &played))
        .collect();
    for pair in &pairs {
        pair.wait_for("what the hand does", |event| is_right(event, &played));
    }
    for pair in &mut pairs {
        pair.plugged.spoil(0.01);
        pair.plugged.unplug();
    }
    for pair in &mut pairs {
        pair.wait_for_state(SessionState::Absent);
        pair.plugged.plug().expect("a pseudo-terminal");
    }
    for pair in &pairs {
        pair.wait_for_state(SessionState::Running);
        pair.wait_for("it again", |event| is_right(event, &played));
    }
}
