//! The world and its step. The step reads as the list of stages of model §4; no mathematics here.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use thiserror::Error;

use crate::commands;
use crate::contact::broad::BroadPhase;
use crate::contact::{ContactScratch, Touch};
use crate::digest;
use crate::environment::floor::{FloorScratch, is_on};
use crate::environment::neighbours::{Movers, NeighbourScratch};
use crate::frame::{Event, EventKind, Feature, Frame};
use crate::hand::hand_state::HandState;
use crate::hand::part::JudgementPart;
use crate::input::StepInput;
use crate::polyhedron::aabb::Aabb;
use crate::scene::{Scene, SceneFault};
use crate::stages::{free, hands, judge, publish, touched};
use crate::state::{Body, HandId, ObjectId, Slot, State};

/// One authoritative world.
#[derive(Clone, Debug)]
pub struct World {
    scene: Scene,
    state: State,
    broad: BroadPhase,
    scratch: Scratch,
    frame: Frame,
}

/// Every fault of a scene that cannot be run.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
pub struct SceneFaults(pub Vec<SceneFault>);

/// One contact of a hand, for whoever drives it.
#[derive(Clone, Debug, PartialEq)]
pub struct HandTouch {
    /// What it touches.
    pub object: ObjectId,
    /// With which point or segment.
    pub part: JudgementPart,
    /// Which face or edge.
    pub feature: Feature,
    /// Where it touches: the place on the face's plane or on the edge that is nearest to the part. World space, metres.
    pub point: Point3<f64>,
    /// Unit, out of the object, world space.
    pub normal: Vector3<f64>,
}

/// Memory that steps use again. It holds nothing from one step to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch {
    pub(crate) contact: ContactScratch,
    pub(crate) floor: FloorScratch,
    pub(crate) neighbours: NeighbourScratch,
    pub(crate) swept: Vec<Aabb>,
    pub(crate) slots: Vec<u32>,
    pub(crate) touches: Vec<Touch>,
    pub(crate) pairs: Vec<[Point3<f64>; 2]>,
    pub(crate) found: Vec<judge::Found>,
    pub(crate) movers: Movers,
    pub(crate) changed: Vec<u32>,
    pub(crate) moved: Vec<(u32, Aabb)>,
}

/// What the stages of one step work on.
pub(crate) struct Stage<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) state: &'a mut State,
    pub(crate) broad: &'a mut BroadPhase,
    pub(crate) scratch: &'a mut Scratch,
    pub(crate) frame: &'a mut Frame,
}

impl Stage<'_> {
    /// Reports what happened to the object in a slot.
    pub(crate) fn report(&mut self, slot: u32, hand: Option<HandId>, kind: EventKind) {
        let object = Some(self.state.id(slot));
        self.frame.events.push(Event { object, hand, kind });
    }

    /// g Δt² in metres.
    pub(crate) fn gravity_step(&self) -> Vector3<f64> {
        let dt = self.scene.step_length_s();
        self.scene.gravity * (dt * dt)
    }

    /// Notes that an object moved: from the box it had, to the pose it has.
    pub(crate) fn note_motion(&mut self, slot: u32) {
        let body = self.state.taken(slot);
        let now = body.spec.shape.aabb().moved(&body.pose);
        let before = self.broad.bounds(slot).copied().unwrap_or(now);
        self.broad.set(slot, now);
        self.scratch.moved.push((slot, before.joined(&now)));
        self.scratch.changed.push(slot);
    }
}

impl World {
    /// A world at the start of a scene.
    ///
    /// # Errors
    /// Every fault of [`Scene::validate`].
    pub fn new(scene: Scene) -> Result<Self, SceneFaults> {
        let faults = scene.validate();
        if !faults.is_empty() {
            return Err(SceneFaults(faults));
        }
        let bodies = scene
            .objects
            .iter()
            .map(|spec| start(&scene, Arc::new(spec.clone())));
        let slots: Vec<Slot> = bodies
            .map(|body| Slot {
                generation: 0,
                body: Some(body),
            })
            .collect();
        let awake = (0..slots.len() as u32).collect();
        Ok(Self::with(
            scene,
            State {
                tick: 0,
                slots,
                awake,
                hands: Vec::new(),
            },
        ))
    }

