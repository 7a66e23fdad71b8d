//! The invariants of a state that the stages rely on: asserted after each step in debug builds, checked in snapshots.

use thiserror::Error;

use crate::contact::Touch;
use crate::frame::{Feature, Tracking};
use crate::hand::hand_state::HandState;
use crate::hand::judgement::PosedHand;
use crate::hand::part::PartLayout;
use crate::scene::Scene;
use crate::state::{Body, ContactState, Rest, State};

/// How far a rotation's length may be from one.
const UNIT_TOLERANCE: f64 = 1.0e-9;
/// Largest number in a state that is read, metres: far beyond any scene, and sums of it stay finite.
const NUMBER_MAX: f64 = 1.0e12;
/// Latest tick of a state that is read: no clock comes there, and ticks up to it are whole numbers in f64.
const TICK_MAX: u64 = 1 << 53;

/// An invariant of a state that does not hold.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum StateFault {
    /// One of the whole state.
    #[error("{0}")]
    State(&'static str),
    /// One of the object in a slot.
    #[error("slot {0}: {1}")]
    Object(u32, &'static str),
    /// One of a hand, by id.
    #[error("hand {0}: {1}")]
    Hand(u32, &'static str),
}

/// Asserts the invariants of a state after a step.
///
/// # Panics
/// When one is broken: that is a bug of a stage.
pub(crate) fn validate(state: &State) {
    if let Err(fault) = check(state) {
        panic!("a step must not end so: {fault}");
    }
}

/// Whether the invariants hold that every step keeps.
///
/// # Errors
/// The first that does not.
pub(crate) fn check(state: &State) -> Result<(), StateFault> {
    let must = |holds: bool, what| holds.then_some(()).ok_or(StateFault::State(what));
    must(
        state.awake.is_sorted_by(|a, b| a < b),
        "the awake slots do not ascend",
    )?;
    must(
        state.hands.is_sorted_by(|a, b| a.id < b.id),
        "the hands do not ascend by id",
    )?;
    for (slot, place) in (0_u32..).zip(&state.slots) {
        let awake = state.awake.binary_search(&slot).is_ok();
        match &place.body {
            Some(body) => check_body(body, awake),
            None => require(!awake, "an empty slot is awake"),
        }
        .map_err(|what| StateFault::Object(slot, what))?;
    }
    Ok(())
}

fn check_body(body: &Body, awake: bool) -> Result<(), &'static str> {
    let grasped = body.contact == ContactState::Grasped;
    require(
        awake != body.is_resting(),
        "awake and at rest, or neither of both",
    )?;
    require(
        body.pose.translation.vector.iter().all(|x| x.is_finite()),
        "its place is not finite",
    )?;
    require(
        is_unit(body.pose.rotation.norm()),
        "its rotation is not of unit length",
    )?;
    require(
        grasped == body.hold.is_some(),
        "a grasp without a hold, or a hold without a grasp",
    )?;
    require(
        body.contact == ContactState::Free || !body.touches.is_empty(),
        "pushed or grasped, but touched by nothing",
    )?;
    require(
        body.touches.is_sorted_by(|a, b| a.key() < b.key()),
        "its contacts do not ascend, each once",
    )
}

/// Whether a state that was read can be gone on from in that scene: what types and stages promise of one that was made.
///
/// # Errors
/// The first thing that is not so.
pub(crate) fn check_read(state: &State, scene: &Scene) -> Result<(), StateFault> {
    if state.tick > TICK_MAX {
        return Err(StateFault::State("its tick is beyond every clock"));
    }
    for (slot, place) in (0_u32..).zip(&state.slots) {
        if let Some(body) = &place.body {
            check_read_body(body, state, scene).map_err(|what| StateFault::Object(slot, what))?;
        }
    }
    for hand in &state.hands {
        check_read_hand(hand).map_err(|what| StateFault::Hand(hand.id.0, what))?;
    }
    check(state)
}

fn check_read_body(body: &Body, state: &State, scene: &Scene) -> Result<(), &'static str> {
    let place = body.pose.translation.vector.iter();
    let track = body.track.iter().flat_map(|point| point.iter());
    require(
        are_numbers(place.chain(&body.displacement).chain(track)),
        "its motion is not finite",
    )?;
    require(is_unit(body.spin.norm()), "its spin is not of unit length")?;
    require(
        body.track.len() <= scene.track_length(),
        "its track is longer than the throw window",
    )?;
    require(body.topple_case <= 3, "there are three cases of toppling")?;
    if let Rest::OnObject(other) = body.rest {
        require(
            (other as usize) < state.slots.len(),
            "it lies on a slot that is not there",
        )?;
    }
    if let Some(hold) = &body.hold {
        let place = &hold.wrist_from_object;
        require(
            are_numbers(place.translation.vector.iter()) && is_unit(place.rotation.norm()),
            "its place in the hand is no pose",
        )?;
        require(
            hold.since_tick <= state.tick,
            "it is held from a later tick on",
        )?;
    }
    body.touches
        .iter()
        .try_for_each(|touch| check_read_touch(touch, body))
}

