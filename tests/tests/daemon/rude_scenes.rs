//! Scenes and objects that are none, too large, or not files at all.

use tonic::Code;
use tsukamu_proto::v1;
use tsukamu_proto::v1::load_scene_request::Source;
use tsukamu_server::settings::Mode;

use super::recordings::folder;
use super::support::{connect, control, cubes, daemon, soon, step, world};

fn scene(toml: String) -> v1::LoadSceneRequest {
    v1::LoadSceneRequest {
        source: Some(Source::Toml(toml)),
        with_default_hands: true,
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_no_file_is_not_read() {
    let folder = folder("daemon-no-files");
    std::fs::create_dir_all(&folder).expect("a folder");
    // Nobody writes to these pipes, and /dev/zero has no end.
    let (mesh, csv) = (folder.join("pipe.obj"), folder.join("pipe.csv"));
    for pipe in [&mesh, &csv] {
        let made = std::process::Command::new("mkfifo").arg(pipe).status();
        assert!(made.expect("mkfifo").success());
    }
    let daemon = daemon(cubes(0, 240.0), Mode::Lockstep).await;
    let mut control = control(&daemon).await;
    let files = [
        mesh.to_str().expect("a name"),
        "/dev/zero",
        "/etc/passwd",
        "/",
    ];
    let meshes = files.map(|file| {
        format!(
            "[[object]]\nname = \"a\"\nshape = \"mesh\"\nfile = \"{file}\"\nposition = [0, 1, 0]\n"
        )
    });
    let hands = ["/dev/zero", csv.to_str().expect("a name"), "/etc/passwd"]
        .map(|file| format!("hands = [\"{file}\"]\n"));
    for toml in meshes.into_iter().chain(hands) {
        let refused = soon(control.load_scene(scene(toml.clone())))
            .await
            .expect_err(&toml);
        assert_eq!(refused.code(), Code::InvalidArgument, "{toml}: {refused}");
        assert!(!refused.message().contains("root:"), "{refused}");
    }
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_text_that_is_all_wrong_is_refused_in_short() {
    let daemon = daemon(cubes(0, 240.0), Mode::Lockstep).await;
    let mut control = control(&daemon).await;
    let texts = [
        "[[object]]\nnonsense = 1\n".repeat(5000),
        format!("a = {}", "[".repeat(100_000)),
        format!("{}x = 1", "a.".repeat(100_000)),
        "\u{0}\u{feff}{{{".to_owned(),
        "#".repeat(17 << 20),
        "rate_hz = nan\ngravity = [0, inf, 0]\n".to_owned(),
    ];
    for text in texts {
        let start: String = text.chars().take(30).collect();
        let refused = soon(control.load_scene(scene(text)))
            .await
            .expect_err(&start);
        assert_eq!(refused.code(), Code::InvalidArgument, "{start}: {refused}");
        assert!(!refused.message().is_empty() && refused.message().len() < 5000);
    }
    step(&mut control, 1).await;
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn solids_that_are_none_are_refused() {
    let daemon = daemon(cubes(0, 240.0), Mode::Lockstep).await;
    let (mut control, mut client) = (control(&daemon).await, world(&daemon).await);
    let now = soon(client.get_scene(v1::GetSceneRequest {}))
        .await
        .expect("a scene")
        .into_inner();
    let cube = now.scene.expect("a scene").objects[0]
        .shape
        .clone()
        .expect("a shape");
    let at = |x: f64| {
        Some(v1::Pose {
            position: Some(v1::Vec3 { x, y: 1.0, z: 0.0 }),
            rotation: None,
        })
    };
    let with = |change: &dyn Fn(&mut v1::AddObjectRequest)| {
        let mut request = v1::AddObjectRequest {
            name: "new".to_owned(),
            shape: Some(cube.clone()),
            pose: at(0.0),
            ..Default::default()
        };
        change(&mut request);
        request
    };
    let shape = |change: &dyn Fn(&mut v1::Shape)| {
        with(&|request| change(request.shape.as_mut().expect("a shape")))
    };
    let requests = [
        shape(&|shape| shape.vertices[4] = f64::NAN),
        shape(&|shape| shape.vertices[4] = 1e300),
        shape(&|shape| shape.triangles[4] = u32::MAX),
        shape(&|shape| drop(shape.triangles.drain(..3))),
        shape(&|shape| shape.triangles = vec![0; 3_000_000]),
        shape(&|shape| shape.vertices = vec![0.0; 3_000_000]),
        shape(&|shape| {
            shape.triangles.clear();
            shape.faces = vec![1, u32::MAX, 0, 1];
        }),
        with(&|request| request.pose = at(f64::NAN)),
        with(&|request| request.pose = at(1e300)),
        with(&|request| request.pose = None),
        with(&|request| request.colour = vec![f32::NAN; 3]),
        with(&|request| request.colour = vec![0.0; 2]),
        with(&|request| request.grasp_angle_rad = -1.0),
        with(&|request| request.name.clear()),
    ];
    for (k, request) in requests.into_iter().enumerate() {
        let refused = soon(control.add_object(request))
            .await
            .err()
            .unwrap_or_else(|| panic!("case {k} is taken"));
        assert_eq!(refused.code(), Code::InvalidArgument, "{k}: {refused}");
    }
    // More than any command may have: told so, and the connection lives.
    let huge = shape(&|shape| shape.vertices = vec![0.0; 9 << 20]);
    let refused = soon(control.add_object(huge)).await.expect_err("too large");
    assert_eq!(refused.code(), Code::OutOfRange, "{refused}");
    step(&mut control, 1).await;
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn thousands_of_objects_wait_for_a_step_and_a_client_can_have_them_all() {
    let daemon = daemon(cubes(8000, 240.0), Mode::Lockstep).await;
    let (control, mut client) = (control(&daemon).await, world(&daemon).await);
    let mut patient = v1::world_client::WorldClient::new(connect(&daemon).await)
        .max_decoding_message_size(64 << 20);
    let now = soon(patient.get_scene(v1::GetSceneRequest {}))
        .await
        .expect("a scene")
        .into_inner();
    let shape = now.scene.expect("a scene").objects[0].shape.clone();
    let add = async |k: u32| {
        let position = Some(v1::Vec3 {
            x: 0.1 * f64::from(k),
            y: 500.0,
            z: 0.0,
        });
        let request = v1::AddObjectRequest {
            name: format!("object {k}"),
            shape: shape.clone(),
            pose: Some(v1::Pose {
                position,
                rotation: None,
            }),
            ..Default::default()
        };
        let added = soon(control.clone().add_object(request)).await;
        let id = added.expect("an object").into_inner().id;
        assert_eq!(id, u64::from(k), "as the world gives it");
    };
    for k in 8001..8001 + 4096 {
        add(k).await;
    }
    let refused = soon(control.clone().reset(v1::ResetRequest {}))
        .await
        .expect_err("no more may wait");
    assert_eq!(refused.code(), Code::ResourceExhausted, "{refused}");
    step(&mut control.clone(), 1).await;
    // More than most clients take by default; they are told, and can ask for more.
    let refused = soon(client.get_scene(v1::GetSceneRequest {})).await.err();
    let code = refused.map(|status| status.code());
    assert_eq!(code, Some(Code::OutOfRange), "over 4 MB");
    let scene = soon(patient.get_scene(v1::GetSceneRequest {}))
        .await
        .expect("a scene")
        .into_inner();
    assert_eq!(scene.scene.expect("a scene").objects.len(), 8001 + 4096);
    daemon.shutdown().await.expect("a clean end");
}
