//! VRPN in and out: what the server shows, read by a small client and by our own.

use std::path::Path;

use nalgebra::{UnitQuaternion, Vector3};
use tokio::net::{TcpListener, UdpSocket};
use tokio_stream::wrappers::ReceiverStream;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::session::DeviceEvent;
use tsukamu_devices::vrpn::body::{
    ButtonChange, decode_button_states, encode_request, encode_udp_address,
};
use tsukamu_devices::vrpn::message::{Header, MAX_DATAGRAM, Message, encode_with, system};
use tsukamu_devices::vrpn::names::{BUTTON_CHANGE, BUTTON_STATES, PONG};
use tsukamu_devices::vrpn::settings::VrpnSettings;
use tsukamu_proto::v1;
use tsukamu_proto::v1::drive_request::Kind as Ask;
use tsukamu_proto::v1::drive_response::Kind;
use tsukamu_proto::v1::hands_client::HandsClient;
use tsukamu_server::daemon::{Daemon, DaemonConfig, start};
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file::load;
use tsukamu_server::settings::overrides::Overrides;
use tsukamu_server::settings::{self, Mode};

use super::hands::{ask, open, state_where};
use super::support::{connect, control, cubes, next, next_frame, soon, step, tick, watch, world};
use super::vrpn_probe::{OurClient, Probe, Seen, address, vrpn_config, vrpn_daemon};

/// A client that drives `alice:right`; the hand goes when this does.
struct Alice {
    requests: tokio::sync::mpsc::Sender<v1::DriveRequest>,
    answers: tonic::Streaming<v1::DriveResponse>,
}

/// Turned by 90 degrees about y.
fn rotation() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2)
}

impl Alice {
    async fn enter(daemon: &Daemon) -> Self {
        let mut hands = HandsClient::new(connect(daemon).await);
        let (requests, receiver) = tokio::sync::mpsc::channel(8);
        let mut answers = soon(hands.drive(ReceiverStream::new(receiver)))
            .await
            .expect("a stream")
            .into_inner();
        requests.send(open("alice:right")).await.expect("sent");
        let opened = next(&mut answers).await.kind;
        assert!(matches!(opened, Some(Kind::Opened(_))));
        Self { requests, answers }
    }

    /// Sends a sample, and waits until the daemon has it: wrist at `x`, index finger bent by 0.5 rad.
    async fn sample(&mut self, source_ns: u64, x: f64) {
        let turned = rotation();
        let mut angles = vec![0.0; 21];
        angles[4] = 0.5;
        let sample = v1::HandSample {
            source_ns,
            wrist: Some(v1::Pose {
                position: Some(v1::Vec3 { x, y: 1.0, z: 0.0 }),
                rotation: Some(v1::Quat {
                    x: turned.i,
                    y: turned.j,
                    z: turned.k,
                    w: turned.w,
                }),
            }),
            joints: Vec::new(),
            angles,
            valid: true,
        };
        self.requests
            .send(ask(Ask::Sample(sample)))
            .await
            .expect("sent");
        state_where(&mut self.answers, |state| {
            state.received_source_ns == source_ns
        })
        .await;
    }
}

/// A daemon in lockstep after one step, with the hand of `alice:right` at x = 0.25.
async fn stage() -> (Daemon, Alice) {
    let daemon = vrpn_daemon(cubes(1, 240.0), Mode::Lockstep, 500.0).await;
    let mut alice = Alice::enter(&daemon).await;
    alice.sample(10, 0.25).await;
    step(&mut control(&daemon).await, 1).await;
    (daemon, alice)
}

