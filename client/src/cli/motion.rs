use std::sync::Arc;

use anyhow::{Context, Result, bail};
use nalgebra::{Point3, Vector3};
use tsukamu_client::connect::Client;
use tsukamu_client::view::isometry;
use tsukamu_motion::hand_csv;
use tsukamu_motion::synthetic::{self, ObjectInfo, SceneInfo};
use tsukamu_motion::track::{HandTrack, TrackHand};
use tsukamu_proto::v1::{GetSceneRequest, Object, Scene, Shape, Vec3};
use tsukamu_world::hand::joint::Side;
use tsukamu_world::polyhedron::Polyhedron;
use tsukamu_world::scene::Target;

use super::refusal;

/// How a source names a built-in hand.
const SYNTHETIC: &str = "synthetic:";
/// Samples per second of a built-in hand.
const SYNTHETIC_RATE_HZ: f64 = 240.0;

/// Where the motion of the hands comes from.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    source: String,
    wanted: Option<Side>,
}

impl Motion {
    pub(crate) fn new(source: &str, wanted: Option<Side>) -> Self {
        Self {
            source: source.to_owned(),
            wanted,
        }
    }

    /// Whether it is planned on the scene as it is now, so that every round needs a plan of its own.
    pub(crate) fn is_planned(&self) -> bool {
        self.source.starts_with(SYNTHETIC)
    }

    /// The motion of each hand: read from the file, or planned on the scene as it is now.
    pub(crate) async fn hands(&self, client: &Client) -> Result<Vec<TrackHand>> {
        let track = if self.is_planned() {
            self.plan(client).await?
        } else {
            self.read()?
        };
        let mut hands = track.hands;
        hands.retain(|hand| self.wanted.is_none_or(|side| side == hand.side));
        if hands.is_empty() {
            bail!(
                "the motion has no {} hand",
                self.wanted.map_or("tracked", Side::name)
            );
        }
        Ok(hands)
    }

    fn read(&self) -> Result<HandTrack> {
        let text = std::fs::read_to_string(&self.source)
            .with_context(|| format!("cannot read {}", self.source))?;
        hand_csv::read(&text).with_context(|| {
            format!(
                "{} is no hand CSV (`tsukamud import` makes one of other files)",
                self.source
            )
        })
    }

    async fn plan(&self, client: &Client) -> Result<HandTrack> {
        let answer = client
            .world()
            .get_scene(GetSceneRequest {})
            .await
            .map_err(|status| refusal(&status))?;
        let scene = answer.into_inner().scene.unwrap_or_default();
        let mut spec = synthetic::Spec::parse(&self.source)?;
        if let Some(side) = self.wanted {
            spec.side = side;
        }
        Ok(synthetic::plan(&spec, &scene_info(&scene)?)?.track(SYNTHETIC_RATE_HZ))
    }
}

/// What a plan needs to know of the scene.
fn scene_info(scene: &Scene) -> Result<SceneInfo> {
    let targets = scene.targets.iter().map(|target| Target {
        name: target.name.clone(),
        centre: Point3::from(vector(target.centre.as_ref())),
        normal: vector(target.normal.as_ref()),
        radius: target.radius,
    });
    Ok(SceneInfo {
        objects: scene
            .objects
            .iter()
            .map(object_info)
            .collect::<Result<_>>()?,
        floor_height: scene.floor_height,
        gravity: vector(scene.gravity.as_ref()),
        targets: targets.collect(),
    })
}

fn object_info(object: &Object) -> Result<ObjectInfo> {
    let broken = || {
        format!(
            "the daemon describes object {} in a way that makes no sense",
            object.name
        )
    };
    let shape = object.shape.as_ref().with_context(broken)?;
    let pose = object
        .pose
        .as_ref()
        .and_then(isometry)
        .with_context(broken)?;
    let shape = Arc::new(polyhedron(shape).with_context(broken)?);
    Ok(ObjectInfo {
        name: object.name.clone(),
        shape,
        pose,
    })
}

/// The solid that its triangles bound; the origin stays, as it is the centre of gravity already.
fn polyhedron(shape: &Shape) -> Result<Polyhedron> {
    let vertices: Vec<Point3<f64>> = shape
        .vertices
        .chunks_exact(3)
        .map(|xyz| Point3::new(xyz[0], xyz[1], xyz[2]))
        .collect();
    let triangles: Vec<Vec<u32>> = shape
        .triangles
        .chunks_exact(3)
        .map(<[u32]>::to_vec)
        .collect();
    Ok(Polyhedron::from_faces(&vertices, &triangles)?)
}

fn vector(vector: Option<&Vec3>) -> Vector3<f64> {
    vector.map_or_else(Vector3::zeros, |v| Vector3::new(v.x, v.y, v.z))
}

#[cfg(test)]
mod tests {
    use tsukamu_proto::v1::{Pose, Quat};

    use super::*;

    fn cube() -> Object {
        let corner = |n: u32| {
            [n & 1, n >> 1 & 1, n >> 2 & 1].map(|bit| if bit == 1 { 0.025 } else { -0.025 })
        };
        let sides: [[u32; 4]; 6] = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        Object {
            name: "cube".into(),
            shape: Some(Shape {
                vertices: (0..8).flat_map(corner).collect(),
                triangles: sides
                    .iter()
                    .flat_map(|[a, b, c, d]| [*a, *b, *c, *a, *c, *d])
                    .collect(),
                ..Shape::default()
            }),
            pose: Some(Pose {
                position: Some(Vec3 {
                    x: 0.1,
                    y: 0.025,
                    z: -0.2,
                }),
                rotation: Some(Quat {
                    x: 0.0,
                    y: 0.0,
                    z: 0.0,
                    w: 1.0,
                }),
            }),
            ..Object::default()
        }
    }

    #[test]
    fn a_scene_on_the_wire_can_be_planned_on() {
        let gravity = Some(Vec3 {
            x: 0.0,
            y: -9.81,
            z: 0.0,
        });
        let scene = Scene {
            objects: vec![cube()],
            gravity,
            ..Scene::default()
        };
        let info = scene_info(&scene).unwrap();
        let shape = &info.objects[0].shape;
        assert_eq!(
            (
                shape.vertices().len(),
                shape.faces().len(),
                shape.edges().len()
            ),
            (8, 6, 12)
        );
        let hand = synthetic::build("synthetic:grasp-throw", &info).unwrap();
        assert!(hand.track(SYNTHETIC_RATE_HZ).hands[0].samples.len() > 100);
    }

    #[test]
    fn a_broken_object_is_named() {
        let mut object = cube();
        object.shape.as_mut().unwrap().triangles.truncate(33);
        let error = object_info(&object).unwrap_err();
        assert!(
            format!("{error:#}").starts_with("the daemon describes object cube"),
            "{error:#}"
        );
    }
}
