//! The scene of the daemon's first start.

use tsukamu_world::hand::sample::HandSample;

use crate::drive::{Run, for_all};

#[test]
fn the_demo_moves_stacks_and_throws_and_ends_where_it_began() {
    for_all("demo", "demo", 0.0, check);
}

fn check(run: &Run, what: &str) {
    let [cube, block, l, pyramid] = [0, 1, 2, 3].map(|object| run.last(object));
    assert!(
        [cube, block, l, pyramid].iter().all(|place| place.resting),
        "{what}"
    );
    let moved = (cube.pose.translation.vector - run.position(0, 0).coords).norm();
    assert!(moved > 0.1, "{what}: the cube moved by {moved}");
    let on_top = block.pose.translation.vector - cube.pose.translation.vector;
    assert!(
        libm::hypot(on_top.x, on_top.z) < 0.004 && (on_top.y - 0.05).abs() < 5e-4,
        "{what}: {on_top}"
    );
    assert!(run.events_of(3, "thrown").len() == 1, "{what}");
    let thrown = (pyramid.pose.translation.vector - run.position(0, 3).coords).norm();
    assert!(thrown > 0.5, "{what}: the pyramid went {thrown}");
    assert_eq!(l.pose, run.ticks[0][2].pose, "{what}");
    let period = run.hand.period_s().expect("the demo goes on for ever");
    assert!((10.0..60.0).contains(&period), "{what}: {period}");
    let [start, end] = [0.0, period].map(|t| run.hand.sample_at(t));
    let gap = |sample: &HandSample| sample.wrist.translation.vector;
    assert!(
        (gap(&start) - gap(&end)).norm() < 1e-3,
        "{what}: the hand jumps at the end of the period"
    );
}
