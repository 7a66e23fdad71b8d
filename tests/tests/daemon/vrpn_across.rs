//! VRPN from here to there: datagrams, our client on our server, a hand from daemon to daemon.

use std::path::Path;
use std::time::Duration;

use tokio::io::AsyncWriteExt;
use tokio::net::{TcpListener, UdpSocket};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::session::DeviceEvent;
use tsukamu_devices::vrpn::body::{encode_request, encode_udp_address};
use tsukamu_devices::vrpn::message::{Header, MAX_DATAGRAM, Message, encode_with, system};
use tsukamu_devices::vrpn::names::BUTTON_STATES;
use tsukamu_devices::vrpn::settings::VrpnSettings;
use tsukamu_proto::v1;
use tsukamu_server::daemon::{Daemon, DaemonConfig, start};
use tsukamu_server::settings::overrides::Overrides;
use tsukamu_server::settings::{self, Mode};

use super::support::{config, control, cubes, next_frame, soon, step, watch, world};
use super::vrpn_alice::{Alice, rotation, stage};
use super::vrpn_probe::{OurClient, Probe, address, vrpn_daemon};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn poses_come_as_datagrams_to_those_who_ask() {
    let (daemon, _alice) = stage().await;
    let to = address(&daemon);
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
    let port = listener.local_addr().expect("an address").port();
    let asking = UdpSocket::bind("127.0.0.1:0").await.expect("a port");
    let poses = UdpSocket::bind("127.0.0.1:0").await.expect("a port");
    // Clients ask again and again until they are connected back; the address that they name is not believed.
    let request = encode_request([10, 255, 255, 1].into(), port);
    for _ in 0..3 {
        asking.send_to(&request, to).await.expect("sent");
    }
    let (stream, _) = soon(listener.accept()).await.expect("it connects back");
    let mut probe = Probe::over(stream).await;
    let mut out = Vec::new();
    let header = Header {
        sender: poses.local_addr().expect("an address").port().into(),
        kind: system::UDP_DESCRIPTION,
        ..Header::default()
    };
    encode_with(&header, &mut out, |out| {
        encode_udp_address([127, 0, 0, 1].into(), out)
    });
    probe.stream.write_all(&out).await.expect("sent");
    probe.open("Hand0").await;
    probe
        .find(|seen| (seen.kind == BUTTON_STATES).then_some(()))
        .await;
    let mut datagram = [0; 2048];
    let (mut n_poses, mut n_datagrams) = (0, 0);
    while n_poses < 21 {
        let (n_bytes, from) = soon(poses.recv_from(&mut datagram))
            .await
            .expect("datagrams");
        assert_eq!(from, to);
        assert!(n_bytes <= MAX_DATAGRAM);
        n_datagrams += 1;
        let mut rest = &datagram[..n_bytes];
        while !rest.is_empty() {
            let (message, n_taken) = Message::decode(rest, true).expect("good").expect("whole");
            n_poses += usize::from(message.header.sender == 3);
            rest = &rest[n_taken..];
        }
    }
    assert!(n_datagrams >= 2, "21 poses of 88 bytes need two");
    let second = tokio::time::timeout(Duration::ZERO, listener.accept()).await;
    assert!(second.is_err(), "one connection is enough");
    daemon.shutdown().await.expect("a clean end");
}