    /// A world in that state.
    pub(crate) fn with(scene: Scene, state: State) -> Self {
        let boxes = state.slots.iter().map(|slot| {
            slot.body
                .as_ref()
                .map(|b| b.spec.shape.aabb().moved(&b.pose))
        });
        let broad = BroadPhase::new(boxes.collect());
        let frame = Frame {
            tick: state.tick,
            time_s: state.tick as f64 * scene.step_length_s(),
            ..Frame::default()
        };
        Self {
            scene,
            state,
            broad,
            scratch: Scratch::default(),
            frame,
        }
    }

    /// Advances the world by one step. It cannot fail: what an input cannot do is passed over.
    pub fn step(&mut self, input: &StepInput) -> &Frame {
        self.state.tick += 1;
        self.frame.tick = self.state.tick;
        self.frame.time_s = self.state.tick as f64 * self.scene.step_length_s();
        self.frame.events.clear();
        commands::carry_out(self, &input.commands);
        let mut stage = self.stage();
        hands::advance(&mut stage, &input.hands);
        judge::find(&mut stage);
        touched::advance(&mut stage);
        touched::shove_neighbours(&mut stage);
        free::advance(&mut stage);
        free::wake_neighbours(&mut stage);
        hands::show(&mut stage);
        publish::publish(&mut stage);
        if cfg!(debug_assertions) {
            crate::validate::validate(&self.state);
        }
        &self.frame
    }

    /// What the stages work on, its memory emptied.
    pub(crate) fn stage(&mut self) -> Stage<'_> {
        self.scratch.found.clear();
        self.scratch.movers.clear();
        self.scratch.moved.clear();
        self.scratch.touches.clear();
        Stage {
            scene: &self.scene,
            state: &mut self.state,
            broad: &mut self.broad,
            scratch: &mut self.scratch,
            frame: &mut self.frame,
        }
    }

    /// One number that stands for the whole state: equal inputs give equal digests.
    pub fn digest(&self) -> u64 {
        digest::digest(&self.state)
    }

    /// The scene that the world started from, and its settings now.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    pub(crate) fn scene_mut(&mut self) -> &mut Scene {
        &mut self.scene
    }

    /// Everything that steps change.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The frame of the last step.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The objects, ascending by slot.
    pub fn objects(&self) -> impl Iterator<Item = (ObjectId, &Body)> {
        (0_u32..)
            .zip(&self.state.slots)
            .filter_map(|(slot, place)| {
                place.body.as_ref().map(|body| {
                    (
                        ObjectId {
                            slot,
                            generation: place.generation,
                        },
                        body,
                    )
                })
            })
    }

    /// The object of that id, if it is still there.
    pub fn object(&self, id: ObjectId) -> Option<&Body> {
        let place = self.state.slots.get(id.slot as usize)?;
        place
            .body
            .as_ref()
            .filter(|_| place.generation == id.generation)
    }

    /// The hands, ascending by id.
    pub fn hands(&self) -> &[HandState] {
        &self.state.hands
    }

    /// Appends what a hand touches, ascending by object.
    pub fn contacts_of(&self, hand: HandId, contacts: &mut Vec<HandTouch>) {
        let Some(posed) = self.state.hand(hand).map(|hand| &hand.posed) else {
            return;
        };
        for slot in self.state.awake.iter().copied() {
            let Some(body) = self.state.body(slot) else {
                continue;
            };
            let object = self.state.id(slot);
            let own = body.touches.iter().filter(|touch| touch.hand == hand);
            contacts.extend(own.filter_map(|touch| {
                let part = body.pose.inverse_transform_point(&touch.part_in(posed)?);
                let point = touch.on_feature(&body.spec.shape, &part);
                Some(HandTouch {
                    object,
                    part: touch.part,
                    feature: touch.feature,
                    point: body.pose * point,
                    normal: body.pose.rotation * touch.normal,
                })
            }));
        }
    }

    /// The whole state as a value.
    pub fn snapshot(&self) -> State {
        self.state.clone()
    }

    /// Goes on from a snapshot of a world of the same scene.
    pub fn restore(&mut self, state: State) {
        let scene = std::mem::take(&mut self.scene);
        *self = Self::with(scene, state);
    }
}

/// An object at its start in a scene.
pub(crate) fn start(scene: &Scene, spec: Arc<crate::scene::ObjectSpec>) -> Body {
    let mut body = Body::new(spec);
    body.on_floor = is_on(&body.spec.shape, &body.pose, scene.floor_height);
    body
}
