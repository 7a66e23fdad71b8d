//! The wire is exact: what went over it is the same to the last bit.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::{Just, Strategy, any, prop_assert_eq, prop_oneof, proptest};
use prost::Message;
use tsukamu_proto::v1;
use tsukamu_world::hand::joint::{N_JOINTS, Side};
use tsukamu_world::hand::sample::{FingerAngles, FingerPose, HandSample, JointAngles, ThumbAngles};
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::{Command, HandInput};
use tsukamu_world::polyhedron::{Polyhedron, shapes};
use tsukamu_world::scene::{Model, ObjectSpec, Scene, Target};
use tsukamu_world::state::{HandId, ObjectId};
use tsukamu_world::{StepInput, World};

use super::fault::Fault;
use super::hand::{hand_model, hand_model_from, hand_sample, hand_sample_from};
use super::input::{step_input, step_input_from};
use super::scene::{scene, scene_from};
use super::shape::{polyhedron_from, shape};

/// Every bit of a value: `Debug` writes each f64 so that it reads back as itself. Where a shape's author had its
/// centre is left out: only its author asks for that.
fn bits(value: &impl std::fmt::Debug) -> String {
    let text = format!("{value:?}");
    let parts = text
        .split(", centroid: ")
        .map(|part| part.split_once("], inertia").map_or(part, |(_, rest)| rest));
    parts.collect()
}

/// What a message is after it was sent.
fn sent<M: Message + Default>(message: &M) -> M {
    M::decode(message.encode_to_vec().as_slice()).expect("what was encoded decodes")
}

fn solids() -> Vec<Polyhedron> {
    [
        shapes::cuboid(&Vector3::new(0.05, 0.07, 0.031)),
        shapes::prism(5, 0.03, 0.1),
        shapes::pyramid(0.05, 0.04, 0.05),
        shapes::l_shape(0.1, 0.1, 0.03, 0.04),
        shapes::ellipsoid(&Vector3::new(0.04, 0.05, 0.06)),
    ]
    .into_iter()
    .map(|solid| solid.expect("a primitive"))
    .chain([far_away()])
    .collect()
}

/// A tetrahedron whose author had it far from the origin, with an unused vertex.
fn far_away() -> Polyhedron {
    let vertices = [
        [9.0, 9.0, 9.0],
        [1e4, 0.0, 7.0],
        [1e4 + 0.1, 0.0, 7.0],
        [1e4, 0.2, 7.0],
        [1e4, 0.0, 7.3],
    ];
    let faces = [[1, 3, 2], [1, 2, 4], [2, 3, 4], [3, 1, 4]].map(|face: [u32; 3]| face.to_vec());
    Polyhedron::from_faces(&vertices.map(Point3::from), &faces).expect("a tetrahedron")
}

fn rotation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    [-3.0..3.0_f64, -3.0..3.0_f64, -3.0..3.0_f64]
        .prop_map(|axis| UnitQuaternion::from_scaled_axis(Vector3::from(axis)))
}

fn pose() -> impl Strategy<Value = Isometry3<f64>> {
    ([-2.0..2.0_f64, 0.2..2.0_f64, -2.0..2.0_f64], rotation()).prop_map(|(at, rotation)| {
        Isometry3::from_parts(Translation3::from(Vector3::from(at)), rotation)
    })
}

fn fingers() -> impl Strategy<Value = FingerPose> {
    let angle = || -3.0..3.0_f64;
    let finger =
        [angle(), angle(), angle(), angle()].prop_map(|[mcp, pip, dip, abduction]| FingerAngles {
            mcp_flexion: mcp,
            pip_flexion: pip,
            dip_flexion: dip,
            abduction,
        });
    let thumb =
        [angle(), angle(), angle(), angle()].prop_map(|[opposition, abduction, mcp, ip]| {
            ThumbAngles {
                opposition,
                abduction,
                mcp_flexion: mcp,
                ip_flexion: ip,
            }
        });
    let fingers = proptest::collection::vec(finger, 4)
        .prop_map(|list| std::array::from_fn(|index| list[index]));
    let angles = (thumb, fingers, angle()).prop_map(|(thumb, fingers, palm_arch)| {
        FingerPose::Angles(JointAngles {
            thumb,
            fingers,
            palm_arch,
        })
    });
    let joint = prop_oneof![
        Just(None),
        [angle(), angle(), angle()].prop_map(|p| Some(Point3::from(p)))
    ];
    let points = proptest::collection::vec(joint, N_JOINTS)
        .prop_map(|list| FingerPose::Points(std::array::from_fn(|index| list[index])));
    prop_oneof![angles, points]
}

