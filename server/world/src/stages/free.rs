//! Stage 6: objects that no hand moves fall, land, topple, meet neighbours and come to rest.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::environment::floor::{Outcome, is_on, lifted, settle};
use crate::environment::neighbours::{Stop, stop_on_the_way};
use crate::environment::targets;
use crate::frame::{EventKind, Support};
use crate::motion::inertia;
use crate::polyhedron::aabb::Aabb;
use crate::state::Rest;
use crate::step::Stage;

/// Around an object that moved, what leans on another within this margin is looked at again, in metres.
const LEANING_M: f64 = 1.0e-3;

/// Moves every object that is awake and that no hand, and nothing a hand moves, has moved in this step.
pub(crate) fn advance(stage: &mut Stage<'_>) {
    let mut slots = std::mem::take(&mut stage.scratch.slots);
    slots.clear();
    slots.extend_from_slice(&stage.state.awake);
    for &slot in &slots {
        let touched = stage
            .scratch
            .found
            .binary_search_by_key(&slot, |found| found.slot);
        let held = touched.is_ok_and(|index| stage.scratch.found[index].is_moved());
        let shoved = stage.scratch.movers.contains(slot);
        if !held && !shoved {
            advance_one(stage, slot);
        }
    }
    stage.state.awake.retain(|slot| {
        stage.state.slots[*slot as usize]
            .body
            .as_ref()
            .is_some_and(|body| !body.is_resting())
    });
    stage.scratch.slots = slots;
}

/// What a free object does in one step before its neighbours are asked.
struct Way {
    to: Isometry3<f64>,
    /// On the floor at the end of it.
    on_floor: bool,
    /// Whether it came from the air.
    landed: bool,
    /// What the floor made of it, if it was asked.
    outcome: Option<Outcome>,
}

fn advance_one(stage: &mut Stage<'_>, slot: u32) {
    let way = way(stage, slot);
    let blocked = {
        let scratch = &mut stage.scratch.neighbours;
        stop_on_the_way(stage.state, stage.broad, slot, &way.to, scratch)
    };
    let before = stage.state.taken(slot).pose;
    match blocked {
        Some(stop) => stop_at(stage, slot, &stop),
        None => go(stage, slot, &way),
    }
    let after = stage.state.taken(slot).pose;
    if after != before {
        stage.note_motion(slot);
        report_hits(stage, slot, &before, &after);
    }
}

fn way(stage: &mut Stage<'_>, slot: u32) -> Way {
    let (gravity_step, floor) = (stage.gravity_step(), stage.scene.floor_height);
    let body = stage.state.body(slot).expect("awake slots are taken");
    let shape = &body.spec.shape;
    let gm = body.displacement + gravity_step;
    if body.on_floor {
        // What has touched the floor keeps no inertia: it stands or topples, and does not leave it again by itself.
        let gravity = &stage.scene.gravity;
        let settled = settle(
            shape,
            &body.pose,
            &gm,
            gravity,
            floor,
            &mut stage.scratch.floor,
        );
        return Way {
            to: settled.pose,
            on_floor: true,
            landed: false,
            outcome: Some(settled.outcome),
        };
    }
    let to = inertia::free(&body.pose, &body.displacement, &body.spin, &gravity_step);
    if !is_on(shape, &to, floor) {
        return Way {
            to,
            on_floor: false,
            landed: false,
            outcome: None,
        };
    }
    // From the air it comes to lie on the floor in this step, and topples from the next one on.
    let to = lifted(shape, &to, floor);
    let settled = settle(
        shape,
        &to,
        &gm,
        &stage.scene.gravity,
        floor,
        &mut stage.scratch.floor,
    );
    Way {
        to,
        on_floor: true,
        landed: true,
        outcome: Some(settled.outcome),
    }
}

