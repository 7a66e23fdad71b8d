//! Walks the state in debug builds and asserts every invariant that the stages rely on.

use crate::state::{ContactState, State};

/// Asserts the invariants of a state after a step.
///
/// # Panics
/// When one is broken: that is a bug of a stage.
pub(crate) fn validate(state: &State) {
    assert!(
        state.awake.is_sorted_by(|a, b| a < b),
        "the awake slots ascend"
    );
    assert!(
        state.hands.is_sorted_by(|a, b| a.id < b.id),
        "the hands ascend by id"
    );
    for (slot, place) in (0_u32..).zip(&state.slots) {
        let Some(body) = &place.body else {
            assert!(
                state.awake.binary_search(&slot).is_err(),
                "an empty slot is not awake"
            );
            continue;
        };
        let awake = state.awake.binary_search(&slot).is_ok();
        assert_eq!(awake, !body.is_resting(), "slot {slot}: awake, or at rest");
        assert!(
            body.pose.translation.vector.iter().all(|x| x.is_finite()),
            "slot {slot}: a finite place"
        );
        assert!(
            (body.pose.rotation.norm() - 1.0).abs() < 1.0e-9,
            "slot {slot}: a unit rotation"
        );
        let grasped = body.contact == ContactState::Grasped;
        assert_eq!(
            grasped,
            body.hold.is_some(),
            "slot {slot}: a hold for each grasp"
        );
        assert!(
            body.contact == ContactState::Free || !body.touches.is_empty(),
            "slot {slot}: touched by something"
        );
        assert!(
            body.touches.is_sorted_by(|a, b| a.key() < b.key()),
            "slot {slot}: contacts ascend, each once"
        );
    }
}