fn close(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_late_client_sees_the_world_as_it_stands() {
    let (daemon, _alice) = stage().await;
    let mut frames = watch(&mut world(&daemon).await, 0.0).await;
    let frame = next_frame(&mut frames, &mut 0).await;
    let (stamp, hand) = (frame.stamp.expect("a stamp"), frame.hands[0].clone());
    // Nothing steps any more.
    let mut probe = Probe::connect(address(&daemon)).await;
    probe.open("Hand0").await;
    let mut all: Vec<Seen> = Vec::new();
    while !all.iter().any(|seen| seen.kind == PONG)
        || !all.iter().any(|seen| seen.pose_of("Objects").is_some())
    {
        all.push(probe.next().await.expect("the connection goes on"));
    }
    let wrist = all
        .iter()
        .find_map(|seen| seen.pose_of("Hand0").map(|pose| (seen, pose)));
    let (seen, wrist) = wrist.expect("the wrist");
    assert_eq!(
        seen.header.time.unix_us(),
        Some(stamp.wall_ns / 1000),
        "the frame's own time"
    );
    let turned = rotation();
    assert_eq!((wrist.sensor, wrist.position), (0, [0.25, 1.0, 0.0]));
    assert!(close(
        &wrist.rotation,
        &[turned.i, turned.j, turned.k, turned.w]
    ));
    for sensor in 1..=20 {
        let joint = all
            .iter()
            .filter_map(|seen| seen.pose_of("Hand0"))
            .find(|pose| pose.sensor == sensor)
            .expect("each joint");
        let at = 3 * (sensor as usize - 1);
        let shown: Vec<f64> = hand.shown[at..at + 3]
            .iter()
            .map(|x| f64::from(*x))
            .collect();
        assert!(close(&joint.position, &shown), "{joint:?} {shown:?}");
    }
    let glove = all.iter().find_map(|seen| seen.channels_of("Glove0"));
    let mut expected = vec![0.0; 21];
    expected[4] = 0.5_f64.to_degrees();
    let glove = glove.expect("the glove");
    assert!(close(&glove, &expected), "{glove:?}");
    let buttons = all
        .iter()
        .find(|seen| seen.sender == "Grasp0" && seen.kind == BUTTON_STATES)
        .expect("all buttons");
    assert_eq!(
        decode_button_states(&buttons.body),
        Some(vec![0, 0, 0, 0, 0, 0, 1]),
        "followed, touching nothing"
    );
    let world = all.iter().find_map(|seen| seen.channels_of("World"));
    let world = world.expect("the world");
    assert_eq!(world, [stamp.epoch as f64, 1.0, stamp.world_time_s]);
    let objects: Vec<_> = all
        .iter()
        .filter_map(|seen| seen.pose_of("Objects"))
        .collect();
    assert_eq!(objects[0].sensor, 0);
    assert!(close(&objects[0].position, &[-1.0, 0.025, 0.0]));
    let pong = all.iter().find(|seen| seen.kind == PONG).expect("a pong");
    assert_eq!(pong.sender, "Hand0");
    let names: Vec<&str> = probe.senders.iter().collect();
    let expected = [
        "VRPN Control",
        "Objects",
        "World",
        "Hand0",
        "Glove0",
        "Grasp0",
        "Hand1",
        "Glove1",
        "Grasp1",
        "alice_right",
    ];
    assert_eq!(names, expected);
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn own_names_come_to_those_who_open_them() {
    let (daemon, mut alice) = stage().await;
    let mut probe = Probe::connect(address(&daemon)).await;
    let tick = probe.tick().await;
    assert_eq!(tick, 1);
    probe.open("alice_right").await;
    probe.open("floor").await;
    probe
        .find(|seen| (seen.sender == "alice_right" && seen.kind == PONG).then_some(()))
        .await;
    probe
        .find(|seen| (seen.sender == "floor" && seen.kind == PONG).then_some(()))
        .await;
    alice.sample(20, 0.5).await;
    step(&mut control(&daemon).await, 1).await;
    let wanted = |seen: &Seen| {
        seen.pose_of("alice_right")
            .filter(|pose| pose.sensor == 0 && pose.position[0] == 0.5)
    };
    probe.find(wanted).await;
    let glove = probe.find(|seen| seen.channels_of("alice_right")).await;
    assert!((glove[4] - 0.5_f64.to_degrees()).abs() < 1e-6);
    let floor = probe.find(|seen| seen.pose_of("floor")).await;
    assert!(close(&floor.position, &[-1.0, 0.025, 0.0]));
    assert_eq!(floor.sensor, 0);
    // The hand goes, its buttons are released, and the next one takes its number.
    drop(alice);
    let mut control = control(&daemon).await;
    let released = loop {
        step(&mut control, 1).await;
        let seen = probe
            .find(|seen| {
                (seen.channels_of("World").is_some() || seen.kind == BUTTON_CHANGE)
                    .then(|| seen.clone())
            })
            .await;
        if seen.kind == BUTTON_CHANGE {
            break seen;
        }
    };
    assert_eq!(released.sender, "Grasp0");
    assert_eq!(
        ButtonChange::decode(&released.body),
        Some(ButtonChange {
            button: 6,
            state: 0
        })
    );
    let mut again = Alice::enter(&daemon).await;
    again.sample(30, 0.75).await;
    step(&mut control, 1).await;
    probe
        .find(|seen| {
            seen.pose_of("Hand0")
                .filter(|pose| pose.position[0] == 0.75)
        })
        .await;
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn grasps_are_buttons() {
    // A hand that picks up a cube, step by step: what the buttons say is what the frames say.
    let loaded = load("operations/grasp-throw").expect("a built-in scene");
    let plan = plan(&loaded, Cast::Default { repeats: false }).expect("a plan");
    let config = DaemonConfig {
        vrpn: vrpn_config(cubes(0, 240.0), Mode::Lockstep, 1000.0).vrpn,
        ..DaemonConfig::new(plan, Mode::Lockstep)
    };
    let daemon = start(config).await.expect("it starts");
    let mut control = control(&daemon).await;
    let mut frames = watch(&mut world(&daemon).await, 0.0).await;
    next_frame(&mut frames, &mut 0).await;
    let mut probe = Probe::connect(address(&daemon)).await;
    let wanted = tick(step(&mut control, 1).await.stamp);
    let mut frame = next_frame(&mut frames, &mut 0).await;
    assert_eq!(tick(frame.stamp), wanted);
    let mut buttons = vec![0; 7];
    let mut has_grasped = false;
    for _ in 0..2000 {
        // The buttons come before the picture's analog, and only when one changes.
        loop {
            let seen = probe.next().await.expect("the connection goes on");
            if seen.sender == "Grasp0" && seen.kind == BUTTON_STATES {
                buttons = decode_button_states(&seen.body).expect("states");
            } else if seen.sender == "Grasp0" {
                let change = ButtonChange::decode(&seen.body).expect("a change");
                buttons[change.button as usize] = change.state;
            } else if seen
                .channels_of("World")
                .is_some_and(|world| world[1] as u64 == tick(frame.stamp))
            {
                break;
            }
        }
        let holds = frame.hands[0].holds != 0;
        assert_eq!(buttons[0] == 1, holds, "{frame:?}");
        let n_touching: i32 = buttons[1..6].iter().sum();
        if holds {
            assert!(
                buttons[1] == 1 && n_touching >= 2,
                "the thumb and another: {buttons:?}"
            );
            has_grasped = true;
        } else if has_grasped {
            daemon.shutdown().await.expect("a clean end");
            return;
        }
        let wanted = tick(step(&mut control, 5).await.stamp);
        while tick(frame.stamp) < wanted {
            frame = next_frame(&mut frames, &mut 0).await;
        }
    }
    panic!("no grasp was begun and ended: {buttons:?}");
}

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
    tokio::io::AsyncWriteExt::write_all(&mut probe.stream, &out)
        .await
        .expect("sent");
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
    let second = tokio::time::timeout(std::time::Duration::ZERO, listener.accept()).await;
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
        ..super::support::config(cubes(0, 240.0), Mode::Realtime)
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
            if place.is_some_and(|at| (at.x - 0.25).abs() < 1e-6 && (at.y - 1.0).abs() < 1e-6) {
                break frame.hands[0].clone();
            }
        };
        assert_eq!(hand.tracking(), v1::Tracking::Tracked);
        // The index finger's tip hangs below its knuckle.
        let (knuckle, tip) = (hand.tracked[3 * 4 + 1], hand.tracked[3 * 7 + 1]);
        assert!(knuckle - tip > 0.03, "{knuckle} {tip}");
        second.shutdown().await.expect("a clean end");
    }
    first.shutdown().await.expect("a clean end");
}