fn sample() -> impl Strategy<Value = HandSample> {
    (pose(), fingers()).prop_map(|(wrist, fingers)| HandSample { wrist, fingers })
}

fn object(name: usize, solid: usize, pose: Isometry3<f64>, grasp_angle: Option<f64>) -> ObjectSpec {
    ObjectSpec {
        name: format!("object {name}"),
        shape: Arc::new(solids().swap_remove(solid)),
        pose,
        grasp_angle,
        density: 700.0 / 3.0,
        colour: [0.1, 0.2, 0.3],
    }
}

proptest! {
    #[test]
    fn samples_survive(sample in sample(), source_ns in any::<u64>()) {
        let message = sent(&hand_sample(&sample, source_ns));
        prop_assert_eq!(message.source_ns, source_ns);
        prop_assert_eq!(hand_sample_from(&message).map(|s| bits(&s)), Ok(bits(&Some(sample))));
    }

    #[test]
    fn scenes_survive(
        poses in proptest::collection::vec((0..6_usize, pose(), proptest::option::of(0.1..3.0_f64)), 0..5),
        rate_hz in 1.0..4000.0_f64,
        floor_height in -1.0..0.0_f64,
    ) {
        let objects = poses.iter().enumerate().map(|(k, (solid, pose, angle))| object(k, *solid, *pose, *angle));
        let target = Target {
            name: "target".to_owned(),
            centre: Point3::new(0.1, 0.2, 0.3),
            normal: Vector3::z(),
            radius: 1.0 / 3.0,
        };
        let original = Scene {
            name: "scene".to_owned(),
            rate_hz,
            floor_height,
            objects: objects.collect(),
            targets: vec![target],
            ..Scene::default()
        };
        let rebuilt = scene_from(&sent(&scene(&original))).expect("a scene");
        prop_assert_eq!(bits(&rebuilt), bits(&original));
        let digest = |scene| World::new(scene).map(|world| world.digest());
        prop_assert_eq!(digest(rebuilt), digest(original));
    }

    #[test]
    fn inputs_survive(samples in proptest::collection::vec(proptest::option::of(sample()), 0..3), at in pose()) {
        let input = StepInput {
            commands: vec![
                Command::AddHand { hand: HandId(7), model: Box::new(HandModel::adult(Side::Left)) },
                Command::RemoveHand(HandId(3)),
                Command::AddObject(Box::new(object(1, 3, at, None))),
                Command::RemoveObject(ObjectId { slot: 1, generation: 2 }),
                Command::Release(ObjectId { slot: 0, generation: 0 }),
                Command::Reset,
                Command::SetModel(Model::Paper),
            ],
            hands: (0..).zip(samples).map(|(hand, sample)| HandInput { hand: HandId(hand), sample }).collect(),
        };
        let message = sent(&step_input(2, 9, &input, |hand| format!("hand {}", hand.0)));
        prop_assert_eq!((message.epoch, message.tick), (2, 9));
        let rebuilt = step_input_from(&message).map(|input| bits(&input));
        prop_assert_eq!(rebuilt, Ok(bits(&input)));
    }
}

#[test]
fn hand_models_survive() {
    for side in [Side::Left, Side::Right] {
        let mut model = HandModel::adult(side);
        model.skeleton = model.skeleton.scaled(1.0 / 3.0 + 0.5);
        model.point_radius = 0.004;
        let rebuilt = hand_model_from(&sent(&hand_model(&model)));
        assert_eq!(rebuilt.map(|m| bits(&m)), Ok(bits(&model)));
    }
}

