//! What a step may change. A snapshot is a clone of [`state::State`] and nothing else.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::contact::Touch;
use crate::hand::hand_state::HandState;
use crate::scene::ObjectSpec;

/// Names an object. A slot is used again after a removal, with the next generation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId {
    /// Index in the world's storage.
    pub slot: u32,
    /// How often the slot was used before.
    pub generation: u32,
}

impl ObjectId {
    /// One number for files and the wire: the generation above, the slot in the low 32 bits.
    pub const fn to_bits(self) -> u64 {
        (self.generation as u64) << 32 | self.slot as u64
    }

    /// The id of [`ObjectId::to_bits`].
    pub const fn from_bits(bits: u64) -> Self {
        Self {
            slot: bits as u32,
            generation: (bits >> 32) as u32,
        }
    }
}

/// Names a hand; chosen by whoever adds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct HandId(pub u32);

/// How the hands touch an object (Fig. 12 of the paper).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ContactState {
    /// No hand touches it.
    #[default]
    Free,
    /// Pushed at one point.
    PushedAtOne,
    /// Pushed at several points that make no grasp.
    PushedAtSeveral,
    /// Two contact normals are at least the grasp angle apart.
    Grasped,
}

impl ContactState {
    /// The name in files and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::PushedAtOne => "push-1",
            Self::PushedAtSeveral => "push-n",
            Self::Grasped => "grasped",
        }
    }
}

/// What an object does when no hand touches it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Rest {
    /// It moves, or may: it is looked at in every step.
    #[default]
    Awake,
    /// It lies still on the floor until something touches it.
    OnFloor,
    /// It lies still against another object (slot) until one of the two is moved.
    OnObject(u32),
}

/// A grasp that lives while each tick judges it anew.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hold {
    /// The hand that the object follows, or `None` while only the contacts of several hands together hold it.
    pub leader: Option<HandId>,
    /// `wrist_from_object` of the leader.
    pub wrist_from_object: Isometry3<f64>,
    /// Tick at which the grasp began.
    pub since_tick: u64,
}

/// One object as it is now.
#[derive(Clone, Debug)]
pub struct Body {
    /// What it is.
    pub spec: Arc<ObjectSpec>,
    /// `world_from_object`; the origin is the centre of gravity P.
    pub pose: Isometry3<f64>,
    /// P(t) − P(t−Δt): displacement of the last step, in metres.
    pub displacement: Vector3<f64>,
    /// Rotation of the last step, about P, in world axes.
    pub spin: UnitQuaternion<f64>,
    /// Last positions of P, newest last, at most as many as the throw window has steps, plus one;
    /// kept only where the window is longer than one step.
    pub track: Vec<Point3<f64>>,
    /// How the hands touch it.
    pub contact: ContactState,
    /// The grasp, if it is grasped.
    pub hold: Option<Hold>,
    /// Contacts of the last step, ascending by hand, part and feature.
    pub touches: Vec<Touch>,
    /// Whether it lies still.
    pub rest: Rest,
    /// Whether it was on the floor at the end of the last step.
    pub on_floor: bool,
    /// The floor case (1, 2 or 3) in which it topples, 0 when it does not.
    pub topple_case: u8,
    /// Whether it has lain still, and been said to, since it last moved.
    pub still: bool,
    /// Whether hands were told to let go of it and the grasp test has not failed since.
    pub barred: bool,
}

/// A place for one object.
#[derive(Clone, Debug)]
pub struct Slot {
    /// How often it was used before.
    pub generation: u32,
    /// The object, if the slot is taken.
    pub body: Option<Body>,
}

/// Everything that a step may change.
#[derive(Clone, Debug, Default)]
pub struct State {
    /// Steps since the start.
    pub tick: u64,
    /// The objects.
    pub slots: Vec<Slot>,
    /// Slots of objects that do not rest, ascending.
    pub awake: Vec<u32>,
    /// The hands, ascending by id.
    pub hands: Vec<HandState>,
}

impl Body {
    /// An object at its start, awake. It takes memory for touches when a hand first touches it.
    pub fn new(spec: Arc<ObjectSpec>) -> Self {
        Self {
            pose: spec.pose,
            spec,
            displacement: Vector3::zeros(),
            spin: UnitQuaternion::identity(),
            track: Vec::new(),
            contact: ContactState::Free,
            hold: None,
            touches: Vec::new(),
            rest: Rest::Awake,
            on_floor: false,
            topple_case: 0,
            still: false,
            barred: false,
        }
    }

    /// Centre of gravity, world space.
    pub fn position(&self) -> Point3<f64> {
        Point3::from(self.pose.translation.vector)
    }

    /// Takes its motion away: what has touched another object keeps no inertia.
    pub fn stop(&mut self) {
        self.displacement = Vector3::zeros();
        self.spin = UnitQuaternion::identity();
        self.topple_case = 0;
    }

    /// Whether it lies still.
    pub fn is_resting(&self) -> bool {
        self.rest != Rest::Awake
    }
}

impl State {
    /// The object in that slot, if there is one.
    pub fn body(&self, slot: u32) -> Option<&Body> {
        self.slots.get(slot as usize)?.body.as_ref()
    }

    /// The object in that slot.
    ///
    /// # Panics
    /// When the slot is empty: stages hand each other only slots that are taken.
    pub fn taken(&mut self, slot: u32) -> &mut Body {
        self.slots[slot as usize]
            .body
            .as_mut()
            .expect("stages pass on only slots that are taken")
    }

    /// The id of what is in that slot now.
    pub fn id(&self, slot: u32) -> ObjectId {
        ObjectId {
            slot,
            generation: self.slots[slot as usize].generation,
        }
    }

    /// Marks an object as moving, or possibly moving.
    pub fn wake(&mut self, slot: u32) {
        if let Err(place) = self.awake.binary_search(&slot) {
            self.awake.insert(place, slot);
        }
        self.taken(slot).rest = Rest::Awake;
    }

    /// The hand of that id.
    pub fn hand(&self, id: HandId) -> Option<&HandState> {
        self.hands
            .binary_search_by_key(&id, |hand| hand.id)
            .ok()
            .map(|index| &self.hands[index])
    }
}
