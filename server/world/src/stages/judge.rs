//! Stages 2 to 4: which objects the hands touch, and what the contacts amount to.

use std::ops::Range;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::classify::{Verdict, classify, classify_push, widest_pair};
use crate::contact::{self, Path, Touch};
use crate::frame::ReleaseReason;
use crate::motion::{grasp, inertia};
use crate::scene::Model;
use crate::state::{Body, ContactState, HandId, Hold, State};
use crate::step::Stage;

/// One object that hands touch, or held until this step.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    /// Its slot.
    pub(crate) slot: u32,
    /// The motion that the contacts were found on.
    pub(crate) now: Isometry3<f64>,
    /// Its contacts, as a range of the scratch's touches.
    pub(crate) touches: Range<usize>,
    /// What they amount to.
    pub(crate) verdict: Verdict,
    /// Why a grasp ended in this step.
    pub(crate) lost: Option<ReleaseReason>,
    /// Whether the grasp test holds; a barred object is not grasped all the same.
    pub(crate) grasps: bool,
}

impl Found {
    /// Whether a hand moves it in this step.
    pub(crate) fn is_moved(&self) -> bool {
        self.verdict != Verdict::Free
    }
}

/// Finds the contacts of all hands with all objects that they may meet, and classifies each object.
pub(crate) fn find(stage: &mut Stage<'_>) {
    let mut slots = std::mem::take(&mut stage.scratch.slots);
    slots.clear();
    slots.extend_from_slice(&stage.state.awake);
    for (hand, swept) in stage.state.hands.iter().zip(&stage.scratch.swept) {
        if hand.can_touch() {
            stage.broad.query(swept, &mut slots);
        }
    }
    slots.sort_unstable();
    slots.dedup();
    for &slot in &slots {
        if let Some(found) = judge(stage, slot) {
            stage.scratch.found.push(found);
        }
    }
    stage.scratch.slots = slots;
}

fn judge(stage: &mut Stage<'_>, slot: u32) -> Option<Found> {
    let body = stage.state.body(slot)?;
    let gravity_step = stage.gravity_step();
    let held = body.hold;
    let supposed = match held {
        Some(hold) => followed(stage.state, body, &hold, &mut stage.scratch.pairs),
        // What lies, stands or is pushed is met where it is; only what flies is met on its way.
        None if body.on_floor || body.still || body.contact != ContactState::Free => body.pose,
        None => inertia::free(&body.pose, &body.displacement, &body.spin, &gravity_step),
    };
    let angle = stage.scene.grasp_angle_of(&body.spec);
    let (contact, touches) = (&mut stage.scratch.contact, &mut stage.scratch.touches);
    let first = touches.len();
    let mut now = supposed;
    touch(
        stage.state,
        &stage.scratch.swept,
        body,
        &now,
        contact,
        touches,
    );
    let mut verdict = match stage.scene.model {
        Model::Paper => classify(&touches[first..], angle),
    };
    let mut lost = None;
    let grasps = matches!(verdict, Verdict::Grasped(_));
    if body.barred && grasps {
        verdict = Verdict::Free;
    } else if held.is_some() && !grasps {
        lost = Some(release_reason(stage.state, body, &touches[first..], angle));
        // It is in the hand no more: what still touches it is judged against its own flight.
        touches.truncate(first);
        let displacement = release_displacement(body);
        now = inertia::free(&body.pose, &displacement, &body.spin, &gravity_step);
        touch(
            stage.state,
            &stage.scratch.swept,
            body,
            &now,
            contact,
            touches,
        );
        verdict = classify_push(&touches[first..]);
    }
    let known = touches.len() > first || !body.touches.is_empty() || lost.is_some() || body.barred;
    known.then_some(Found {
        slot,
        now,
        touches: first..touches.len(),
        verdict,
        lost,
        grasps,
    })
}

fn touch(
    state: &State,
    swept: &[crate::polyhedron::aabb::Aabb],
    body: &Body,
    now: &Isometry3<f64>,
    scratch: &mut contact::ContactScratch,
    touches: &mut Vec<Touch>,
) {
    let shape = &body.spec.shape;
    let path = Path {
        before: body.pose,
        now: *now,
    };
    let around = shape
        .aabb()
        .moved(&path.before)
        .joined(&shape.aabb().moved(&path.now));
    for (hand, swept) in state.hands.iter().zip(swept) {
        if hand.can_touch() && swept.meets(&around) {
            contact::find(hand, shape, &path, &body.touches, scratch, touches);
        }
    }
}

/// Where a held object goes: with its leader's wrist, or with the contact points of all hands together.
fn followed(
    state: &State,
    body: &Body,
    hold: &Hold,
    pairs: &mut Vec<[Point3<f64>; 2]>,
) -> Isometry3<f64> {
    if let Some(leader) = hold.leader {
        // A leader that left the world leaves the object where it is; its contacts are gone.
        return state
            .hand(leader)
            .map_or(body.pose, |hand| grasp::carried(hand.wrist(), hold));
    }
    pairs.clear();
    pairs.extend(body.touches.iter().filter_map(|touch| {
        let hand = state.hand(touch.hand)?;
        Some([touch.part_in(&hand.before)?, touch.part_in(&hand.posed)?])
    }));
    let moved = grasp::rigid_motion(pairs) * body.pose;
    Isometry3::from_parts(moved.translation, inertia::unit(moved.rotation))
}

fn release_reason(state: &State, body: &Body, touches: &[Touch], threshold: f64) -> ReleaseReason {
    let lost = |id: HandId| {
        // Gone, lost, or another one that was not seen yet.
        state.hand(id).is_none_or(|hand| !hand.can_touch())
    };
    if body.touches.iter().any(|touch| lost(touch.hand)) {
        return ReleaseReason::TrackingLost;
    }
    if touches.is_empty() {
        return ReleaseReason::ContactsGone;
    }
    let angle = widest_pair(touches, None).map_or(0.0, |pair| pair.angle());
    ReleaseReason::AngleFell { angle, threshold }
}

/// The displacement per step with which a released object goes on: over the throw window where that is longer than
/// a step, else that of the last step.
pub(crate) fn release_displacement(body: &Body) -> Vector3<f64> {
    inertia::window_displacement(&body.track).unwrap_or(body.displacement)
}
