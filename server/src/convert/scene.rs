//! Whole scenes and single objects.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Isometry3;
use prost::Message;
use tsukamu_proto::v1;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::polyhedron::Polyhedron;
use tsukamu_world::scene::{Model, ObjectSpec, Scene, Target};
use tsukamu_world::state::{HandId, ObjectId};

use super::basic::{checked_name, point, point_from, pose, pose_from, vec3, vec3_from};
use super::fault::Fault;
use super::hand::hand_model;
use super::shape::{polyhedron_from, shape};
use crate::broadcast::inbox::SceneNow;

/// Names of the models that are built, for messages.
const MODELS: &str = "paper";

/// A scene at its start as a message: what a recording holds.
pub fn scene(scene: &Scene) -> v1::Scene {
    let objects = scene.objects.iter().zip(0..);
    let object = |(spec, slot)| {
        object(
            ObjectId {
                slot,
                generation: 0,
            },
            spec,
            &spec.pose,
            scene.grasp_angle,
        )
    };
    v1::Scene {
        objects: objects.map(object).collect(),
        ..surroundings(scene)
    }
}

/// A scene without its objects.
pub fn surroundings(scene: &Scene) -> v1::Scene {
    v1::Scene {
        name: scene.name.clone(),
        model: scene.model.name().to_owned(),
        rate_hz: scene.rate_hz,
        gravity: Some(vec3(&scene.gravity)),
        floor_height: scene.floor_height,
        grasp_angle_rad: scene.grasp_angle,
        throw_window_s: scene.throw_window_s,
        tracking_grace_s: scene.tracking_grace_s,
        targets: scene.targets.iter().map(target).collect(),
        ..v1::Scene::default()
    }
}

/// One object as it stands, as a message.
pub fn object(
    id: ObjectId,
    spec: &ObjectSpec,
    now: &Isometry3<f64>,
    scene_grasp_angle: f64,
) -> v1::Object {
    v1::Object {
        id: id.to_bits(),
        name: spec.name.clone(),
        shape: Some(shape(&spec.shape)),
        pose: Some(pose(now)),
        grasp_angle_rad: spec.grasp_angle.unwrap_or(scene_grasp_angle),
        density: spec.density,
        colour: spec.colour.to_vec(),
        start: Some(pose(&spec.pose)),
        own_grasp_angle: spec.grasp_angle.is_some(),
    }
}

/// The scene of that message, every object at its start. [`World::new`](tsukamu_world::World::new) validates it.
///
/// # Errors
/// The first message that cannot be a scene.
pub fn scene_from(message: &v1::Scene) -> Result<Scene, Fault> {
    let mut shapes = BTreeMap::new();
    let objects = message
        .objects
        .iter()
        .map(|object| object_from(object, &mut shapes));
    Ok(Scene {
        name: message.name.clone(),
        model: model_from(&message.model)?,
        rate_hz: message.rate_hz,
        gravity: vec3_from(message.gravity.as_ref(), "gravity")?,
        floor_height: message.floor_height,
        grasp_angle: message.grasp_angle_rad,
        throw_window_s: message.throw_window_s,
        tracking_grace_s: message.tracking_grace_s,
        objects: objects.collect::<Result<_, _>>()?,
        targets: message
            .targets
            .iter()
            .map(target_from)
            .collect::<Result<_, _>>()?,
    })
}

/// The model of that name.
///
/// # Errors
/// When there is none.
pub fn model_from(name: &str) -> Result<Model, Fault> {
    Model::from_name(name).ok_or_else(|| Fault::Unknown {
        field: "model",
        value: name.to_owned(),
        allowed: MODELS,
    })
}

/// Shapes by their encoded message: objects of one shape share it.
pub type Shapes = BTreeMap<Vec<u8>, Arc<Polyhedron>>;

