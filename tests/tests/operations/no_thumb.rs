//! Operation 2: a grasp without the thumb.

use tsukamu_world::frame::EventKind;
use tsukamu_world::hand::joint::Finger;
use tsukamu_world::hand::part::PartLayout;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::state::ContactState;

use crate::drive::{Run, for_all};

#[test]
fn a_slab_is_held_between_two_fingers() {
    for_all("operations/no-thumb", "no-thumb", 0.0, check);
}

fn check(run: &Run, what: &str) {
    let layout = PartLayout::of(&HandModel::adult(run.hand.side()));
    let grasped = run.events_of(0, "grasped");
    let EventKind::Grasped { normals, angle } = &grasped[grasped.len() - 1].1 else {
        unreachable!()
    };
    assert!(
        *angle >= std::f64::consts::FRAC_PI_2 - 1e-9,
        "{what}: {angle}"
    );
    for (_, event) in &run.events {
        let (EventKind::ContactBegan { part, .. } | EventKind::ContactEnded { part, .. }) =
            &event.kind
        else {
            continue;
        };
        assert_ne!(
            layout.finger(*part),
            Some(Finger::Thumb),
            "{what}: the thumb took part"
        );
    }
    let fingers = normals.map(|normal| layout.finger(normal.part));
    assert!(
        fingers.contains(&Some(Finger::Index)) && fingers.contains(&Some(Finger::Middle)),
        "{what}: {fingers:?}"
    );
    let lifted = run
        .places(0)
        .filter(|(_, place)| place.pose.translation.y > 0.10);
    let (held, n) = lifted.fold((0, 0), |(held, n), (_, place)| {
        (
            held + u64::from(place.contact == ContactState::Grasped),
            n + 1,
        )
    });
    assert_eq!(held, n, "{what}: nothing but the grasp holds it up");
    assert!(n as f64 / run.rate_hz > 1.0, "{what}: held for {n} ticks");
    let end = run.last(0);
    assert!(end.resting && run.vertices_on_floor(0) == 4, "{what}");
    let moved = end.pose.translation.x.abs();
    assert!((moved - 0.08).abs() < 0.003, "{what}: moved by {moved}");
}
