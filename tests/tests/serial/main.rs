//! The whole way: bytes of a glove and a tracker on two serial ports, at the pace of 115200 bit/s → hand → world →
//! frames and events over gRPC → a client.

#![allow(
    clippy::unwrap_used,
    reason = "a test ends where what it stands on is missing"
)]
#![allow(
    clippy::print_stdout,
    reason = "measured figures, for whoever runs with --nocapture"
)]

mod calibrate;
mod drivers;
mod drivers_held;
mod drivers_kinds;
mod drivers_lab;
mod drivers_ordeal;
mod drivers_vrpn;
mod feedback;
mod probe;
mod recovery;
mod rig;
mod seen;
mod sources;

use std::io::BufReader;
use std::path::Path;

use tsukamu_devices::glove::cyberglove::settings::SensorCount;
use tsukamu_proto::v1::ReleaseReason;
use tsukamu_proto::v1::event::Kind;
use tsukamu_server::daemon::start;
use tsukamu_server::emulate::cyberglove::spawn_cyberglove;
use tsukamu_server::emulate::fastrak::spawn_fastrak;
use tsukamu_server::emulate::{Played, Plug};
use tsukamu_server::offline::hands::Motion;
use tsukamu_server::record::reader::{self, Ending};
use tsukamu_server::record::verify::verify;
use tsukamu_server::recorder_handle::RecordItem;

use crate::rig::{Folder, Worn, calibration, config, hand, place};
use crate::seen::Seen;

/// How far an object must be carried to count as moved, metres.
const MOVED_M: f64 = 0.05;
/// Half a degree per count and an 18-bit tracker must put the wrist this near to where it is, metres.
const WRIST_ERROR_MAX_M: f64 = 0.001;

fn is_released_by_the_hand(kind: &Kind) -> bool {
    let lost = i32::from(ReleaseReason::TrackingLost);
    matches!(kind, Kind::Released(released) if released.reason != lost)
}

fn is_released_by_loss(kind: &Kind) -> bool {
    let lost = i32::from(ReleaseReason::TrackingLost);
    matches!(kind, Kind::Released(released) if released.reason == lost)
}

/// Raw bytes of a device in a recording.
fn n_raw_bytes(path: &Path, device: &str) -> usize {
    let records = reader::open(path).unwrap();
    let bytes = records.map(|record| match record.item {
        RecordItem::Raw(raw) if raw.device == device => raw.bytes.len(),
        _ => 0,
    });
    bytes.sum()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_glove_and_a_tracker_carry_an_object_and_recover_from_unplugging() {
    let folder = Folder::new("unplugging");
    let mut worn = Worn::new(&folder, SensorCount::TwentyTwo, "free");
    let daemon = start(config(&folder, "operations/free", 22)).await.unwrap();
    let mut seen = Seen::connect(&daemon).await;
    seen.devices_become("running").await;
    seen.event(|kind| matches!(kind, Kind::HandFound(_))).await;
    seen.record("session.mcap").await;

    // The object is grasped, moved and let go.
    let error = (seen.wrist().await.translation.vector - worn.wrist().translation.vector).norm();
    assert!(error < WRIST_ERROR_MAX_M, "the wrist is {error} m off");
    worn.stage.begin();
    seen.event(|kind| matches!(kind, Kind::Grasped(_))).await;
    seen.carried(MOVED_M).await;
    seen.event(is_released_by_the_hand).await;
    seen.event(|kind| matches!(kind, Kind::Rested(_))).await;

    // Both cables are pulled while the object is held: the hand is lost, and lets go.
    seen.reset().await;
    worn.stage.begin();
    seen.event(|kind| matches!(kind, Kind::Grasped(_))).await;
    seen.carried(MOVED_M).await;
    worn.unplug();
    seen.event(|kind| matches!(kind, Kind::HandLost(_))).await;
    seen.event(is_released_by_loss).await;
    seen.devices_become("absent").await;

    // Plugged in again, on other terminals, all goes on by itself.
    worn.stage.rest();
    worn.plug();
    seen.devices_become("running").await;
    seen.event(|kind| matches!(kind, Kind::HandFound(_))).await;
    seen.reset().await;
    worn.stage.begin();
    seen.event(|kind| matches!(kind, Kind::Grasped(_))).await;
    seen.carried(MOVED_M).await;
    seen.event(is_released_by_the_hand).await;

    seen.stop_recording().await;
    daemon.shutdown().await.unwrap();
    proves(&folder.file("session.mcap"));
}

/// The recording verifies, from its start to its end, and holds the bytes of both ports.
fn proves(path: &Path) {
    let found = verify::<BufReader<_>>(reader::open(path).unwrap(), |_| {});
    assert_eq!(found.fault, None);
    assert_eq!(found.ending, Some(Ending::Complete));
    assert!(found.digests > 0, "{found:?}");
    for device in ["glove", "tracker"] {
        assert!(n_raw_bytes(path, device) > 10_000, "{device}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn eighteen_sensors_grasp_move_and_let_go() {
    let folder = Folder::new("eighteen");
    let motion = Motion::Synthetic(Box::new(hand("operations/free", "free?start=3")));
    let played = Played {
        motion,
        repeats: true,
    };
    let plug = |name: &str| Plug {
        link: Some(folder.file(name)),
        baud: None,
    };
    let _glove = spawn_cyberglove(
        played.clone(),
        SensorCount::Eighteen,
        calibration(),
        plug("glove"),
    )
    .unwrap();
    let _tracker = spawn_fastrak(played, place(), plug("tracker")).unwrap();
    let daemon = start(config(&folder, "operations/free", 18)).await.unwrap();
    let mut seen = Seen::connect(&daemon).await;
    seen.event(|kind| matches!(kind, Kind::Grasped(_))).await;
    seen.carried(MOVED_M).await;
    seen.event(is_released_by_the_hand).await;
    seen.event(|kind| matches!(kind, Kind::Rested(_))).await;
    daemon.shutdown().await.unwrap();
}
