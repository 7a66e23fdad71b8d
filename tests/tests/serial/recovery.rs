//! A glove's cable is pulled three times: it comes back by itself and soon, the tracker loses nothing by it, and nobody
//! is told more than once. What waited is not played late.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use nalgebra::{Point3, UnitQuaternion};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Level, Metadata, Subscriber};
use tsukamu_client::connect::{Client, ConnectOptions};
use tsukamu_client::event_watch::{EventUpdate, EventWatch};
use tsukamu_client::subscribe::{FrameOptions, FrameUpdate, FrameWatch};
use tsukamu_client::view::{HandView, Joints};
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::glove::calibrate::Handedness;
use tsukamu_devices::glove::cyberglove::settings::SensorCount;
use tsukamu_proto::v1;
use tsukamu_proto::v1::event::Kind;
use tsukamu_server::daemon::{Daemon, start};

use crate::rig::{Folder, config};

/// Longest that a test waits for anything: far beyond what it takes on a loaded machine.
const DEADLINE: Duration = Duration::from_secs(30);
/// From the moment an unplugged device answers again to its first sample at a subscriber, beyond its own start-up.
const BACK_MAX: Duration = Duration::from_secs(1);
/// Counts of a hand that is nearly flat, and of one that is bent.
const FLAT: u8 = 80;
const BENT: u8 = 150;
/// Joints that are this near to one another are the same, metres.
const SAME_M: f64 = 0.004;

/// What a device hears and says.
#[derive(Debug, Default)]
struct Line {
    n_bytes_said: u64,
    first_heard: Option<Instant>,
    last_heard: Option<Instant>,
}

/// A device with an ear on its line.
#[derive(Clone, Debug)]
struct Overheard<E> {
    device: E,
    line: Arc<Mutex<Line>>,
}

impl<E: Emulator> Emulator for Overheard<E> {
    fn push(&mut self, now_ns: u64, bytes: &[u8]) {
        if !bytes.is_empty() {
            let mut line = lock(&self.line);
            line.first_heard.get_or_insert_with(Instant::now);
            line.last_heard = Some(Instant::now());
        }
        self.device.push(now_ns, bytes);
    }

    fn poll(&mut self, now_ns: u64) -> Vec<u8> {
        let said = self.device.poll(now_ns);
        lock(&self.line).n_bytes_said += said.len() as u64;
        said
    }

    fn deadline(&self) -> Option<u64> {
        self.device.deadline()
    }
}

fn lock<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A glove and a tracker on terminals of their own, and a daemon that reads them.
struct Lab {
    glove: PtyEmulator<Overheard<CyberGloveEmulator>>,
    glove_line: Arc<Mutex<Line>>,
    tracker: PtyEmulator<Overheard<FastrakEmulator>>,
    tracker_line: Arc<Mutex<Line>>,
    daemon: Daemon,
    client: Client,
    _folder: Folder,
}