fn go(stage: &mut Stage<'_>, slot: u32, way: &Way) {
    let rate = stage.scene.rate_hz;
    let body = stage.state.taken(slot);
    let fall = body.displacement * rate;
    let at_rest_before = body.displacement == Vector3::zeros();
    body.on_floor = way.on_floor;
    body.displacement = way.to.translation.vector - body.pose.translation.vector;
    let turned = way.to.rotation * body.pose.rotation.inverse();
    // In the air the rotation goes on; on the floor only what it topples by.
    body.spin = match (way.outcome, way.landed) {
        (None, _) => body.spin,
        (Some(_), true) => UnitQuaternion::identity(),
        (Some(_), false) => inertia::unit(turned),
    };
    if way.to != body.pose {
        body.still = false;
    }
    body.pose = way.to;
    let case = body.topple_case;
    if way.landed {
        stage.report(slot, None, EventKind::Landed { velocity: fall });
    }
    match way.outcome {
        Some(Outcome::Stable) => rest(stage, slot, Rest::OnFloor),
        Some(Outcome::Balanced) if at_rest_before => rest(stage, slot, Rest::OnFloor),
        Some(Outcome::Toppling { case: new, struck }) if !way.landed => {
            stage.state.taken(slot).topple_case = if struck { 0 } else { new };
            if case == 0 {
                stage.report(slot, None, EventKind::Toppled { case: new });
            }
        }
        _ => stage.state.taken(slot).topple_case = 0,
    }
}

fn stop_at(stage: &mut Stage<'_>, slot: u32, stop: &Stop) {
    let floor = stage.scene.floor_height;
    let by = stage.state.id(stop.by);
    let body = stage.state.taken(slot);
    // Half-way between two poses on the floor a turning object may reach below it.
    let pose = lifted(&body.spec.shape, &stop.pose, floor);
    let moved = body.pose != pose || !body.still;
    body.still &= body.pose == pose;
    body.pose = pose;
    body.stop();
    body.on_floor = is_on(&body.spec.shape, &body.pose, floor);
    if moved {
        stage.report(slot, None, EventKind::Blocked { by });
    }
    rest(stage, slot, Rest::OnObject(stop.by));
}

/// It lies still. While a hand touches it, it stays awake all the same, or the end of the contact would go unseen.
fn rest(stage: &mut Stage<'_>, slot: u32, on: Rest) {
    let touched = stage
        .scratch
        .found
        .binary_search_by_key(&slot, |found| found.slot)
        .is_ok();
    let body = stage.state.taken(slot);
    body.stop();
    if body.touches.is_empty() {
        body.rest = on;
    }
    let said = std::mem::replace(&mut body.still, true);
    if touched || !said {
        stage.scratch.changed.push(slot);
    }
    if said {
        return;
    }
    let on = match on {
        Rest::OnObject(other) => Support::Object(stage.state.id(other)),
        Rest::OnFloor | Rest::Awake => Support::Floor,
    };
    stage.report(slot, None, EventKind::Rested { on });
}

fn report_hits(stage: &mut Stage<'_>, slot: u32, before: &Isometry3<f64>, after: &Isometry3<f64>) {
    let [from, to] = [before, after].map(|pose| pose.translation.vector.into());
    for (index, target) in (0_u32..).zip(&stage.scene.targets) {
        if let Some(distance) = targets::hit(target, &from, &to) {
            let object = Some(stage.state.id(slot));
            let kind = EventKind::HitTarget {
                target: index,
                distance,
            };
            stage.frame.events.push(crate::frame::Event {
                object,
                hand: None,
                kind,
            });
        }
    }
}

/// Wakes what leans on objects that moved in this step.
pub(crate) fn wake_neighbours(stage: &mut Stage<'_>) {
    let moved = std::mem::take(&mut stage.scratch.moved);
    for (slot, around) in &moved {
        wake_near(stage, *slot, around);
    }
    stage.scratch.moved = moved;
}

/// Wakes what leans on others near the box of an object that moved or went.
pub(crate) fn wake_near(stage: &mut Stage<'_>, slot: u32, around: &Aabb) {
    let mut slots = std::mem::take(&mut stage.scratch.slots);
    slots.clear();
    stage.broad.query(&around.grown(LEANING_M), &mut slots);
    for &near in &slots {
        let leans = stage
            .state
            .body(near)
            .is_some_and(|body| matches!(body.rest, Rest::OnObject(_)));
        if near != slot && leans {
            stage.state.wake(near);
        }
    }
    stage.scratch.slots = slots;
}
