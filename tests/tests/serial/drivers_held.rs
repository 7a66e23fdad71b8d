//! A cable is pulled while the hand holds an object: plugged in again within the grace time nothing is lost, and after it
//! the viewer sees that the hand is gone and the object let go.

use tsukamu_client::view::{HandView, WorldView};
use tsukamu_devices::glove::cyberglove::settings::SensorCount;
use tsukamu_proto::v1;
use tsukamu_proto::v1::event::Kind;
use tsukamu_server::daemon::DaemonConfig;
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file::load;

use crate::drivers_lab::Lab;
use crate::rig::{Folder, Worn, config};
use crate::{is_released_by_loss, is_released_by_the_hand};

/// Longer than a start-up takes on a loaded machine, seconds.
const GRACE_S: f64 = 8.0;
/// How high the object is lifted before the hand stands still, metres.
const LIFTED_M: f64 = 0.05;

fn patient_config(folder: &Folder) -> DaemonConfig {
    let mut loaded = load("operations/free").unwrap();
    loaded.scene.tracking_grace_s = GRACE_S;
    DaemonConfig {
        plan: plan(&loaded, Cast::Nobody).unwrap(),
        ..config(folder, "operations/free", 22)
    }
}

fn only_hand(view: &WorldView) -> Option<&HandView> {
    view.hands.first()
}

fn is_held(view: &WorldView) -> bool {
    only_hand(view).is_some_and(|hand| hand.holds.is_some())
}

fn is_lifted(view: &WorldView) -> bool {
    let held = only_hand(view).and_then(|hand| view.objects.get(&hand.holds?));
    held.is_some_and(|object| object.pose.translation.y > LIFTED_M)
}

fn is_tracked(view: &WorldView) -> bool {
    only_hand(view).is_some_and(|hand| hand.tracking == v1::Tracking::Tracked)
}

/// The hand has grasped, lifted, and stands.
async fn grasp_and_stand(lab: &Lab, worn: &Worn) -> usize {
    lab.view_that("the hand", is_tracked).await;
    worn.stage.begin();
    let is_grasp = |_: &v1::Event, kind: &Kind| matches!(kind, Kind::Grasped(_));
    let grasp = lab.event_from(0, "a grasp", is_grasp).await;
    lab.view_that("lifted", is_lifted).await;
    worn.stage.stand();
    grasp
}

/// One device is gone: the hand stands where it was, and holds.
async fn gone(lab: &Lab, device: &str) {
    lab.row_that(device, "absent", |row| row.state == "absent")
        .await;
    let stands = |view: &WorldView| {
        is_held(view) && only_hand(view).is_some_and(|hand| hand.tracking == v1::Tracking::Held)
    };
    lab.view_that("it stands and holds", stands).await;
}

/// It is back: the hand is followed again, and still holds.
async fn back(lab: &Lab, device: &str) {
    lab.row_that(device, "running", |row| row.state == "running")
        .await;
    lab.view_that("it is followed and holds", |view| {
        is_tracked(view) && is_held(view)
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cable_that_is_plugged_in_again_within_the_grace_time_loses_nothing() {
    let folder = Folder::new("held");
    let mut worn = Worn::new(&folder, SensorCount::TwentyTwo, "free");
    let lab = Lab::new(patient_config(&folder)).await;
    let grasp = grasp_and_stand(&lab, &worn).await;
    worn.glove.unplug();
    gone(&lab, "glove").await;
    worn.glove.plug().unwrap();
    back(&lab, "glove").await;
    worn.tracker.unplug();
    gone(&lab, "tracker").await;
    worn.tracker.plug().unwrap();
    back(&lab, "tracker").await;
    // The hand goes on with what it was doing, and lets go when it wants to.
    worn.stage.go_on();
    let is_release = |_: &v1::Event, kind: &Kind| matches!(kind, Kind::Released(_));
    let release = lab.event_from(grasp, "a release", is_release).await;
    let events = lab.events_from(grasp);
    let kinds: Vec<&Kind> = events[..=release - grasp]
        .iter()
        .filter_map(|event| event.kind.as_ref())
        .collect();
    assert!(is_released_by_the_hand(kinds[kinds.len() - 1]), "{kinds:?}");
    assert!(
        !kinds.iter().any(|kind| matches!(kind, Kind::HandLost(_))),
        "{kinds:?}"
    );
    for device in ["glove", "tracker"] {
        assert_eq!(
            lab.comings_and_goings(device),
            [true, false],
            "{device}: {kinds:?}"
        );
    }
    lab.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cable_that_stays_out_beyond_the_grace_time_is_a_lost_hand_and_a_release() {
    for device in ["glove", "tracker"] {
        let folder = Folder::new(&format!("let-go-{device}"));
        let mut worn = Worn::new(&folder, SensorCount::TwentyTwo, "free");
        // The grace time of the scene: a quarter of a second.
        let lab = Lab::new(config(&folder, "operations/free", 22)).await;
        let grasp = grasp_and_stand(&lab, &worn).await;
        if device == "glove" {
            worn.glove.unplug();
        } else {
            worn.tracker.unplug();
        }
        let is_lost = |_: &v1::Event, kind: &Kind| matches!(kind, Kind::HandLost(_));
        lab.event_from(grasp, "the hand is lost", is_lost).await;
        let is_let_go = |_: &v1::Event, kind: &Kind| is_released_by_loss(kind);
        let release = lab.event_from(grasp, "it lets go", is_let_go).await;
        let earlier = lab.events_from(grasp);
        let by_hand = earlier[..release - grasp]
            .iter()
            .filter_map(|event| event.kind.as_ref())
            .any(is_released_by_the_hand);
        assert!(!by_hand, "{earlier:?}");
        // The same is seen in the frames.
        let is_gone = |view: &WorldView| {
            let hand = only_hand(view);
            hand.is_some_and(|hand| hand.tracking == v1::Tracking::Lost && hand.holds.is_none())
                && view.objects.values().all(|object| object.holder.is_none())
        };
        lab.view_that("a lost hand that holds nothing", is_gone)
            .await;
        if device == "glove" {
            worn.glove.plug().unwrap();
        } else {
            worn.tracker.plug().map(drop).unwrap();
        }
        lab.view_that("the hand again", is_tracked).await;
        lab.end().await;
    }
}
