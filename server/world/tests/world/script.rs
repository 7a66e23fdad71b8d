//! Scenes of a few solids and hands of a few points, written down in a line each.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use tsukamu_world::hand::joint::{N_JOINTS, Side};
use tsukamu_world::hand::sample::{FingerPose, HandSample};
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::{Command, HandInput, StepInput};
use tsukamu_world::polyhedron::{Polyhedron, shapes};
use tsukamu_world::scene::{ObjectSpec, Scene};
use tsukamu_world::state::{HandId, ObjectId};
use tsukamu_world::{World, frame::Event};

pub(crate) const HAND: HandId = HandId(7);

pub(crate) fn cube(size: f64) -> Polyhedron {
    shapes::cuboid(&Vector3::repeat(size)).expect("a cube")
}

pub(crate) fn object(name: &str, shape: Polyhedron, position: [f64; 3]) -> ObjectSpec {
    posed(name, shape, position, UnitQuaternion::identity())
}

pub(crate) fn posed(
    name: &str,
    shape: Polyhedron,
    position: [f64; 3],
    rotation: UnitQuaternion<f64>,
) -> ObjectSpec {
    ObjectSpec {
        name: name.to_owned(),
        shape: Arc::new(shape),
        pose: Isometry3::from_parts(Translation3::from(Vector3::from(position)), rotation),
        grasp_angle: None,
        density: 500.0,
        colour: [0.8; 3],
    }
}

pub(crate) fn scene(rate_hz: f64, objects: Vec<ObjectSpec>) -> Scene {
    Scene {
        rate_hz,
        objects,
        ..Scene::default()
    }
}

/// A hand far away from everything, some of whose joints are elsewhere: `(joint index, world position)`.
pub(crate) fn hand_with(wrist: [f64; 3], joints: &[(usize, [f64; 3])]) -> HandSample {
    let mut points = [None; N_JOINTS];
    for (index, place) in joints {
        points[*index] = Some(Point3::from(*place));
    }
    let wrist = Isometry3::translation(wrist[0], wrist[1], wrist[2]);
    HandSample {
        wrist,
        fingers: FingerPose::Points(points),
    }
}

pub(crate) fn with_hand() -> StepInput {
    let model = Box::new(HandModel::adult(Side::Right));
    StepInput {
        commands: vec![Command::AddHand { hand: HAND, model }],
        hands: Vec::new(),
    }
}

pub(crate) fn sample(sample: HandSample) -> StepInput {
    StepInput {
        commands: Vec::new(),
        hands: vec![HandInput {
            hand: HAND,
            sample: Some(sample),
        }],
    }
}

/// Runs a hand script, a sample per step, on a world in which the hand is; returns all events as `tick kind reason`.
pub(crate) fn run(
    world: &mut World,
    script: impl IntoIterator<Item = HandSample>,
) -> Vec<(u64, Event)> {
    world.step(&with_hand());
    let mut events = Vec::new();
    for one in script {
        let frame = world.step(&sample(one));
        events.extend(frame.events.iter().map(|event| (frame.tick, event.clone())));
    }
    events
}

pub(crate) fn idle(world: &mut World, n: u32) -> Vec<(u64, Event)> {
    let mut events = Vec::new();
    for _ in 0..n {
        let frame = world.step(&StepInput::default());
        events.extend(frame.events.iter().map(|event| (frame.tick, event.clone())));
    }
    events
}

pub(crate) fn kinds(events: &[(u64, Event)]) -> Vec<&'static str> {
    events.iter().map(|(_, event)| event.kind.name()).collect()
}

pub(crate) fn position(world: &World, slot: u32) -> Point3<f64> {
    world
        .object(ObjectId {
            slot,
            generation: 0,
        })
        .expect("there")
        .position()
}