impl Lab {
    /// Devices carry the name of the test, so that its log lines are known.
    async fn new(name: &str) -> Self {
        let folder = Folder::new(name);
        let plug = |name: &str| PtySettings {
            link: Some(folder.file(name)),
            ..PtySettings::default()
        };
        let (glove_line, tracker_line) = <(Arc<Mutex<Line>>, Arc<Mutex<Line>>)>::default();
        let mut glove = Overheard {
            device: CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right),
            line: Arc::clone(&glove_line),
        };
        glove.device.set_sensors(&[FLAT; 22]);
        let glove = PtyEmulator::spawn(glove, plug("glove"), |_, _| {}).unwrap();
        let mut tracker = Overheard {
            device: FastrakEmulator::new(),
            line: Arc::clone(&tracker_line),
        };
        let place = Point3::new(0.2, 0.1, -0.2);
        tracker
            .device
            .set_pose(2, place, UnitQuaternion::identity());
        let tracker = PtyEmulator::spawn(tracker, plug("tracker"), |_, _| {}).unwrap();
        let mut config = config(&folder, "operations/free", 22);
        for device in &mut config.devices {
            device.name = format!("{name} {}", device.name);
        }
        let daemon = start(config).await.unwrap();
        let address = format!("http://{}", daemon.local_addr());
        let options = ConnectOptions {
            address,
            ..ConnectOptions::default()
        };
        let client = Client::connect(options).await.unwrap();
        Self {
            glove,
            glove_line,
            tracker,
            tracker_line,
            daemon,
            client,
            _folder: folder,
        }
    }

    fn bend(&self, raw: u8) {
        self.glove
            .with(|glove| glove.device.set_sensors(&[raw; 22]));
    }

    /// The row of the device whose name ends so.
    async fn row(&self, ending: &str) -> v1::Device {
        let request = v1::ListDevicesRequest {};
        let answer = self.client.devices().list_devices(request).await.unwrap();
        let rows = answer.into_inner().devices;
        let row = rows.into_iter().find(|row| row.name.ends_with(ending));
        row.expect("it is on the list")
    }

    /// Waits for a row that will do.
    async fn row_that(&self, ending: &str, will_do: impl Fn(&v1::Device) -> bool) -> v1::Device {
        let devices = v1::WatchDevicesRequest {};
        let stream = self.client.devices().watch_devices(devices).await.unwrap();
        let mut stream = stream.into_inner();
        let find = async {
            loop {
                let list = stream.message().await.unwrap().expect("it goes on");
                let row = list
                    .devices
                    .into_iter()
                    .find(|row| row.name.ends_with(ending));
                if let Some(row) = row.filter(&will_do) {
                    return row;
                }
            }
        };
        match tokio::time::timeout(DEADLINE, find).await {
            Ok(row) => row,
            Err(_) => panic!("not within {DEADLINE:?}: {:?}", self.row(ending).await),
        }
    }

    async fn frames(&self) -> FrameWatch {
        FrameWatch::open(&self.client, FrameOptions::default())
            .await
            .unwrap()
    }

    /// Every kind of event so far that is about a device, with that device.
    async fn device_events(&self) -> Vec<(&'static str, String)> {
        // What was told before this is in the log when this is.
        let reset = self.client.control().reset(v1::ResetRequest {}).await;
        reset.unwrap();
        let mut events = EventWatch::open(&self.client, 1).await.unwrap();
        let mut found = Vec::new();
        loop {
            let event = tokio::time::timeout(DEADLINE, events.next()).await.unwrap();
            let EventUpdate::Event(event) = event.unwrap() else {
                panic!("the event lane has a hole");
            };
            match event.kind {
                Some(Kind::DeviceLost(lost)) => {
                    assert!(lost.reason.contains("unplugged"), "{lost:?}");
                    found.push(("lost", lost.device));
                }
                Some(Kind::DeviceReturned(back)) => {
                    assert!((0.0..30.0).contains(&back.absent_s), "{back:?}");
                    found.push(("returned", back.device));
                }
                Some(Kind::Reset(_)) => return found,
                _ => {}
            }
        }
    }
}

/// The first hand of a frame that will do.
async fn hand_that(
    frames: &mut FrameWatch,
    mut will_do: impl FnMut(&HandView) -> bool,
) -> HandView {
    let find = async {
        loop {
            match frames.next().await.unwrap() {
                FrameUpdate::Frame { .. } | FrameUpdate::Skipped(_) => {}
                other => panic!("the frame lane: {other:?}"),
            }
            let hand = frames.view().and_then(|view| view.hands.first());
            if let Some(hand) = hand.filter(|hand| will_do(hand)) {
                return hand.clone();
            }
        }
    };
    tokio::time::timeout(DEADLINE, find).await.unwrap()
}

/// How far apart two sets of joints are at most, metres.
fn apart_m(a: &Joints, b: &Joints) -> f64 {
    let pairs = a.iter().zip(b);
    let distances = pairs.filter_map(|(a, b)| Some((a.as_ref()? - b.as_ref()?).norm()));
    distances.fold(0.0, f64::max)
}

fn is_tracked(hand: &HandView) -> bool {
    hand.tracking == v1::Tracking::Tracked
}

