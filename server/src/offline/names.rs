//! Names of what events and poses refer to by number.

use std::collections::BTreeMap;

use tsukamu_world::World;
use tsukamu_world::frame::EventKind;
use tsukamu_world::hand::part::{JudgementPart, PartLayout};
use tsukamu_world::state::{HandId, ObjectId};

/// Names of objects (also of those that are gone) and of hands.
#[derive(Clone, Debug, Default)]
pub struct NameBook {
    objects: BTreeMap<ObjectId, String>,
    hands: BTreeMap<HandId, String>,
}

impl NameBook {
    /// The names of what is in the world now.
    pub fn of(world: &World) -> Self {
        let mut book = Self::default();
        book.note_objects(world);
        book
    }

    /// Names a hand.
    pub fn name_hand(&mut self, hand: HandId, name: impl Into<String>) {
        self.hands.insert(hand, name.into());
    }

    /// Learns the names of objects that came in with the last step. To be called after each.
    pub fn note_step(&mut self, world: &World) {
        if world
            .frame()
            .events
            .iter()
            .any(|event| event.kind == EventKind::ObjectAdded)
        {
            self.note_objects(world);
        }
    }

    /// The name of an object.
    pub fn object(&self, id: ObjectId) -> String {
        self.objects
            .get(&id)
            .cloned()
            .unwrap_or_else(|| format!("object {}", id.to_bits()))
    }

    /// The name of a hand.
    pub fn hand(&self, id: HandId) -> String {
        self.hands
            .get(&id)
            .cloned()
            .unwrap_or_else(|| format!("hand {}", id.0))
    }

    /// The name of a part of a hand, e.g. `index_tip`.
    pub fn part(&self, world: &World, hand: Option<HandId>, part: JudgementPart) -> String {
        let state = world.hands().iter().find(|state| Some(state.id) == hand);
        let place = state.and_then(|state| PartLayout::of(&state.model).place(part));
        place.map_or_else(|| format!("{part:?}"), |place| place.to_string())
    }

    fn note_objects(&mut self, world: &World) {
        for (id, body) in world.objects() {
            self.objects
                .entry(id)
                .or_insert_with(|| body.spec.name.clone());
        }
    }
}
