//! Stage 5: how touched objects move, and what changed.

use nalgebra::{Isometry3, Translation3};

use super::judge::{Found, release_displacement};
use crate::classify::{GraspPair, Verdict, mean_motion};
use crate::environment::floor::{is_on, lifted};
use crate::environment::neighbours::{Mover, shove};
use crate::frame::{EventKind, ReleaseReason};
use crate::motion::{grasp, inertia, push};
use crate::state::{Body, ContactState, HandId, Hold};
use crate::step::Stage;

/// Speed in m/s from which a release is a throw: below it the object was let go.
const THROW_SPEED: f64 = 0.05;

/// Touches that an object takes memory for when it is first touched: as many as two hands in a tight grip make.
const TOUCHES_RESERVED: usize = 64;

/// Moves what hands touch and reports what changed.
pub(crate) fn advance(stage: &mut Stage<'_>) {
    let found = std::mem::take(&mut stage.scratch.found);
    for one in &found {
        report_contacts(stage, one);
        if let Some(reason) = one.lost {
            let_go(stage, one, reason);
        }
        apply(stage, one);
        let touches = &stage.scratch.touches[one.touches.clone()];
        let body = stage.state.taken(one.slot);
        body.touches.clear();
        if body.touches.capacity() < touches.len() {
            body.touches.reserve(touches.len().max(TOUCHES_RESERVED));
        }
        body.touches.extend_from_slice(touches);
    }
    stage.scratch.found = found;
}

fn apply(stage: &mut Stage<'_>, found: &Found) {
    let touches = &stage.scratch.touches[found.touches.clone()];
    let (state, pose) = match &found.verdict {
        Verdict::Free => {
            let body = stage.state.taken(found.slot);
            body.barred &= found.grasps;
            // What was pushed goes on like what was held: by the throw window. The next touch begins a new one.
            body.displacement = release_displacement(body);
            body.track.clear();
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
    let (floor, track_length) = (stage.scene.floor_height, stage.scene.track_length());
    stage.state.wake(slot);
    let body = stage.state.taken(slot);
    let before = body.pose;
    let pose = lifted(&body.spec.shape, &pose, floor);
    let was = std::mem::replace(&mut body.contact, contact);
    body.barred &= found.grasps;
    body.pose = pose;
    body.displacement = pose.translation.vector - before.translation.vector;
    body.spin = inertia::unit(pose.rotation * before.rotation.inverse());
    body.on_floor = is_on(&body.spec.shape, &pose, floor);
    body.topple_case = 0;
    keep_track(body, track_length);
    let moved = pose != before;
    body.still &= !moved;
    if let Verdict::Grasped(pair) = &found.verdict {
        hold(stage, found, pair);
    } else if was != contact {
        report_push(stage, found);
    }
    if moved || was != contact {
        stage.note_motion(slot);
    }
    // What is held stays in its hand, whatever runs into it.
    if moved || was != contact || contact == ContactState::Grasped {
        let translation = stage.state.taken(slot).displacement;
        stage.scratch.movers.push(Mover { slot, translation });
    }
}

/// Says that an object is pushed from now on: by how many contacts, and by the first hand that presses.
fn report_push(stage: &mut Stage<'_>, found: &Found) {
    let touches = &stage.scratch.touches[found.touches.clone()];
    let pressing = touches.iter().filter(|touch| touch.presses());
    let hand = pressing.clone().next().map(|touch| touch.hand);
    let n_contacts = pressing.count() as u32;
    stage.report(found.slot, hand, EventKind::Pushed { n_contacts });
}

/// Begins a hold or goes on with it. The object keeps its pose in the leader's space; where the floor or a change of
/// leader moved it there, that is its place from now on.
fn hold(stage: &mut Stage<'_>, found: &Found, pair: &GraspPair) {
    let touches = &stage.scratch.touches[found.touches.clone()];
    let body = stage
        .state
        .body(found.slot)
        .expect("found objects are there");
    let angle = stage.scene.grasp_angle_of(&body.spec);
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
    let by = end_hold(stage, found.slot, reason);
    if found.verdict == Verdict::Free {
        report_throw(stage, found.slot, by);
    }
}

/// Takes an object out of the hand that it follows, to go on by its throw window. Returns that hand.
pub(crate) fn end_hold(stage: &mut Stage<'_>, slot: u32, reason: ReleaseReason) -> Option<HandId> {
    let body = stage.state.taken(slot);
    let by = body
        .hold
        .take()
        .and_then(|hold| hold.leader)
        .or_else(|| body.touches.first().map(|touch| touch.hand));
    body.displacement = release_displacement(body);
    body.track.clear();
    stage.report(slot, by, EventKind::Released { reason });
    by
}

/// Says that an object was thrown, if it is fast enough.
pub(crate) fn report_throw(stage: &mut Stage<'_>, slot: u32, by: Option<HandId>) {
    let velocity = stage.state.taken(slot).displacement * stage.scene.rate_hz;
    if velocity.norm() >= THROW_SPEED {
        stage.report(slot, by, EventKind::Thrown { velocity });
    }
}

/// Keeps the last positions of a touched object, as many as the throw window asks for.
fn keep_track(body: &mut Body, length: usize) {
    if length > 2 {
        body.track
            .reserve_exact(length.saturating_sub(body.track.len()));
        if body.track.len() == length {
            body.track.remove(0);
        }
        body.track.push(body.position());
    }
}

/// Reports contacts that began or ended: both lists ascend by key.
fn report_contacts(stage: &mut Stage<'_>, found: &Found) {
    let (mut old, mut new) = (0, found.touches.start);
    loop {
        let body = stage
            .state
            .body(found.slot)
            .expect("found objects are there");
        let last = body.touches.get(old).cloned();
        let next = (new < found.touches.end).then(|| stage.scratch.touches[new].clone());
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
    let n_touched = movers.as_slice().len();
    let floor = stage.scene.floor_height;
    shove(
        stage.state,
        stage.broad,
        floor,
        &mut movers,
        &mut stage.scratch.neighbours,
    );
    for mover in &movers.as_slice()[n_touched..] {
        let body = stage.state.taken(mover.slot);
        body.on_floor = is_on(&body.spec.shape, &body.pose, floor);
        body.still = false;
        stage.note_motion(mover.slot);
    }
    stage.scratch.movers = movers;
}
