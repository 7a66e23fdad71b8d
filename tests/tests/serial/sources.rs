//! Hands that arrive over the network: datagrams → hand → world → frames and events over gRPC → a client.

use std::net::UdpSocket;

use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_proto::v1::event::Kind;
use tsukamu_server::daemon::start;
use tsukamu_server::emulate::network::{Sender, spawn_rokoko, spawn_vmc};
use tsukamu_server::emulate::{Played, Plug, Plugged, TrackerPlace, Worn};
use tsukamu_server::offline::hands::Motion;

use crate::rig::{daemon_config, hand};
use crate::seen::Seen;
use crate::{MOVED_M, is_released_by_loss, is_released_by_the_hand};

type Spawn = fn(Worn) -> std::io::Result<Sender>;

/// A port that nobody has.
pub(crate) fn free_port() -> u16 {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.local_addr().unwrap().port()
}

/// A hand that grasps, carries and lets go, again and again, and is silent at some time.
async fn grasps_and_recovers(kind: &str, model: &'static str, spawn: Spawn) {
    let port = free_port();
    let motion = Motion::Synthetic(Box::new(hand("operations/free", "free?start=3")));
    let mut sender = spawn(Worn {
        played: Played {
            motion,
            repeats: true,
        },
        calibration: GloveCalibration::default(),
        place: TrackerPlace::default(),
        model,
        plug: Plug::default(),
        to: Some(format!("127.0.0.1:{port}")),
    })
    .unwrap();
    let config = daemon_config(&format!(
        "listen = '127.0.0.1:0'\nscene = 'operations/free'\n\
         [[device]]\nname = 'source'\nkind = '{kind}'\nport = 'udp:{port}'\n\
         [[hand]]\nname = 'alice:right'\nside = 'right'\nglove = 'source'\ntracker = 'source'\n"
    ));
    let daemon = start(config).await.unwrap();
    let mut seen = Seen::connect(&daemon).await;
    seen.event(|kind| matches!(kind, Kind::HandFound(_))).await;
    seen.event(|kind| matches!(kind, Kind::Grasped(_))).await;
    seen.carried(MOVED_M).await;
    seen.event(is_released_by_the_hand).await;
    seen.event(|kind| matches!(kind, Kind::Rested(_))).await;

    // The sender is silent while it holds.
    seen.reset().await;
    seen.event(|kind| matches!(kind, Kind::Grasped(_))).await;
    sender.unplug();
    seen.event(|kind| matches!(kind, Kind::HandLost(_))).await;
    seen.event(is_released_by_loss).await;
    sender.plug().unwrap();
    seen.event(|kind| matches!(kind, Kind::HandFound(_))).await;
    daemon.shutdown().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn bones_by_vmc_are_a_hand() {
    grasps_and_recovers("vmc", "", spawn_vmc).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn joints_by_rokoko_are_a_hand() {
    grasps_and_recovers("rokoko", "lz4", spawn_rokoko).await;
}
