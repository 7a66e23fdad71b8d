//! Commands of a tick. One that cannot be carried out changes nothing.

use std::sync::Arc;

use crate::environment::floor::is_on;
use crate::frame::{Event, EventKind, ReleaseReason};
use crate::hand::hand_state::HandState;
use crate::input::Command;
use crate::scene::{OBJECTS_MAX, ObjectSpec};
use crate::stages::touched::{end_hold, report_throw};
use crate::state::{Body, ContactState, HandId, ObjectId, Slot};
use crate::step::{World, start};

/// Carries them out in their order.
pub(crate) fn carry_out(world: &mut World, commands: &[Command]) {
    for command in commands {
        match command {
            Command::AddHand { hand, model } => add_hand(world, *hand, model),
            Command::RemoveHand(hand) => remove_hand(world, *hand),
            Command::AddObject(spec) => add_object(world, spec),
            Command::RemoveObject(id) => remove_object(world, *id),
            Command::Release(id) => release(world, *id),
            Command::Reset => reset(world),
            Command::SetModel(model) => world.scene_mut().model = *model,
        }
    }
}

fn add_hand(world: &mut World, id: HandId, model: &crate::hand::skeleton::HandModel) {
    if model.validate().is_err() {
        return;
    }
    let hand = HandState::new(id, model.clone());
    let hands = &mut world.stage().state.hands;
    match hands.binary_search_by_key(&id, |hand| hand.id) {
        Ok(index) => hands[index] = hand,
        Err(index) => hands.insert(index, hand),
    }
}

fn remove_hand(world: &mut World, id: HandId) {
    world.stage().state.hands.retain(|hand| hand.id != id);
}

fn add_object(world: &mut World, spec: &ObjectSpec) {
    let mut faults = Vec::new();
    spec.validate(world.scene().floor_height, &mut faults);
    let named = world.objects().any(|(_, body)| body.spec.name == spec.name);
    if !faults.is_empty() || named || world.objects().count() >= OBJECTS_MAX {
        return;
    }
    let body = start(world.scene(), Arc::new(spec.clone()));
    let stage = world.stage();
    let slots = &mut stage.state.slots;
    let slot = slots
        .iter()
        .position(|slot| slot.body.is_none())
        .unwrap_or(slots.len());
    if slot == slots.len() {
        slots.push(Slot {
            generation: 0,
            body: None,
        });
    }
    slots[slot].body = Some(body);
    let slot = slot as u32;
    stage.state.wake(slot);
    let mut stage = world.stage();
    stage.note_motion(slot);
    stage.report(slot, None, EventKind::ObjectAdded);
}

fn remove_object(world: &mut World, id: ObjectId) {
    if world.object(id).is_none() {
        return;
    }
    let mut stage = world.stage();
    if stage.state.taken(id.slot).hold.is_some() {
        end_hold(&mut stage, id.slot, ReleaseReason::Command);
    }
    stage.report(id.slot, None, EventKind::ObjectRemoved);
    let bounds = stage.broad.bounds(id.slot).copied();
    stage.broad.clear(id.slot);
    stage.state.awake.retain(|slot| *slot != id.slot);
    let place = &mut stage.state.slots[id.slot as usize];
    place.body = None;
    place.generation = place.generation.wrapping_add(1);
    // What leant on it falls.
    if let Some(bounds) = bounds {
        crate::stages::free::wake_near(&mut stage, id.slot, &bounds);
    }
}

fn release(world: &mut World, id: ObjectId) {
    if world.object(id).is_none_or(|body| body.hold.is_none()) {
        return;
    }
    let mut stage = world.stage();
    let by = end_hold(&mut stage, id.slot, ReleaseReason::Command);
    report_throw(&mut stage, id.slot, by);
    let body = stage.state.taken(id.slot);
    body.barred = true;
    body.contact = ContactState::Free;
    stage.scratch.changed.push(id.slot);
}

fn reset(world: &mut World) {
    let floor = world.scene().floor_height;
    let n_slots = world.state().slots.len() as u32;
    let mut stage = world.stage();
    for slot in 0..n_slots {
        if stage
            .state
            .body(slot)
            .is_some_and(|body| body.hold.is_some())
        {
            end_hold(&mut stage, slot, ReleaseReason::Command);
        }
    }
    stage.frame.events.push(Event {
        object: None,
        hand: None,
        kind: EventKind::Reset,
    });
    for slot in 0..n_slots {
        if stage.state.body(slot).is_none() {
            continue;
        }
        let body = stage.state.taken(slot);
        let spec = Arc::clone(&body.spec);
        *body = Body::new(spec);
        body.on_floor = is_on(&body.spec.shape, &body.pose, floor);
        stage.state.wake(slot);
        stage.note_motion(slot);
    }
}
