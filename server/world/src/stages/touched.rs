//! Stages 2 to 5: which objects the hands touch, what the contacts amount to, how touched objects move.

use nalgebra::{Isometry3, Point3, Translation3};

use crate::classify::{GraspPair, Verdict, classify, classify_push, mean_motion, widest_pair};
use crate::contact::{self, Path, Touch};
use crate::environment::floor::{is_on, lifted};
use crate::environment::neighbours::{Mover, shove};
use crate::frame::{EventKind, ReleaseReason, Tracking};
use crate::hand::part::JudgementPart;
use crate::motion::{grasp, inertia, push};
use crate::scene::Model;
use crate::state::{Body, ContactState, HandId, Hold, State};
use crate::step::Stage;

/// Speed in m/s from which a release is a throw: below it the object was let go.
const THROW_SPEED: f64 = 0.05;

/// One object that hands touch, or held until this step.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    /// Its slot.
    pub(crate) slot: u32,
    /// The motion that the contacts were found on.
    now: Isometry3<f64>,
    /// Its contacts, as a range of the scratch's touches.
    touches: (usize, usize),
    /// What they amount to.
    verdict: Verdict,
    /// Why a grasp ended in this step.
    lost: Option<ReleaseReason>,
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
        None if body.on_floor || body.is_resting() || body.contact != ContactState::Free => {
            body.pose
        }
        None => inertia::free(&body.pose, &body.displacement, &body.spin, &gravity_step),
    };
    let angle = body.spec.grasp_angle.unwrap_or(stage.scene.grasp_angle);
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
    let still_held = matches!(verdict, Verdict::Grasped(_));
    if body.barred && still_held {
        verdict = Verdict::Free;
    } else if held.is_some() && !still_held {
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
        touches: (first, touches.len()),
        verdict,
        lost,
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
        Some([part_at(&hand.before, touch)?, part_at(&hand.posed, touch)?])
    }));
    let moved = grasp::rigid_motion(pairs) * body.pose;
    Isometry3::from_parts(moved.translation, inertia::unit(moved.rotation))
}

/// Where the touching place of a part is in a posed hand, world space.
fn part_at(posed: &crate::hand::judgement::PosedHand, touch: &Touch) -> Option<Point3<f64>> {
    match touch.part {
        JudgementPart::Point(index) => posed.points.get(usize::from(index)).copied(),
        JudgementPart::Segment(index) => {
            let [a, b] = posed.segments.get(usize::from(index))?;
            Some(a + (b - a) * touch.fraction)
        }
    }
}

