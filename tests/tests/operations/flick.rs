//! Operation 3: a flick with a fingertip (Fig. 9).

use crate::drive::{Run, for_all};

#[test]
fn a_pyramid_is_flicked_away_and_comes_to_rest_on_a_face() {
    for_all("operations/flick", "flick", 1.0, check);
}

fn check(run: &Run, what: &str) {
    let way = run.last(0).pose.translation.vector - run.position(0, 0).coords;
    assert!(
        way.norm() > 0.10 && way.z < -0.10,
        "{what}: flicked by {way}"
    );
    let flown = run
        .places(0)
        .filter(|(_, place)| place.contact.name() == "free" && !place.resting)
        .count();
    assert!(flown > 1, "{what}: it never left the finger");
    assert!(run.events_of(0, "grasped").is_empty(), "{what}");
    assert!(
        run.last(0).resting && run.vertices_on_floor(0) >= 3,
        "{what}"
    );
}
