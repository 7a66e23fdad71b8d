//! Force feedback, all the way round: the hand grasps, and the bytes that its glove hears stop the fingers that touch.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::Point3;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::emulate::lucidglove::{Heard, LucidGloveBuild, LucidGloveEmulator};
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::glove::lucidglove::defaults::default_of;
use tsukamu_devices::glove::lucidglove::protocol::{Encoding, limits_line};
use tsukamu_proto::v1;
use tsukamu_proto::v1::event::Kind;
use tsukamu_server::daemon::{DaemonConfig, start};
use tsukamu_server::emulate::TrackerPlace;
use tsukamu_server::emulate::wearing::{joint_angles_of, sensor_angles, transmitter_from_sensor};
use tsukamu_world::hand::joint::Side;

use crate::rig::{Folder, Stage, daemon_config, hand};
use crate::seen::{Seen, soon};
use crate::{is_released_by_loss, is_released_by_the_hand};

const SCENE: &str = "operations/free";
const FREE: [u16; 5] = [0; 5];
const FINGERS: [&str; 5] = ["thumb", "index", "middle", "ring", "little"];

/// A LucidGlove and a tracker on a hand.
struct Worn {
    stage: Arc<Stage>,
    glove: PtyEmulator<LucidGloveEmulator>,
    tracker: PtyEmulator<FastrakEmulator>,
}

impl Worn {
    fn new(folder: &Folder) -> Self {
        let stage = Arc::new(Stage::default());
        let hand = Arc::new(hand(SCENE, "free"));
        let line = |name: &str| PtySettings {
            link: Some(folder.file(name)),
            baud: 115_200,
        };
        let build = LucidGloveBuild {
            joints: true,
            splay: true,
            ..LucidGloveBuild::default()
        };
        let worn = GloveCalibration::default().filled(|sensor| default_of(sensor, build.max));
        let (wearer, time) = (Arc::clone(&hand), Arc::clone(&stage));
        let bend = move |_: u64, glove: &mut LucidGloveEmulator| {
            let sample = wearer.sample_at(time.time_s());
            let angles = joint_angles_of(&sample, Side::Right).expect("all joints are computed");
            glove.set_slots(&worn.counts(&sensor_angles(&angles), 0, build.max));
        };
        let glove = LucidGloveEmulator::new(build);
        let glove = PtyEmulator::spawn(glove, line("glove"), bend).unwrap();
        let (wearer, time) = (Arc::clone(&hand), Arc::clone(&stage));
        let carry = move |_: u64, tracker: &mut FastrakEmulator| {
            let sample = wearer.sample_at(time.time_s());
            let pose = transmitter_from_sensor(&sample.wrist, &TrackerPlace::default());
            tracker.set_pose(1, Point3::from(pose.translation.vector), pose.rotation);
        };
        let tracker = PtyEmulator::spawn(FastrakEmulator::new(), line("tracker"), carry).unwrap();
        Self {
            stage,
            glove,
            tracker,
        }
    }

    fn limits(&self) -> [i32; 5] {
        self.glove.with(|glove| glove.limits())
    }

    /// Waits until the servos stand so.
    async fn limits_become(&self, what: &str, wanted: impl Fn([i32; 5]) -> bool) {
        let reached = async {
            while !wanted(self.limits()) {
                tokio::time::sleep(std::time::Duration::from_millis(2)).await;
            }
        };
        soon(what, reached).await;
    }

    /// Every command that the glove has heard since `first`.
    fn heard(&self, first: usize) -> Vec<Heard> {
        self.glove
            .with(|glove| glove.heard().iter().skip(first).cloned().collect())
    }
}

/// A daemon as a user would set it up in a file.
fn config(folder: &Folder, strength: f64, haptics: bool) -> DaemonConfig {
    let file = |name: &str| folder.file(name).display().to_string();
    let text = format!(
        "listen = '127.0.0.1:0'\nscene = '{SCENE}'\ntracking_grace_s = 1\n\
         [[device]]\nname = 'glove'\nkind = 'lucidglove'\nport = '{}'\nhand = 'right'\nhaptics = {haptics}\n\
         [[device]]\nname = 'tracker'\nkind = 'fastrak'\nport = '{}'\n\
         [[hand]]\nname = 'alice:right'\nside = 'right'\nglove = 'glove'\ntracker = 'tracker'\n\
         feedback_strength = {strength}\n",
        file("glove"),
        file("tracker"),
    );
    daemon_config(&text)
}

/// The five limits of a command, which is written exactly as the protocol says.
fn limits_of(heard: &Heard) -> [u16; 5] {
    let text = std::str::from_utf8(&heard.line).unwrap();
    let limits: Vec<u16> = text
        .split(|letter: char| letter.is_ascii_uppercase())
        .skip(1)
        .map(|number| number.parse().unwrap())
        .collect();
    let limits = limits.try_into().unwrap();
    let expected = limits_line(Encoding::Alpha, limits);
    assert_eq!([&heard.line[..], b"\n"].concat(), expected);
    limits
}

fn blocked(limits: &[u16; 5]) -> BTreeSet<usize> {
    (0..5).filter(|finger| limits[*finger] > 0).collect()
}

fn finger_of(contact: Option<&v1::ContactFeature>) -> Option<usize> {
    let part = &contact.expect("every contact has a part").part;
    FINGERS
        .iter()
        .position(|finger| part.starts_with(&format!("{finger}_")))
}

/// The fingers whose contacts made the grasp.
fn grasping(grasped: &v1::Grasped) -> BTreeSet<usize> {
    let normals = [&grasped.first, &grasped.second];
    let contacts = normals
        .into_iter()
        .flatten()
        .map(|normal| finger_of(normal.contact.as_ref()));
    contacts.flatten().collect()
}

