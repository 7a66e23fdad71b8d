//! What enters the world in one step: hand samples and commands. A recording is the scene plus these.

use crate::hand::sample::HandSample;
use crate::hand::skeleton::HandModel;
use crate::scene::{Model, ObjectSpec};
use crate::state::{HandId, ObjectId};

/// Everything that enters the world in one step.
#[derive(Clone, Debug, Default)]
pub struct StepInput {
    /// Commands of this tick, carried out in this order, before anything else.
    pub commands: Vec<Command>,
    /// Samples of this tick. A hand that is not named, or has no sample, was not seen in this tick;
    /// a hand that was never added is passed over. Order does not matter.
    pub hands: Vec<HandInput>,
}

/// The sample that one hand has in one step.
#[derive(Clone, Debug)]
pub struct HandInput {
    /// Which hand.
    pub hand: HandId,
    /// Its sample; `None`, or one that is not valid, is "not seen".
    pub sample: Option<HandSample>,
}

/// A command to the world. One that cannot be carried out (an id that is gone, a full world) changes nothing.
#[derive(Clone, Debug)]
pub enum Command {
    /// A hand enters. An id that is there already is replaced.
    AddHand {
        /// Its id, chosen by the caller.
        hand: HandId,
        /// Its shape.
        model: Box<HandModel>,
    },
    /// A hand leaves; it lets go of what it holds.
    RemoveHand(HandId),
    /// An object enters, into the lowest free slot. One that [`ObjectSpec::validate`] faults is passed over.
    AddObject(Box<ObjectSpec>),
    /// An object leaves.
    RemoveObject(ObjectId),
    /// Hands let go of an object; they grasp it again only after the grasp test has failed once.
    Release(ObjectId),
    /// Objects go back to the scene's start; hands stay.
    Reset,
    /// Goes on with another model.
    SetModel(Model),
}

impl StepInput {
    /// Empties it, keeping its memory.
    pub fn clear(&mut self) {
        self.commands.clear();
        self.hands.clear();
    }
}
