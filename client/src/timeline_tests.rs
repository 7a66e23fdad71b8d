use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use nalgebra::{UnitQuaternion, Vector3};
use tsukamu_proto::v1::{ContactState, Side, Tracking};

use super::*;
use crate::view::{N_JOINTS, Stamp};

fn object(x: f64, yaw: f64) -> ObjectView {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw);
    ObjectView {
        pose: Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), rotation),
        state: ContactState::Free,
        resting: false,
        holder: None,
    }
}

fn view(epoch: u64, wall_ns: u64, objects: &[(u64, f64, f64)]) -> WorldView {
    WorldView {
        stamp: Stamp {
            epoch,
            tick: wall_ns / 10,
            world_time_s: wall_ns as f64 * 1e-9,
            wall_ns,
        },
        scene_version: 1,
        objects: objects
            .iter()
            .map(|(id, x, yaw)| (*id, object(*x, *yaw)))
            .collect::<BTreeMap<_, _>>(),
        hands: Vec::new(),
    }
}

fn timeline(views: &[WorldView]) -> Timeline {
    let mut timeline = Timeline::new(4);
    for view in views {
        timeline.push(view.clone(), view.stamp.wall_ns + 5);
    }
    timeline
}

/// Position and yaw of object 1 at that time.
fn check(views: &[WorldView], server_ns: u64, placement: Placement, x: f64, yaw: f64) {
    let presented = timeline(views).at(server_ns).unwrap();
    let object = &presented.view.objects[&1];
    assert_eq!(presented.placement, placement, "at {server_ns}");
    assert!(
        (object.pose.translation.x - x).abs() < 1e-12,
        "x {} at {server_ns}",
        object.pose.translation.x
    );
    let error = object
        .pose
        .rotation
        .angle_to(&UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw));
    assert!(error < 1e-7, "rotation is off by {error} at {server_ns}");
}

#[test]
fn empty_and_one_view() {
    assert_eq!(timeline(&[]).at(5), None);
    assert_eq!(timeline(&[]).rate_hz(), None);
    assert_eq!(timeline(&[]).age_ns(5), None);
    let one = [view(1, 100, &[(1, 0.5, 0.0)])];
    check(&one, 90, Placement::Before(10), 0.5, 0.0);
    check(&one, 100, Placement::Between, 0.5, 0.0);
    check(&one, 130, Placement::After(30), 0.5, 0.0);
    assert_eq!(timeline(&one).rate_hz(), None);
}

#[test]
fn between_two_views() {
    let two = [
        view(1, 100, &[(1, 0.0, 0.0)]),
        view(1, 200, &[(1, 1.0, FRAC_PI_2)]),
    ];
    check(&two, 50, Placement::Before(50), 0.0, 0.0);
    check(&two, 100, Placement::Between, 0.0, 0.0);
    check(&two, 125, Placement::Between, 0.25, FRAC_PI_4 / 2.0);
    check(&two, 150, Placement::Between, 0.5, FRAC_PI_4);
    check(&two, 200, Placement::Between, 1.0, FRAC_PI_2);
    check(&two, 260, Placement::After(60), 1.0, FRAC_PI_2);
}

#[test]
fn the_shorter_way_round() {
    let mut there = view(1, 200, &[(1, 0.0, 0.2)]);
    let pose = &mut there.objects.get_mut(&1).unwrap().pose;
    pose.rotation = UnitQuaternion::new_unchecked(-pose.rotation.into_inner());
    check(
        &[view(1, 100, &[(1, 0.0, 0.0)]), there],
        150,
        Placement::Between,
        0.0,
        0.1,
    );
    // From 170 to -170 degrees it goes through 180.
    let (from, to) = (PI - 0.2, -PI + 0.2);
    check(
        &[
            view(1, 100, &[(1, 0.0, from)]),
            view(1, 200, &[(1, 0.0, to)]),
        ],
        150,
        Placement::Between,
        0.0,
        PI,
    );
    // Half a turn has two ways; either ends where it should.
    check(
        &[
            view(1, 100, &[(1, 0.0, 0.0)]),
            view(1, 200, &[(1, 0.0, PI)]),
        ],
        200,
        Placement::Between,
        0.0,
        PI,
    );
}