fn check_read_touch(touch: &Touch, body: &Body) -> Result<(), &'static str> {
    let shape = &body.spec.shape;
    let (index, n) = match touch.feature {
        Feature::Face(face) => (face, shape.faces().len()),
        Feature::Edge(edge) => (edge, shape.edges().len()),
    };
    require(
        (index as usize) < n,
        "a contact is on a face or edge that is not there",
    )?;
    let vectors = touch.point.iter().chain(&touch.motion);
    require(
        are_numbers(vectors.chain(&touch.normal).chain([&touch.fraction])),
        "a contact is not finite",
    )
}

fn check_read_hand(hand: &HandState) -> Result<(), &'static str> {
    hand.model
        .validate()
        .map_err(|_fault| "its model is out of bounds")?;
    let layout = PartLayout::of(&hand.model);
    let parts = match hand.tracking {
        Tracking::Never => (0, 0),
        Tracking::Tracked | Tracking::Held | Tracking::Lost => {
            (layout.n_points(), layout.n_segments())
        }
    };
    for posed in [&hand.posed, &hand.before] {
        check_read_posed(posed, parts)?;
    }
    let known = hand.memory.places.iter().flatten();
    require(
        are_numbers(known.chain(&hand.shown).flat_map(|point| point.iter())),
        "its joints are not finite",
    )?;
    for opening in &hand.openings {
        let path = opening.path.iter();
        let directions = path.flat_map(|path| {
            path.touched
                .iter()
                .chain([&path.straight, &path.lifted])
                .flat_map(|direction| direction.iter())
        });
        require(
            are_numbers(directions.chain([&opening.opening])),
            "a finger's opening is not finite",
        )?;
    }
    Ok(())
}

fn check_read_posed(posed: &PosedHand, parts: (usize, usize)) -> Result<(), &'static str> {
    let (n_points, n_segments) = parts;
    require(
        posed.points.len() == n_points && posed.point_valid.len() == n_points,
        "it has not as many points as its model",
    )?;
    require(
        posed.segments.len() == n_segments && posed.segment_valid.len() == n_segments,
        "it has not as many segments as its model",
    )?;
    let wrist = posed.wrist.translation.vector.iter();
    let ends = posed.segments.iter().flatten().chain(&posed.points);
    let numbers = wrist
        .chain(posed.wrist.rotation.coords.iter())
        .chain(ends.flat_map(|point| point.iter()));
    require(are_numbers(numbers), "its pose is not finite")
}

fn require(holds: bool, what: &'static str) -> Result<(), &'static str> {
    holds.then_some(()).ok_or(what)
}

fn are_numbers<'a>(mut numbers: impl Iterator<Item = &'a f64>) -> bool {
    numbers.all(|number| number.abs() <= NUMBER_MAX)
}

fn is_unit(length: f64) -> bool {
    (length - 1.0).abs() < UNIT_TOLERANCE
}
