//! A glove and a tracker on pseudo-terminals, from their bytes to frames.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Point3, UnitQuaternion};
use tonic::Streaming;
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::cyberglove::settings::{CyberGloveSettings, SensorCount};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::tracker::fastrak::settings::FastrakSettings;
use tsukamu_proto::v1;
use tsukamu_proto::v1::event::Kind;
use tsukamu_server::daemon::start;
use tsukamu_server::settings::Mode;
use tsukamu_server::settings::device::{DeviceKind, DeviceSettings};
use tsukamu_server::settings::hand::HandSettings;
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::skeleton::HandModel;

use super::support::{config, connect, cubes, next, next_frame, soon, watch, world};

/// A folder of its own for the links to the terminals.
fn folder() -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("daemon-serial");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn line(link: &Path) -> PtySettings {
    PtySettings {
        link: Some(link.to_owned()),
        ..PtySettings::default()
    }
}

fn devices(folder: &Path) -> Vec<DeviceSettings> {
    let device = |name: &str, kind| DeviceSettings {
        name: name.to_owned(),
        port: folder.join(name).display().to_string(),
        bauds: vec![115_200],
        kind,
    };
    let glove = DeviceKind::CyberGlove {
        settings: CyberGloveSettings::default(),
        calibration: Box::new(GloveCalibration::default()),
    };
    let tracker = DeviceKind::Fastrak {
        settings: FastrakSettings::default(),
        world_from_transmitter: Isometry3::translation(0.0, 1.0, 0.0),
    };
    vec![device("glove", glove), device("tracker", tracker)]
}

fn hand() -> HandSettings {
    HandSettings {
        name: "right".to_owned(),
        glove: 0,
        tracker: 1,
        station: 1,
        model: HandModel::adult(Side::Right),
        filter: None,
    }
}

/// Waits for a frame in which the hand is tracked and stands as wanted.
async fn hand_where(
    frames: &mut Streaming<v1::WatchFramesResponse>,
    is_wanted: impl Fn(&v1::HandFrame) -> bool,
) {
    let found = async {
        loop {
            let frame = next_frame(frames, &mut 0).await;
            let hand = frame
                .hands
                .iter()
                .find(|hand| hand.tracking() == v1::Tracking::Tracked);
            if hand.is_some_and(&is_wanted) {
                return;
            }
        }
    };
    soon(found).await;
}

fn wrist(hand: &v1::HandFrame) -> [f64; 3] {
    let at = hand
        .wrist
        .and_then(|wrist| wrist.position)
        .expect("a wrist");
    [at.x, at.y, at.z]
}

fn is_at(hand: &v1::HandFrame, place: [f64; 3]) -> bool {
    wrist(hand)
        .iter()
        .zip(place)
        .all(|(found, wanted)| (found - wanted).abs() < 1e-3)
}

async fn event_where(events: &mut Streaming<v1::Event>, is_wanted: impl Fn(&Kind) -> bool) {
    while !next(events).await.kind.is_some_and(|kind| is_wanted(&kind)) {}
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_glove_and_a_tracker_make_a_hand_and_come_back_after_unplugging() {
    let folder = folder();
    let glove = CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right);
    let mut glove =
        PtyEmulator::spawn(glove, line(&folder.join("glove")), |_, _| {}).expect("a terminal");
    let mut tracker = FastrakEmulator::new();
    tracker.set_pose(1, Point3::new(0.3, 0.1, -0.2), UnitQuaternion::identity());
    let mut tracker =
        PtyEmulator::spawn(tracker, line(&folder.join("tracker")), |_, _| {}).expect("a terminal");

    let mut config = config(cubes(0, 240.0), Mode::Realtime);
    config.devices = devices(&folder);
    config.hands = vec![hand()];
    let daemon = start(config).await.expect("it starts");
    let mut client = world(&daemon).await;
    let mut frames = watch(&mut client, 0.0).await;
    let mut events = soon(client.watch_events(v1::WatchEventsRequest { from_sequence: 1 }))
        .await
        .expect("a stream")
        .into_inner();
    // Transmitter x, y, z are world -z, x, -y; the transmitter is 1 m up.
    hand_where(&mut frames, |hand| is_at(hand, [0.1, 1.2, -0.3])).await;
    let tip_y = |hand: &v1::HandFrame| hand.tracked[7 * 3 + 1];
    tracker
        .with(|device| device.set_pose(1, Point3::new(0.5, 0.1, -0.2), UnitQuaternion::identity()));
    hand_where(&mut frames, |hand| is_at(hand, [0.1, 1.2, -0.5])).await;
    // Bending the index finger at its knuckle takes its tip down; 40 counts are a straight joint, 220 a right angle.
    glove.with(|device| device.set_sensor(GloveSensor::IndexMcp, 40));
    hand_where(&mut frames, |hand| tip_y(hand) > 1.15).await;
    glove.with(|device| device.set_sensor(GloveSensor::IndexMcp, 220));
    hand_where(&mut frames, |hand| tip_y(hand) < 1.14).await;

    glove.unplug();
    tracker.unplug();
    event_where(&mut events, |kind| matches!(kind, Kind::HandLost(_))).await;
    let mut health = v1::devices_client::DevicesClient::new(connect(&daemon).await);
    let rows = soon(health.list_devices(v1::ListDevicesRequest {}))
        .await
        .expect("a list")
        .into_inner()
        .devices;
    assert_eq!(
        rows.iter().map(|row| row.name.as_str()).collect::<Vec<_>>(),
        ["glove", "tracker", "right"]
    );
    assert!(
        rows.iter()
            .take(2)
            .all(|row| row.state != "running" && !row.error.is_empty()),
        "{rows:?}"
    );
    assert!(rows.iter().all(|row| row.samples > 0), "{rows:?}");
    tracker
        .with(|device| device.set_pose(1, Point3::new(0.4, 0.1, -0.2), UnitQuaternion::identity()));
    glove.plug().expect("a terminal");
    tracker.plug().expect("a terminal");
    event_where(&mut events, |kind| matches!(kind, Kind::HandFound(_))).await;
    hand_where(&mut frames, |hand| is_at(hand, [0.1, 1.2, -0.4])).await;
    daemon.shutdown().await.expect("a clean end");
}
