//! Operation 1: free manipulation.

use crate::drive::{Run, for_all};

/// Where the hand is told to put the cube, x and z in metres.
const PLACE: [f64; 2] = [0.12, -0.26];

#[test]
fn a_cube_is_carried_round_set_down_where_told_and_pushed_on() {
    for_all(
        "operations/free",
        &format!("free?to={},{}", PLACE[0], PLACE[1]),
        0.0,
        check,
    );
}

fn check(run: &Run, what: &str) {
    let released = run.events_of(0, "released");
    assert_eq!(run.events_of(0, "grasped").len(), 1, "{what}");
    assert_eq!(released.len(), 1, "{what}");
    let top = run
        .places(0)
        .map(|(_, place)| place.pose.translation.y)
        .fold(0.0, f64::max);
    assert!(top > 0.18, "{what}: lifted to {top}");
    // Where it lies between the hand's leaving it and the push.
    let set_down = run.position(released[0].0 + (0.4 * run.rate_hz) as u64, 0);
    let off = libm::hypot(set_down.x - PLACE[0], set_down.z - PLACE[1]);
    assert!(
        off < 0.002 && (set_down.y - 0.025).abs() < 1e-6,
        "{what}: set down at {set_down}"
    );
    let pushed = run.position(run.ticks.len() as u64 - 1, 0) - set_down;
    assert!(
        (-0.055..-0.045).contains(&pushed.z) && pushed.x.abs() < 0.003,
        "{what}: pushed by {pushed}"
    );
    assert!(
        run.last(0).resting && run.vertices_on_floor(0) == 4,
        "{what}"
    );
}
