//! Commands, checked and answered.
//!
//! A command enters the world with the next step, and whoever gave it hears of it then. While the world stands still
//! (lockstep, or paused) the answer comes at once: the command stands first in the step that comes next.

use tsukamu_proto::v1;
use tsukamu_world::input::Command;
use tsukamu_world::scene::ObjectSpec;
use tsukamu_world::state::ObjectId;

use super::engine::{Engine, Waiting};
use super::request::{Refusal, Reply};

/// Commands that wait for a step, at most: in lockstep nothing else bounds them.
const PENDING_MAX: usize = 4096;

impl Engine {
    /// Takes a command for the next step, or refuses it.
    pub(super) fn accept_command(&mut self, command: Command, reply: Reply<v1::Stamp>) {
        if let Err(refusal) = self.check(&command) {
            let _ = reply.send(Err(refusal));
            return;
        }
        self.pending.push(command);
        if self.is_running {
            self.waiting.push(Waiting::Command(reply));
        } else {
            let _ = reply.send(Ok(self.stamp));
        }
    }

    /// Takes an object for the next step, or refuses it.
    pub(super) fn accept_object(&mut self, spec: ObjectSpec, reply: Reply<(v1::Stamp, ObjectId)>) {
        if let Err(refusal) = self.may_command().and_then(|()| self.check_object(&spec)) {
            let _ = reply.send(Err(refusal));
            return;
        }
        if self.is_running {
            self.waiting.push(Waiting::Object(spec.name.clone(), reply));
        } else {
            let _ = reply.send(Ok((self.stamp, self.next_free_id())));
        }
        self.pending.push(Command::AddObject(Box::new(spec)));
    }

    fn may_command(&self) -> Result<(), Refusal> {
        match () {
            () if self.playback.is_some() => Err(Refusal::Playing),
            () if self.pending.len() >= PENDING_MAX => Err(Refusal::Busy),
            () => Ok(()),
        }
    }

    fn check(&self, command: &Command) -> Result<(), Refusal> {
        self.may_command()?;
        match command {
            Command::RemoveObject(id) | Command::Release(id) if !self.will_be_there(*id) => {
                Err(Refusal::NoObject(id.to_bits()))
            }
            _ => Ok(()),
        }
    }

    fn will_be_there(&self, id: ObjectId) -> bool {
        let slots = self.slots_after_pending();
        slots
            .get(id.slot as usize)
            .is_some_and(|slot| *slot == (id.generation, true))
    }

    fn check_object(&self, spec: &ObjectSpec) -> Result<(), Refusal> {
        let mut faults = Vec::new();
        spec.validate(self.world.scene().floor_height, &mut faults);
        let waits = self
            .pending
            .iter()
            .any(|c| matches!(c, Command::AddObject(other) if other.name == spec.name));
        if waits
            || self
                .world
                .objects()
                .any(|(_, body)| body.spec.name == spec.name)
        {
            faults.push(tsukamu_world::scene::SceneFault::Name(spec.name.clone()));
        }
        if self.world.objects().count() + self.pending.len() >= tsukamu_world::scene::OBJECTS_MAX {
            faults.push(tsukamu_world::scene::SceneFault::TooMany(
                self.world.objects().count(),
            ));
        }
        if faults.is_empty() {
            return Ok(());
        }
        Err(Refusal::Object(
            faults
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join("; "),
        ))
    }

    /// The id that an object gets whose command stands behind all that wait.
    fn next_free_id(&self) -> ObjectId {
        let slots = self.slots_after_pending();
        let free = slots
            .iter()
            .position(|(_, is_taken)| !is_taken)
            .unwrap_or(slots.len());
        ObjectId {
            slot: free as u32,
            generation: slots.get(free).map_or(0, |(generation, _)| *generation),
        }
    }

    /// Generation of every slot and whether it is taken, after the commands that wait; as the world does it.
    fn slots_after_pending(&self) -> Vec<(u32, bool)> {
        let slots = &self.world.state().slots;
        let mut slots: Vec<(u32, bool)> = slots
            .iter()
            .map(|slot| (slot.generation, slot.body.is_some()))
            .collect();
        // All slots before this one are taken.
        let mut first = 0;
        for command in &self.pending {
            match command {
                Command::AddObject(_) => {
                    first += slots[first..]
                        .iter()
                        .take_while(|(_, is_taken)| *is_taken)
                        .count();
                    match slots.get_mut(first) {
                        Some(slot) => slot.1 = true,
                        None => slots.push((0, true)),
                    }
                }
                Command::RemoveObject(id) => {
                    let place = id.slot as usize;
                    let slot = slots.get_mut(place);
                    if let Some(slot) = slot.filter(|slot| **slot == (id.generation, true)) {
                        *slot = (id.generation.wrapping_add(1), false);
                        first = first.min(place);
                    }
                }
                _ => {}
            }
        }
        slots
    }
}