fn client(device: &str, scheme: &str, daemon: &Daemon) -> VrpnSettings {
    let text = format!("{device}@{scheme}{}", address(daemon));
    VrpnSettings::tracker(text.parse().expect("an address"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn our_client_reads_our_server_by_tcp_and_by_request() {
    let (daemon, mut alice) = stage().await;
    let mut control = control(&daemon).await;
    for scheme in ["tcp://", ""] {
        let mut settings = client("alice_right", scheme, &daemon);
        settings.channels = vec![None; 21];
        settings.channels[4] = Some(GloveSensor::IndexMcp);
        let ours = tokio::task::spawn_blocking(move || {
            let ours = OurClient::start(settings);
            ours.find(|event| match event {
                DeviceEvent::Tracker(reading) => Some(*reading),
                _ => None,
            });
            ours
        });
        let ours = soon(ours).await.expect("it connects");
        let x = if scheme.is_empty() { 0.5 } else { 0.75 };
        alice.sample((x * 100.0) as u64, x).await;
        let stamp = step(&mut control, 1).await.stamp.expect("a stamp");
        let readings = tokio::task::spawn_blocking(move || {
            let wrist = ours.find(|event| match event {
                DeviceEvent::Tracker(reading)
                    if reading.station == 1 && reading.position.is_some_and(|at| at.x == x) =>
                {
                    Some(*reading)
                }
                _ => None,
            });
            let glove = ours.find(|event| match event {
                DeviceEvent::Glove(reading) => Some(*reading),
                _ => None,
            });
            (wrist, glove)
        });
        let (wrist, glove) = soon(readings).await.expect("both come");
        assert_eq!(wrist.device_ticks, Some(stamp.wall_ns / 1000), "{scheme}");
        let angle = wrist.rotation.expect("a rotation").angle_to(&rotation());
        assert!(angle < 1e-6);
        let bend = glove.angle_rad(GloveSensor::IndexMcp).expect("an angle");
        assert!((bend - 0.5).abs() < 1e-6);
    }
    daemon.shutdown().await.expect("a clean end");
}

/// Settings of a daemon whose hand is another daemon's, over VRPN.
fn follower(scheme: &str, server: &Daemon) -> DaemonConfig {
    let at = address(server);
    let channels: Vec<String> = (0..21)
        .map(|channel| {
            if channel == 4 {
                "\"index_mcp\""
            } else {
                "\"-\""
            }
            .to_owned()
        })
        .collect();
    let text = format!(
        "scene = \"empty\"\n\
         [[device]]\nname = \"wrist\"\nkind = \"vrpn\"\nport = \"Hand0@{scheme}{at}\"\n\
         [[device]]\nname = \"fingers\"\nkind = \"vrpn\"\nport = \"Glove0@{scheme}{at}\"\nchannels = [{}]\n\
         [[hand]]\nname = \"bob:right\"\nside = \"right\"\nglove = \"fingers\"\ntracker = \"wrist\"\nbetween = \"hold\"\n",
        channels.join(", ")
    );
    let settings = settings::parse("test.toml", &text, Path::new(""), &Overrides::default())
        .unwrap_or_else(|mistakes| panic!("{mistakes}"));
    DaemonConfig {
        devices: settings.devices,
        hands: settings.hands,
        ..config(cubes(0, 240.0), Mode::Realtime)
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_hand_goes_from_daemon_to_daemon() {
    let first = vrpn_daemon(cubes(0, 240.0), Mode::Realtime, 100.0).await;
    let mut alice = Alice::enter(&first).await;
    alice.sample(1, 0.25).await;
    for scheme in ["tcp://", ""] {
        let second = start(follower(scheme, &first)).await.expect("it starts");
        let mut frames = watch(&mut world(&second).await, 0.0).await;
        let hand = loop {
            let frame = next_frame(&mut frames, &mut 0).await;
            let wrist = frame.hands.first().and_then(|hand| hand.wrist);
            let place = wrist.and_then(|wrist| wrist.position);
            let is_there =
                place.is_some_and(|at| (at.x - 0.25).abs() < 1e-6 && (at.y - 1.0).abs() < 1e-6);
            // Steps are faster than samples: between two of these the hand is held.
            if is_there && frame.hands[0].tracking() == v1::Tracking::Tracked {
                break frame.hands[0].clone();
            }
        };
        // The index finger's tip hangs below its knuckle.
        let (knuckle, tip) = (hand.tracked[3 * 4 + 1], hand.tracked[3 * 7 + 1]);
        assert!(knuckle - tip > 0.03, "{knuckle} {tip}");
        second.shutdown().await.expect("a clean end");
    }
    first.shutdown().await.expect("a clean end");
}
