//! What became of an object: who touched it, how it left the hand, where it came to rest.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use serde::Serialize;
use tsukamu_world::World;
use tsukamu_world::frame::{Event, EventKind};
use tsukamu_world::hand::joint::{Finger, N_FINGERS};
use tsukamu_world::hand::part::PartLayout;
use tsukamu_world::state::{Body, ContactState, ObjectId, Rest};

/// What became of one object. Lengths in metres, world space.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ObjectStory {
    /// Its name.
    pub name: String,
    /// How often it was grasped.
    pub n_grasps: usize,
    /// Fingers that touched it while it was held, thumb first.
    pub held_by: Vec<String>,
    /// Seconds held, all holds together.
    pub held_s: f64,
    /// Fingers that pushed it for most of the time in which it was pushed, thumb first.
    pub pushed_by: Vec<String>,
    /// Seconds pushed.
    pub pushed_s: f64,
    /// Speed of the last throw, m/s.
    pub release_m_s: Option<f64>,
    /// Where its centre of gravity was when it last came from the air to the floor.
    pub landed: Option<[f64; 3]>,
    /// What it lies on at the end: `floor` or an object's name; `None` while it moves or is held.
    pub rests_on: Option<String>,
    /// Distance from a target's centre at which it went through it, m.
    pub hit_m: Option<f64>,
    /// Distance between its first and its last place, m.
    pub moved_m: f64,
}

/// The stories of all objects of a run, in the making.
#[derive(Clone, Debug, Default)]
pub struct Stories {
    drafts: BTreeMap<ObjectId, Draft>,
}

#[derive(Clone, Debug, Default)]
struct Draft {
    name: String,
    start: Option<Point3<f64>>,
    end: Point3<f64>,
    n_grasps: usize,
    held_by: [bool; N_FINGERS],
    held_s: f64,
    /// Seconds in which each finger took part in a push.
    pushed_by_s: [f64; N_FINGERS],
    pushed_s: f64,
    release: Option<Vector3<f64>>,
    landed: Option<Point3<f64>>,
    rests_on: Option<String>,
    hit_m: Option<f64>,
}

impl ObjectStory {
    /// Whether it was ever held.
    pub const fn is_grasped(&self) -> bool {
        self.n_grasps > 0
    }

    /// Whether just these fingers pushed it.
    pub fn is_pushed_by(&self, fingers: &[&str]) -> bool {
        self.pushed_by
            .iter()
            .map(String::as_str)
            .eq(fingers.iter().copied())
    }

    /// Whether it lies on anything at the end.
    pub const fn rests(&self) -> bool {
        self.rests_on.is_some()
    }

    /// Whether it lies on the floor at the end.
    pub fn rests_on_floor(&self) -> bool {
        self.rests_on.as_deref() == Some(FLOOR)
    }
}

/// How the floor is called.
const FLOOR: &str = "floor";

/// How many objects lie on one another up to this one: 1 for one on the floor, 0 for one that does not rest.
pub fn height_of_stack(objects: &[ObjectStory], name: &str) -> usize {
    let mut height = 0;
    let mut at = Some(name);
    // No stack is higher than there are objects: a ring of objects that lean on each other ends here.
    while let Some(object) = at.and_then(|name| objects.iter().find(|object| object.name == name)) {
        if !object.rests() || height == objects.len() {
            return 0;
        }
        height += 1;
        at = object.rests_on.as_deref().filter(|on| *on != FLOOR);
    }
    height
}

impl Stories {
    /// Takes in the world after a step.
    pub fn watch(&mut self, world: &World) {
        let step_s = world.scene().step_length_s();
        for (id, body) in world.objects() {
            self.drafts
                .entry(id)
                .or_default()
                .watch(world, body, step_s);
        }
        for event in &world.frame().events {
            if let Some(draft) = event.object.and_then(|id| self.drafts.get_mut(&id)) {
                draft.note(event);
            }
        }
    }

    /// The stories, in the order of the objects.
    pub fn told(self) -> Vec<ObjectStory> {
        self.drafts.into_values().map(Draft::told).collect()
    }
}

impl Draft {
    fn watch(&mut self, world: &World, body: &Body, step_s: f64) {
        if self.start.is_none() {
            self.start = Some(body.spec.pose.translation.vector.into());
            self.name.clone_from(&body.spec.name);
        }
        self.end = body.position();
        self.rests_on = match body.rest {
            Rest::OnFloor => Some(FLOOR.to_owned()),
            Rest::OnObject(slot) => world
                .state()
                .body(slot)
                .map(|other| other.spec.name.clone()),
            // Woken to be looked at, but it has not moved.
            Rest::Awake if body.still => self.rests_on.take(),
            Rest::Awake => None,
        };
        let fingers = touching(world, body);
        match body.contact {
            ContactState::Free => {}
            ContactState::Grasped => {
                self.held_s += step_s;
                self.held_by
                    .iter_mut()
                    .zip(fingers)
                    .for_each(|(held, now)| *held |= now);
            }
            ContactState::PushedAtOne | ContactState::PushedAtSeveral => {
                self.pushed_s += step_s;
                let times = self.pushed_by_s.iter_mut().zip(fingers);
                times
                    .filter(|(_, now)| *now)
                    .for_each(|(time_s, _)| *time_s += step_s);
            }
        }
    }

    fn note(&mut self, event: &Event) {
        match &event.kind {
            EventKind::Grasped { .. } => self.n_grasps += 1,
            EventKind::Thrown { velocity } => self.release = Some(*velocity),
            EventKind::Landed { .. } => self.landed = Some(self.end),
            EventKind::HitTarget { distance, .. } => self.hit_m = Some(*distance),
            _ => {}
        }
    }

    fn told(self) -> ObjectStory {
        let names = |chosen: [bool; N_FINGERS]| {
            Finger::ALL
                .into_iter()
                .zip(chosen)
                .filter(|(_, chosen)| *chosen)
                .map(|(f, _)| f.name().to_owned())
                .collect()
        };
        let most = self.pushed_by_s.map(|time_s| time_s > 0.5 * self.pushed_s);
        ObjectStory {
            n_grasps: self.n_grasps,
            held_by: names(self.held_by),
            held_s: self.held_s,
            pushed_by: names(most),
            pushed_s: self.pushed_s,
            release_m_s: self.release.map(|velocity| velocity.norm()),
            landed: self.landed.map(|place| place.coords.into()),
            rests_on: self.rests_on,
            hit_m: self.hit_m,
            moved_m: self.start.map_or(0.0, |start| (self.end - start).norm()),
            name: self.name,
        }
    }
}

/// The fingers that touch an object now.
fn touching(world: &World, body: &Body) -> [bool; N_FINGERS] {
    let mut fingers = [false; N_FINGERS];
    for touch in &body.touches {
        let hand = world.hands().iter().find(|hand| hand.id == touch.hand);
        let finger = hand.and_then(|hand| PartLayout::of(&hand.model).finger(touch.part));
        if let Some(finger) = finger {
            fingers[finger.index()] = true;
        }
    }
    fingers
}
