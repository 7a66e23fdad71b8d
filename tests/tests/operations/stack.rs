//! Operation 5: stacking (Fig. 11).

use crate::drive::{Run, for_all};

#[test]
fn three_blocks_are_stacked_and_stay() {
    for_all("operations/stack", "stack", 10.0, check);
}

fn check(run: &Run, what: &str) {
    let base = run.last(0).pose.translation.vector;
    for (level, object) in (0_u32..).zip(0..3) {
        let end = run.last(object);
        let at = end.pose.translation.vector;
        assert!(end.resting, "{what}: {object}");
        assert!(
            (at.y - 0.025 - 0.05 * f64::from(level)).abs() < 5e-4,
            "{what}: {object} at {at}"
        );
        assert!(
            libm::hypot(at.x - base.x, at.z - base.z) < 0.003,
            "{what}: {object} at {at}"
        );
        // The last ten seconds.
        let then = run.ticks.len() - (10.0 * run.rate_hz) as usize;
        let moved = run.ticks[then..]
            .iter()
            .any(|places| places[object].pose != end.pose);
        assert!(!moved, "{what}: {object} moved after it was left");
    }
    assert_eq!(
        run.last(3).pose,
        run.ticks[0][3].pose,
        "{what}: the L-shape was left alone"
    );
}