/// The object of that message, at its `start` (at its `pose` where it has none).
///
/// # Errors
/// When it cannot be an object.
pub fn object_from(message: &v1::Object, shapes: &mut Shapes) -> Result<ObjectSpec, Fault> {
    let solid = message.shape.as_ref().ok_or(Fault::Missing("shape"))?;
    let start = message.start.as_ref().or(message.pose.as_ref());
    Ok(ObjectSpec {
        shape: shared_shape(solid, &message.name, shapes)?,
        name: message.name.clone(),
        pose: pose_from(start, "pose")?,
        grasp_angle: message.own_grasp_angle.then_some(message.grasp_angle_rad),
        density: message.density,
        colour: colour_from(&message.colour)?,
    })
}

fn shared_shape(
    message: &v1::Shape,
    object: &str,
    shapes: &mut Shapes,
) -> Result<Arc<Polyhedron>, Fault> {
    let key = message.encode_to_vec();
    if let Some(known) = shapes.get(&key) {
        return Ok(Arc::clone(known));
    }
    let made = Arc::new(polyhedron_from(message, object)?);
    shapes.insert(key, Arc::clone(&made));
    Ok(made)
}

/// What a viewer sees where nobody chose.
const GREY: [f32; 3] = [0.7, 0.7, 0.7];
/// Wood, roughly, in kg/m³.
const DENSITY: f64 = 700.0;

/// The object that a client asks to add.
///
/// # Errors
/// When it cannot be an object.
pub fn added_object(request: &v1::AddObjectRequest) -> Result<ObjectSpec, Fault> {
    let message = v1::Object {
        name: checked_name(&request.name)?.to_owned(),
        shape: request.shape.clone(),
        start: request.pose,
        grasp_angle_rad: request.grasp_angle_rad,
        own_grasp_angle: request.grasp_angle_rad != 0.0,
        density: DENSITY,
        colour: if request.colour.is_empty() {
            GREY.to_vec()
        } else {
            request.colour.clone()
        },
        ..v1::Object::default()
    };
    object_from(&message, &mut Shapes::new())
}

fn colour_from(colour: &[f32]) -> Result<[f32; 3], Fault> {
    let [red, green, blue] = *colour else {
        return Err(Fault::Length {
            field: "colour",
            found: colour.len(),
            expected: "3",
        });
    };
    if colour.iter().all(|part| part.is_finite()) {
        Ok([red, green, blue])
    } else {
        Err(Fault::NotFinite("colour"))
    }
}

fn target(target: &Target) -> v1::Target {
    v1::Target {
        name: target.name.clone(),
        centre: Some(point(&target.centre)),
        normal: Some(vec3(&target.normal)),
        radius: target.radius,
    }
}

fn target_from(message: &v1::Target) -> Result<Target, Fault> {
    Ok(Target {
        name: message.name.clone(),
        centre: point_from(message.centre.as_ref(), "target.centre")?,
        normal: vec3_from(message.normal.as_ref(), "target.normal")?,
        radius: message.radius,
    })
}

/// A hand of the world, with what people call it.
#[derive(Clone, Debug)]
pub struct NamedHand {
    /// Its id.
    pub id: HandId,
    /// The source that drives it.
    pub name: String,
    /// Its shape.
    pub model: HandModel,
}

/// A hand as a message.
pub fn named_hand(hand: &NamedHand) -> v1::Hand {
    v1::Hand {
        id: hand.id.0,
        name: hand.name.clone(),
        model: Some(hand_model(&hand.model)),
    }
}

/// A scene as it stands, as a message.
pub fn scene_now(now: &SceneNow) -> v1::GetSceneResponse {
    let content = &now.content;
    let objects = content.objects.iter().zip(&now.poses);
    let scene = v1::Scene {
        objects: objects
            .map(|((id, spec), pose)| object(*id, spec, pose, content.grasp_angle))
            .collect(),
        hands: content.hands.iter().map(named_hand).collect(),
        ..content.surroundings.clone()
    };
    v1::GetSceneResponse {
        stamp: Some(now.stamp),
        scene: Some(scene),
        scene_version: content.version,
    }
}