#[test]
fn objects_that_come_and_go() {
    let two = [
        view(1, 100, &[(1, 0.0, 0.0), (2, 0.3, 0.0)]),
        view(1, 200, &[(1, 1.0, 0.0), (3, 0.4, 0.0)]),
    ];
    let at = |server_ns| {
        timeline(&two)
            .at(server_ns)
            .unwrap()
            .view
            .objects
            .keys()
            .copied()
            .collect::<Vec<_>>()
    };
    assert_eq!(at(150), [1, 2]);
    assert_eq!(at(200), [1, 3]);
    assert_eq!(
        timeline(&two).at(150).unwrap().view.objects[&2]
            .pose
            .translation
            .x,
        0.3
    );
}

#[test]
fn out_of_order_and_new_epochs() {
    let mut timeline = timeline(&[
        view(1, 100, &[(1, 0.0, 0.0)]),
        view(1, 200, &[(1, 1.0, 0.0)]),
    ]);
    assert_eq!(
        timeline.push(view(1, 150, &[(1, 9.0, 0.0)]), 300),
        Pushed::OutOfOrder
    );
    assert_eq!(
        timeline.push(view(1, 200, &[(1, 9.0, 0.0)]), 300),
        Pushed::OutOfOrder
    );
    assert_eq!(timeline.n_out_of_order(), 2);
    assert_eq!(
        timeline.at(150).unwrap().view.objects[&1]
            .pose
            .translation
            .x,
        0.5
    );
    // A new epoch is never mixed with the old one, even where its time is earlier.
    assert_eq!(
        timeline.push(view(2, 190, &[(1, 7.0, 0.0)]), 310),
        Pushed::NewEpoch
    );
    let presented = timeline.at(150).unwrap();
    assert_eq!(
        (presented.placement, presented.view.stamp.epoch),
        (Placement::Before(40), 2)
    );
    timeline.clear();
    assert_eq!(timeline.at(150), None);
}

#[test]
fn the_buffer_is_bounded() {
    let views: Vec<_> = (1..=10)
        .map(|n| view(1, 100 * n, &[(1, n as f64, 0.0)]))
        .collect();
    check(&views, 100, Placement::Before(600), 7.0, 0.0);
    check(&views, 950, Placement::Between, 9.5, 0.0);
    assert_eq!(timeline(&views).back_by(150e-9).unwrap().stamp.wall_ns, 800);
    assert_eq!(timeline(&views).back_by(1.0).unwrap().stamp.wall_ns, 700);
}

#[test]
fn rate_jitter_and_age() {
    let mut even = Timeline::new(10);
    let mut uneven = Timeline::new(10);
    for n in 1..=5 {
        even.push(view(1, 10_000_000 * n, &[]), 10_000_000 * n + 77);
        uneven.push(
            view(1, 10_000_000 * n, &[]),
            10_000_000 * n + 1_000_000 * (n % 2),
        );
    }
    assert!((even.rate_hz().unwrap() - 100.0).abs() < 1e-9);
    assert_eq!(even.jitter_ns(), 0.0);
    // Each spacing is off by 1 ms: the average approaches that as 1 - (15/16)^n.
    assert!((uneven.jitter_ns() - 1e6 * (1.0 - (15.0f64 / 16.0).powi(4))).abs() < 1e-3);
    assert_eq!(even.age_ns(50_000_123), Some(123));
    assert_eq!(even.age_ns(49_999_900), Some(-100));
}

#[test]
fn hands_are_interpolated() {
    let hand = |x: f64, tip: Option<f64>| {
        let mut shown = [None; N_JOINTS];
        shown[7] = tip.map(|x| Point3::new(x, 0.0, 0.0));
        HandView {
            id: 2,
            side: Side::Right,
            tracking: Tracking::Tracked,
            wrist: Isometry3::translation(x, 0.0, 0.0),
            tracked: shown,
            shown,
            holds: None,
            sample_age_s: 0.0,
        }
    };
    let check_tip = |earlier: Option<f64>, later: Option<f64>, expected: Option<f64>| {
        let mut views = [view(1, 100, &[]), view(1, 200, &[])];
        views[0].hands = vec![hand(0.0, earlier)];
        views[1].hands = vec![hand(1.0, later)];
        let presented = timeline(&views).at(150).unwrap();
        assert_eq!(presented.view.hands[0].wrist.translation.x, 0.5);
        assert_eq!(presented.view.hands[0].shown[7].map(|tip| tip.x), expected);
    };
    check_tip(Some(0.0), Some(0.5), Some(0.25));
    check_tip(Some(0.125), None, Some(0.125));
    check_tip(None, Some(0.5), None);
}