fn release_reason(state: &State, body: &Body, touches: &[Touch], threshold: f64) -> ReleaseReason {
    let lost = |id: HandId| {
        state
            .hand(id)
            .is_none_or(|hand| hand.tracking == Tracking::Lost)
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
fn release_displacement(body: &Body) -> nalgebra::Vector3<f64> {
    inertia::window_displacement(&body.track).unwrap_or(body.displacement)
}

/// Moves what hands touch and reports what changed.
pub(crate) fn advance(stage: &mut Stage<'_>) {
    let found = std::mem::take(&mut stage.scratch.found);
    for one in &found {
        report_contacts(stage, one);
        if let Some(reason) = one.lost {
            let_go(stage, one, reason);
        }
        apply(stage, one);
        let touches = &stage.scratch.touches[one.touches.0..one.touches.1];
        let body = stage.state.taken(one.slot);
        body.touches.clear();
        body.touches.extend_from_slice(touches);
    }
    stage.scratch.found = found;
}

fn apply(stage: &mut Stage<'_>, found: &Found) {
    let touches = &stage.scratch.touches[found.touches.0..found.touches.1];
    let (state, pose) = match &found.verdict {
        Verdict::Free => {
            let grasps = widest_pair(touches, None).is_some_and(|pair| {
                pair.holds_at(
                    stage
                        .state
                        .body(found.slot)
                        .and_then(|b| b.spec.grasp_angle)
                        .unwrap_or(stage.scene.grasp_angle),
                )
            });
            let body = stage.state.taken(found.slot);
            body.barred &= grasps;
            if body.contact != ContactState::Free {
                body.contact = ContactState::Free;
                stage.scratch.changed.push(found.slot);
            }
            return;
        }
        Verdict::PushedAtOne(index) => {
            let touch = &touches[*index];
            let pose = push::pushed(
                &found.now,
                &(found.now * touch.point),
                &(found.now.rotation * touch.motion),
            );
            (ContactState::PushedAtOne, pose)
        }
        Verdict::PushedAtSeveral => {
            let way = found.now.rotation * mean_motion(touches);
            (
                ContactState::PushedAtSeveral,
                Translation3::from(way) * found.now,
            )
        }
        Verdict::Grasped(_) => (ContactState::Grasped, found.now),
    };
    place(stage, found, state, pose);
}

fn place(stage: &mut Stage<'_>, found: &Found, contact: ContactState, pose: Isometry3<f64>) {
    let slot = found.slot;
    let n_contacts = (found.touches.1 - found.touches.0) as u32;
    let first_hand = stage
        .scratch
        .touches
        .get(found.touches.0)
        .map(|touch| touch.hand);
    let floor = stage.scene.floor_height;
    stage.state.wake(slot);
    let body = stage.state.taken(slot);
    let before = body.pose;
    let pose = lifted(&body.spec.shape, &pose, floor);
    let was = std::mem::replace(&mut body.contact, contact);
    body.pose = pose;
    body.displacement = pose.translation.vector - before.translation.vector;
    body.spin = inertia::unit(pose.rotation * before.rotation.inverse());
    body.on_floor = is_on(&body.spec.shape, &pose, floor);
    body.topple_case = 0;
    keep_track(body);
    let moved = pose != before;
    body.still &= !moved;
    if let Verdict::Grasped(pair) = &found.verdict {
        hold(stage, found, pair);
    } else if was != contact {
        stage.report(slot, first_hand, EventKind::Pushed { n_contacts });
    }
    if moved || was != contact {
        stage.note_motion(slot);
        let translation = stage.state.taken(slot).displacement;
        stage.scratch.movers.push(Mover { slot, translation });
    }
}

/// Begins a hold or goes on with it. The object keeps its pose in the leader's space; where the floor or a change of
/// leader moved it there, that is its place from now on.
fn hold(stage: &mut Stage<'_>, found: &Found, pair: &GraspPair) {
    let touches = &stage.scratch.touches[found.touches.0..found.touches.1];
    let body = stage
        .state
        .body(found.slot)
        .expect("found objects are there");
    let angle = body.spec.grasp_angle.unwrap_or(stage.scene.grasp_angle);
    let so_far = body.hold;
    let leader = grasp::leader(touches, angle, so_far.and_then(|hold| hold.leader));
    let stays = so_far.is_some_and(|hold| hold.leader == leader) && body.pose == found.now;
    if !stays {
        let wrist = leader
            .and_then(|id| stage.state.hand(id))
            .map_or_else(Isometry3::identity, |hand| *hand.wrist());
        let wrist_from_object = wrist.inv_mul(&body.pose);
        let since_tick = so_far.map_or(stage.state.tick, |hold| hold.since_tick);
        stage.state.taken(found.slot).hold = Some(Hold {
            leader,
            wrist_from_object,
            since_tick,
        });
    }
    if so_far.is_none() {
        let by = leader.or(Some(pair.normals[0].hand));
        stage.report(
            found.slot,
            by,
            EventKind::Grasped {
                normals: pair.normals,
                angle: pair.angle(),
            },
        );
    }
}

fn let_go(stage: &mut Stage<'_>, found: &Found, reason: ReleaseReason) {
    let rate = stage.scene.rate_hz;
    let body = stage.state.taken(found.slot);
    let by = body
        .hold
        .take()
        .and_then(|hold| hold.leader)
        .or_else(|| body.touches.first().map(|touch| touch.hand));
    body.displacement = release_displacement(body);
    body.track.clear();
    let velocity = body.displacement * rate;
    stage.report(found.slot, by, EventKind::Released { reason });
    if found.verdict == Verdict::Free && velocity.norm() >= THROW_SPEED {
        stage.report(found.slot, by, EventKind::Thrown { velocity });
    }
}

/// Keeps the last positions of a touched object, as many as the throw window asks for.
fn keep_track(body: &mut Body) {
    let window = body.track.capacity();
    if window > 2 {
        if body.track.len() == window {
            body.track.remove(0);
        }
        body.track.push(body.position());
    }
}

/// Reports contacts that began or ended: both lists ascend by key.
fn report_contacts(stage: &mut Stage<'_>, found: &Found) {
    let (mut old, mut new) = (0, found.touches.0);
    loop {
        let body = stage
            .state
            .body(found.slot)
            .expect("found objects are there");
        let last = body.touches.get(old).cloned();
        let next = (new < found.touches.1).then(|| stage.scratch.touches[new].clone());
        match (last, next) {
            (None, None) => return,
            (Some(a), Some(b)) if a.key() == b.key() => {
                old += 1;
                new += 1;
            }
            (Some(a), b) if b.as_ref().is_none_or(|b| a.key() < b.key()) => {
                old += 1;
                stage.report(
                    found.slot,
                    Some(a.hand),
                    EventKind::ContactEnded {
                        part: a.part,
                        feature: a.feature,
                    },
                );
            }
            (_, Some(b)) => {
                new += 1;
                let point = found.now * b.point;
                let kind = EventKind::ContactBegan {
                    part: b.part,
                    feature: b.feature,
                    point,
                };
                stage.report(found.slot, Some(b.hand), kind);
            }
            (Some(_), None) => {
                unreachable!("the second arm takes every last contact without a next")
            }
        }
    }
}

/// Translates what touched objects ran into along with them.
pub(crate) fn shove_neighbours(stage: &mut Stage<'_>) {
    let mut movers = std::mem::take(&mut stage.scratch.movers);
    let n_touched = movers.len();
    let floor = stage.scene.floor_height;
    shove(
        stage.state,
        stage.broad,
        floor,
        &mut movers,
        &mut stage.scratch.neighbours,
    );
    for mover in &movers[n_touched..] {
        let body = stage.state.taken(mover.slot);
        body.on_floor = is_on(&body.spec.shape, &body.pose, floor);
        body.still = false;
        stage.note_motion(mover.slot);
    }
    stage.scratch.movers = movers;
}
