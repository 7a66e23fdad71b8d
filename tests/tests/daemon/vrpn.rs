//! What the VRPN server shows.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use tsukamu_devices::vrpn::body::{ButtonChange, decode_button_states};
use tsukamu_devices::vrpn::names::{BUTTON_CHANGE, BUTTON_STATES, PONG};
use tsukamu_server::daemon::{DaemonConfig, start};
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file::load;
use tsukamu_server::settings::Mode;

use super::support::{control, cubes, next_frame, step, tick, watch, world};
use super::vrpn_alice::{Alice, rotation, stage};
use super::vrpn_probe::{Probe, Seen, address, vrpn_config};

fn close(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6)
}

/// Everything that a client which comes late is shown, up to the pong and the objects.
async fn shown(probe: &mut Probe) -> Vec<Seen> {
    let mut all: Vec<Seen> = Vec::new();
    let is_whole = |all: &[Seen]| {
        all.iter().any(|seen| seen.kind == PONG)
            && all.iter().any(|seen| seen.pose_of("Objects").is_some())
    };
    while !is_whole(&all) {
        all.push(probe.next().await.expect("the connection goes on"));
    }
    all
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_late_client_sees_the_hands_as_they_stand() {
    let (daemon, _alice) = stage().await;
    let mut frames = watch(&mut world(&daemon).await, 0.0).await;
    let frame = next_frame(&mut frames, &mut 0).await;
    let (stamp, hand) = (frame.stamp.expect("a stamp"), frame.hands[0].clone());
    // Nothing steps any more.
    let mut probe = Probe::connect(address(&daemon)).await;
    probe.open("Hand0").await;
    let all = shown(&mut probe).await;
    let poses: Vec<_> = all
        .iter()
        .filter_map(|seen| Some((seen.header.time.unix_us(), seen.pose_of("Hand0")?)))
        .collect();
    let (time, wrist) = poses[0];
    assert_eq!(time, Some(stamp.wall_ns / 1000), "the frame's own time");
    let turned = rotation();
    assert_eq!((wrist.sensor, wrist.position), (0, [0.25, 1.0, 0.0]));
    let expected = [turned.i, turned.j, turned.k, turned.w];
    assert!(close(&wrist.rotation, &expected), "{wrist:?}");
    for sensor in 1..=20 {
        let joint = poses.iter().find(|(_, pose)| pose.sensor == sensor);
        let (_, joint) = joint.expect("each joint");
        let at = 3 * (sensor as usize - 1);
        let shown = hand.shown[at..at + 3].iter().map(|x| f64::from(*x));
        let shown: Vec<f64> = shown.collect();
        assert!(close(&joint.position, &shown), "{joint:?} {shown:?}");
    }
    // The straight thumb's and fingers' -z leads from a joint to the next.
    for (sensor, next) in [(1, 2), (6, 7), (7, 8), (18, 19)] {
        let pose = |wanted| poses.iter().find(|(_, pose)| pose.sensor == wanted);
        let (from, to) = (pose(sensor).expect("one").1, pose(next).expect("one").1);
        let [x, y, z, w] = from.rotation;
        let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let way = Vector3::from(to.position) - Vector3::from(from.position);
        let forward = rotation * -Vector3::z();
        assert!((forward - way.normalize()).norm() < 1e-6, "{sensor}");
    }
    let glove = all.iter().find_map(|seen| seen.channels_of("Glove0"));
    let mut expected = vec![0.0; 21];
    expected[4] = 0.5_f64.to_degrees();
    let glove = glove.expect("the glove");
    assert!(close(&glove, &expected), "{glove:?}");
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_late_client_sees_buttons_objects_and_the_time() {
    let (daemon, _alice) = stage().await;
    let mut probe = Probe::connect(address(&daemon)).await;
    probe.open("Hand0").await;
    let all = shown(&mut probe).await;
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
    let epoch = daemon.backend().status.stamp().epoch;
    assert_eq!(world, [epoch as f64, 1.0, 1.0 / 240.0]);
    let objects = all.iter().find_map(|seen| seen.pose_of("Objects"));
    let floor = objects.expect("the cube on the floor");
    assert_eq!(floor.sensor, 0);
    assert!(close(&floor.position, &[-1.0, 0.025, 0.0]));
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
