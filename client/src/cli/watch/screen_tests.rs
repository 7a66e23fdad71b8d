use tsukamu_proto::v1::{Hand, Object, Pose, Scene, Shape, Vec3};

use super::*;

fn model(n_objects: u64) -> WatchModel {
    let object = |id: u64| Object {
        id,
        name: format!("block {id}"),
        pose: Some(Pose {
            position: Some(Vec3 {
                x: 0.1 * id as f64,
                y: 0.05,
                z: 0.0,
            }),
            rotation: None,
        }),
        shape: Some(Shape {
            vertices: vec![-0.05, -0.05, 0.0, 0.05, 0.05, 0.0],
            edges: vec![0, 1],
            ..Shape::default()
        }),
        ..Object::default()
    };
    let mut model = WatchModel::new("http://127.0.0.1:7447");
    let hands = vec![Hand {
        id: 0,
        name: "synthetic:stack".into(),
        model: None,
    }];
    model.take_scene(Scene {
        objects: (0..n_objects).map(object).collect(),
        hands,
        ..Scene::default()
    });
    model
}

fn view(n_objects: u64) -> WorldView {
    use nalgebra::Isometry3;
    use tsukamu_client::view::{HandView, N_JOINTS, ObjectView, Stamp};
    use tsukamu_proto::v1::{ContactState, Side, Tracking};
    let object = |id: u64| ObjectView {
        pose: Isometry3::translation(0.1 * id as f64, 0.05, 0.0),
        state: if id == 0 {
            ContactState::Grasped
        } else {
            ContactState::Free
        },
        resting: id > 0,
        holder: (id == 0).then_some(0),
    };
    let hand = HandView {
        id: 0,
        side: Side::Right,
        tracking: Tracking::Tracked,
        wrist: Isometry3::identity(),
        tracked: [None; N_JOINTS],
        shown: [None; N_JOINTS],
        holds: Some(0),
        sample_age_s: 0.004,
    };
    WorldView {
        stamp: Stamp {
            epoch: 1,
            tick: 240,
            world_time_s: 1.0,
            wall_ns: 1,
        },
        scene_version: 1,
        objects: (0..n_objects).map(|id| (id, object(id))).collect(),
        hands: vec![hand],
    }
}

#[test]
fn the_screen_fits_every_terminal() {
    for n_objects in [0, 1, 5, 300] {
        let mut model = model(n_objects);
        model.take_view(view(n_objects), 5);
        for (width, height) in [
            (80, 24),
            (40, 10),
            (200, 60),
            (120, 3),
            (1, 1),
            (0, 0),
            (300, 100),
        ] {
            let lines = lines(&mut model, 10, width, height);
            assert!(
                lines.len() <= height,
                "{n_objects} objects, {width}x{height}: {} lines",
                lines.len()
            );
            for line in &lines {
                assert!(
                    measure_text_width(line) <= width,
                    "{width}x{height}: {line}"
                );
            }
        }
    }
}

#[test]
fn hands_and_objects_are_named_with_their_state() {
    let mut model = model(3);
    model.take_view(view(3), 5);
    let text = lines(&mut model, 10, 100, 30).join("\n");
    for part in [
        "right  synthetic:stack",
        "● tracked",
        "block 0",
        "grasped",
        "resting",
        "tick 240",
        "4.0 ms",
    ] {
        assert!(text.contains(part), "{part} is missing in\n{text}");
    }
}

#[test]
fn the_active_come_first_where_not_all_fit() {
    let mut model = model(300);
    let mut many = view(300);
    if let Some(object) = many.objects.get_mut(&299) {
        object.resting = false;
    }
    model.take_view(many, 5);
    let text = lines(&mut model, 10, 100, 24).join("\n");
    assert!(
        text.contains("block 299") && text.contains("block 0 "),
        "{text}"
    );
    assert!(
        text.contains("more; 1 held and 298 resting in all"),
        "{text}"
    );
}

#[test]
fn a_lost_connection_is_said() {
    let mut model = model(1);
    model.lost = Some("gone\u{1b}[2J".into());
    let text = lines(&mut model, 10, 100, 24).join("\n");
    assert!(text.contains("connection lost (gone·[2J)"), "{text}");
}