#[test]
fn shapes_survive_and_faces_alone_will_do() {
    for solid in solids() {
        let message = sent(&shape(&solid));
        let rebuilt = polyhedron_from(&message, "a").expect("a solid");
        assert_eq!(bits(&rebuilt), bits(&solid));
        let faces_only = v1::Shape {
            triangles: Vec::new(),
            ..message
        };
        let rebuilt = polyhedron_from(&faces_only, "a").expect("a solid");
        assert_eq!(rebuilt.faces().len(), solid.faces().len());
        assert!((rebuilt.volume() / solid.volume() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn strangers_are_told_what_is_wrong_with_a_shape() {
    let good = || shape(&solids().swap_remove(0));
    let check = |spoil: &dyn Fn(&mut v1::Shape), words: &str| {
        let mut message = good();
        spoil(&mut message);
        let fault = polyhedron_from(&message, "box")
            .expect_err(words)
            .to_string();
        assert!(fault.contains(words), "{fault} does not say {words}");
    };
    check(&|s| s.vertices.truncate(4), "shape.vertices has 4 numbers");
    check(&|s| s.vertices[3] = f64::NAN, "vertex 1 is not finite");
    check(
        &|s| s.triangles.truncate(4),
        "shape.triangles has 4 numbers",
    );
    check(&|s| s.triangles.truncate(33), "open");
    check(&|s| s.triangles[0] = 99, "99");
    let faces = |faces: Vec<u32>| v1::Shape {
        triangles: Vec::new(),
        faces,
        ..good()
    };
    assert_eq!(
        polyhedron_from(&faces(vec![1, 4, 0, 1]), "a").err(),
        Some(Fault::FacesCut)
    );
    assert_eq!(
        polyhedron_from(&faces(vec![1]), "a").err(),
        Some(Fault::FacesCut)
    );
    assert_eq!(
        polyhedron_from(&faces(vec![1, u32::MAX, 0]), "a").err(),
        Some(Fault::FacesCut)
    );
    assert_eq!(
        polyhedron_from(&faces(vec![2, 3]), "a").err(),
        Some(Fault::Holes(0))
    );
    assert!(polyhedron_from(&v1::Shape::default(), "a").is_err());
}

#[test]
fn strangers_are_told_what_is_wrong_with_a_sample() {
    let wrist = Some(v1::Pose {
        position: Some(v1::Vec3::default()),
        rotation: None,
    });
    let sample = v1::HandSample {
        wrist,
        valid: true,
        angles: vec![0.0; 21],
        ..v1::HandSample::default()
    };
    assert!(hand_sample_from(&sample).is_ok());
    let check = |message: v1::HandSample, words: &str| {
        let fault = hand_sample_from(&message).expect_err(words).to_string();
        assert!(fault.contains(words), "{fault} does not say {words}");
    };
    check(
        v1::HandSample {
            angles: vec![0.0; 20],
            ..sample.clone()
        },
        "angles has 20 numbers, it must have 21",
    );
    check(
        v1::HandSample {
            joints: vec![0.0; 60],
            ..sample.clone()
        },
        "not both",
    );
    check(
        v1::HandSample {
            angles: Vec::new(),
            ..sample.clone()
        },
        "joints or angles is missing",
    );
    check(
        v1::HandSample {
            wrist: None,
            ..sample.clone()
        },
        "wrist is missing",
    );
    let nowhere = v1::Quat::default();
    let wrist = Some(v1::Pose {
        position: Some(v1::Vec3::default()),
        rotation: Some(nowhere),
    });
    check(
        v1::HandSample {
            wrist,
            ..sample.clone()
        },
        "wrist is no rotation",
    );
}

#[test]
fn a_lost_hand_is_no_fault_and_an_empty_model_is_one() {
    assert_eq!(
        hand_sample_from(&v1::HandSample {
            valid: false,
            ..v1::HandSample::default()
        }),
        Ok(None)
    );
    assert!(hand_model_from(&v1::HandModel::default()).is_err());
}