#[tokio::test(flavor = "multi_thread")]
async fn a_glove_that_is_plugged_in_again_is_back_at_once_and_costs_the_tracker_nothing() {
    // Nobody else in this program listens.
    tracing::subscriber::set_global_default(Listener).unwrap();
    let mut lab = Lab::new("recovery").await;
    let mut frames = lab.frames().await;
    let mut shown = hand_that(&mut frames, is_tracked).await.tracked;
    let mut took = Vec::new();
    for round in 0..3 {
        lab.glove.unplug();
        let row = lab.row_that("glove", |row| row.state == "absent").await;
        assert_eq!(row.losses, round + 1, "{row:?}");
        assert!(row.warnings.is_empty(), "a loss says all: {row:?}");
        // It stays out for a while, in which the tracker goes on.
        let n_before = lab.row("tracker").await.samples;
        lab.row_that("tracker", |row| row.samples > n_before + 150)
            .await;
        // The fingers change while the cable is out: only a new sample can show it.
        lab.bend(if round % 2 == 0 { BENT } else { FLAT });
        *lock(&lab.glove_line) = Line::default();
        lab.glove.plug().unwrap();
        let plugged = Instant::now();
        let is_new = |hand: &HandView| is_tracked(hand) && apart_m(&hand.tracked, &shown) > SAME_M;
        shown = hand_that(&mut frames, is_new).await.tracked;
        let whole = plugged.elapsed();
        let (first, last) = {
            let line = lock(&lab.glove_line);
            (line.first_heard.unwrap(), line.last_heard.unwrap())
        };
        // Between the first command and the last the device is being started, at its own pace.
        let beyond = whole - (last - first);
        println!(
            "plugged in -> shown: {whole:?}, of which start-up {:?}",
            last - first
        );
        took.push(beyond);
        // Let it settle, so that the next frame is not that of the fingers on their way.
        shown = hand_that(&mut frames, |hand| apart_m(&hand.tracked, &shown) < 1e-9)
            .await
            .tracked;
    }
    took.sort();
    println!("beyond the device's own start-up: {took:?}");
    // The machine may be busy with other things once.
    assert!(took[1] < BACK_MAX, "{took:?}");

    let events = lab.device_events().await;
    let name = || "recovery glove".to_owned();
    let expected = [("lost", name()), ("returned", name())];
    let expected: Vec<_> = expected.iter().cycle().take(6).cloned().collect();
    assert_eq!(events, expected, "the tracker never went");
    all_delivered(&lab).await;
    let lines = lock(&LOG).clone();
    let of_glove = |message: &str| lines.get(&(name(), message.to_owned())).copied();
    assert_eq!(of_glove("device lost"), Some(3), "{lines:?}");
    assert_eq!(of_glove("device is back"), Some(3), "{lines:?}");
    let n_lines: usize = lines
        .iter()
        .filter(|((of, _), _)| *of == name())
        .map(|(_, n)| n)
        .sum();
    // Once identified and once running at the start; warnings of a busy machine are no part of this.
    let n_warnings =
        of_glove("device warning").unwrap_or(0) + of_glove("device warning is over").unwrap_or(0);
    assert_eq!(n_lines - n_warnings, 8, "{lines:?}");
    lab.daemon.shutdown().await.unwrap();
}

/// Every byte that the tracker said has arrived, and every record is a sample.
async fn all_delivered(lab: &Lab) {
    let meanwhile = lab.row("tracker").await;
    lab.tracker.with(|tracker| tracker.device.faults.freeze());
    let said = lock(&lab.tracker_line).n_bytes_said;
    let row = lab.row_that("tracker", |row| row.bytes >= said).await;
    assert_eq!(
        (row.bytes, row.dropped, row.resyncs),
        (said, 0, 0),
        "{row:?}"
    );
    assert!(row.samples > 450, "{row:?}");
    let n_gaps: u64 = row.gap_counts.iter().sum();
    assert_eq!(n_gaps + 1, row.samples, "each gap is in one class: {row:?}");
    println!(
        "the tracker meanwhile: {} samples, longest gap {:.3} s, jitter {:.4} s",
        meanwhile.samples, meanwhile.longest_gap_s, meanwhile.jitter_s
    );
    let clock = row.clock.expect("a device has a clock");
    assert!(
        ["even", "arrival"].contains(&clock.kind.as_str()),
        "{clock:?}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn what_came_while_the_world_stood_still_is_not_played_afterwards() {
    let lab = Lab::new("standstill").await;
    let mut frames = lab.frames().await;
    let flat = hand_that(&mut frames, is_tracked).await.tracked;
    let mut control = lab.client.control();
    let paused = control
        .pause(v1::PauseRequest {})
        .await
        .unwrap()
        .into_inner();
    let paused_at = paused.stamp.expect("each answer has one").world_time_s;
    // A fist and back, all of it while nothing moves.
    for raw in [BENT, FLAT] {
        lab.bend(raw);
        let n_before = lab.row("glove").await.samples;
        lab.row_that("glove", |row| row.samples > n_before + 50)
            .await;
    }
    control.resume(v1::ResumeRequest {}).await.unwrap();
    let mut farthest_m: f64 = 0.0;
    loop {
        let hand = hand_that(&mut frames, is_tracked).await;
        farthest_m = farthest_m.max(apart_m(&hand.tracked, &flat));
        let now = frames.view().expect("a frame").stamp.world_time_s;
        if now > paused_at + 1.0 {
            break;
        }
    }
    assert!(farthest_m < SAME_M, "the fist was shown: {farthest_m} m");
    lab.daemon.shutdown().await.unwrap();
}

/// Lines of the log of this process from INFO on, by device and message.
static LOG: Mutex<BTreeMap<(String, String), usize>> = Mutex::new(BTreeMap::new());

struct Listener;

impl Subscriber for Listener {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() <= Level::INFO
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &tracing::Event<'_>) {
        let mut line = LogLine::default();
        event.record(&mut line);
        if let Some(device) = line.device {
            *lock(&LOG).entry((device, line.message)).or_default() += 1;
        }
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

#[derive(Default)]
struct LogLine {
    device: Option<String>,
    message: String,
}

impl Visit for LogLine {
    fn record_str(&mut self, field: &Field, value: &str) {
        if field.name() == "device" {
            self.device = Some(value.to_owned());
        }
    }

    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            self.message = format!("{value:?}");
        }
    }
}