/// Waits for the grasp, noting which fingers touch anything; gives those that made the grasp.
async fn grasp(seen: &mut Seen, touched: &RefCell<BTreeSet<usize>>) -> BTreeSet<usize> {
    let made = RefCell::new(BTreeSet::new());
    seen.event(|kind| match kind {
        Kind::ContactBegan(began) => {
            touched
                .borrow_mut()
                .extend(finger_of(began.contact.as_ref()));
            false
        }
        Kind::Grasped(grasped) => {
            *made.borrow_mut() = grasping(grasped);
            true
        }
        _ => false,
    })
    .await;
    made.into_inner()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_fingers_of_a_lucidglove_are_stopped_by_a_grasp_and_freed_by_its_end() {
    let folder = Folder::new("feedback");
    let worn = Worn::new(&folder);
    let daemon = start(config(&folder, 1.0, false)).await.unwrap();
    let mut seen = Seen::connect(&daemon).await;
    seen.devices_become("running").await;
    seen.event(|kind| matches!(kind, Kind::HandFound(_))).await;
    let touched = RefCell::new(BTreeSet::new());
    worn.stage.begin();
    let grasping = grasp(&mut seen, &touched).await;
    assert!(grasping.contains(&0) && grasping.len() == 2, "{grasping:?}");
    let is_blocked = |limits: [i32; 5]| grasping.iter().all(|finger| limits[*finger] == 1000);
    worn.limits_become("the grasp", is_blocked).await;
    seen.event(|kind| {
        if let Kind::ContactBegan(began) = kind {
            touched
                .borrow_mut()
                .extend(finger_of(began.contact.as_ref()));
        }
        is_released_by_the_hand(kind)
    })
    .await;
    worn.limits_become("the release", |limits| limits == [0; 5])
        .await;
    daemon.shutdown().await.unwrap();

    // The exchange as the glove recorded it: free, then blocked, then free; nothing else.
    let heard = worn.heard(0);
    let limits: Vec<[u16; 5]> = heard.iter().map(limits_of).collect();
    let text = || format!("{limits:?}, touched {touched:?}, grasped by {grasping:?}");
    assert_eq!(
        (limits.first(), limits.last()),
        (Some(&FREE), Some(&FREE)),
        "{}",
        text()
    );
    for limits in &limits {
        assert!(
            limits.iter().all(|limit| [0, 1000].contains(limit)),
            "{}",
            text()
        );
        assert!(blocked(limits).is_subset(&touched.borrow()), "{}", text());
    }
    assert!(
        limits
            .iter()
            .any(|limits| blocked(limits).is_superset(&grasping)),
        "{}",
        text()
    );
    // At most 50 in a second, however the machine delays them.
    let span_ns = heard[heard.len() - 1].at_ns - heard[0].at_ns;
    assert!(
        heard.len() as u64 <= span_ns / 20_000_000 + 3,
        "{} in {span_ns} ns",
        heard.len()
    );
    // Its stream went on: every line was answered, at more than 10 in a second.
    let n_answers = worn.glove.with(|glove| glove.n_blank()) + heard.len() as u64;
    assert!(n_answers > span_ns / 100_000_000, "{n_answers} answers");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hand_that_is_lost_and_a_daemon_that_ends_free_the_fingers() {
    let folder = Folder::new("feedback-lost");
    let mut worn = Worn::new(&folder);
    let daemon = start(config(&folder, 0.5, true)).await.unwrap();
    let mut seen = Seen::connect(&daemon).await;
    seen.devices_become("running").await;
    seen.event(|kind| matches!(kind, Kind::HandFound(_))).await;
    let touched = RefCell::new(BTreeSet::new());
    let half = |limits: [i32; 5]| limits.iter().filter(|limit| **limit == 500).count() >= 2;

    // The tracker's cable is pulled while the hand holds something; the glove goes on.
    worn.stage.begin();
    grasp(&mut seen, &touched).await;
    worn.limits_become("the grasp", half).await;
    // What touches first is felt as a vibration too.
    let vibrations = worn.glove.with(|glove| glove.vibrations().to_vec());
    assert_eq!(vibrations.first().unwrap(), "F200.00G0.05H0.50");
    worn.tracker.unplug();
    seen.event(is_released_by_loss).await;
    worn.limits_become("the loss", |limits| limits == [0; 5])
        .await;

    // Found again, it grasps again, and the glove is unplugged: it hears that it is free as soon as it is back.
    worn.stage.rest();
    worn.tracker.plug().unwrap();
    seen.event(|kind| matches!(kind, Kind::HandFound(_))).await;
    seen.reset().await;
    worn.stage.begin();
    grasp(&mut seen, &touched).await;
    worn.limits_become("the second grasp", half).await;
    worn.glove.unplug();
    seen.event(is_released_by_loss).await;
    let n_before = worn.heard(0).len();
    worn.glove.plug().unwrap();
    worn.limits_become("the glove's return", |limits| limits == [0; 5])
        .await;
    assert_eq!(limits_of(&worn.heard(n_before)[0]), FREE);

    // The daemon ends while the hand holds something.
    worn.stage.rest();
    seen.devices_become("running").await;
    seen.reset().await;
    worn.stage.begin();
    grasp(&mut seen, &touched).await;
    worn.limits_become("the third grasp", half).await;
    daemon.shutdown().await.unwrap();
    worn.limits_become("the farewell", |limits| limits == [0; 5])
        .await;
}
