//! Lockstep and commands.

use tonic::Code;
use tsukamu_proto::v1;
use tsukamu_server::settings::Mode;
use tsukamu_world::{StepInput, World};

use super::support::{control, cubes, daemon, next_frame, soon, step, tick, watch, world};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn lockstep_is_the_world_itself() {
    let daemon = daemon(cubes(3, 240.0), Mode::Lockstep).await;
    let mut control = control(&daemon).await;
    let mut twin = World::new(cubes(3, 240.0)).expect("a world");
    for n in [0, 1, 7, 500] {
        let done = step(&mut control, n).await;
        (0..n.max(1)).for_each(|_| {
            twin.step(&StepInput::default());
        });
        assert_eq!(
            (tick(done.stamp), done.digest),
            (twin.state().tick, twin.digest())
        );
    }
    let too_many = soon(control.step(v1::StepRequest { n: 1_000_001 }))
        .await
        .expect_err("too many");
    assert_eq!(too_many.code(), Code::InvalidArgument);
    let pause = soon(control.pause(v1::PauseRequest {}))
        .await
        .expect_err("no clock");
    assert_eq!(pause.code(), Code::FailedPrecondition);
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_clock_stops_and_goes_on() {
    let daemon = daemon(cubes(1, 240.0), Mode::Realtime).await;
    let (mut control, mut world) = (control(&daemon).await, world(&daemon).await);
    let refused = soon(control.step(v1::StepRequest { n: 1 }))
        .await
        .expect_err("real time");
    assert_eq!(refused.code(), Code::FailedPrecondition);
    let paused = soon(control.pause(v1::PauseRequest {}))
        .await
        .expect("it pauses")
        .into_inner();
    let status = soon(world.get_status(v1::GetStatusRequest {}))
        .await
        .expect("a status")
        .into_inner();
    assert!(status.paused);
    assert_eq!(tick(status.stamp), tick(paused.stamp));
    let reset = soon(control.reset(v1::ResetRequest {}))
        .await
        .expect("answered at once")
        .into_inner();
    assert_eq!(tick(reset.stamp), tick(paused.stamp));
    let resumed = soon(control.resume(v1::ResumeRequest {}))
        .await
        .expect("it goes on")
        .into_inner();
    assert_eq!(tick(resumed.stamp), tick(paused.stamp));
    let carried_out = soon(control.reset(v1::ResetRequest {}))
        .await
        .expect("a command")
        .into_inner();
    assert!(tick(carried_out.stamp) > tick(paused.stamp));
    daemon.shutdown().await.expect("a clean end");
}

/// A cube like the scene's first, beside everything, at a height.
fn above(scene: &v1::Scene, name: &str, y: f64) -> v1::AddObjectRequest {
    let position = Some(v1::Vec3 { x: 5.0, y, z: 0.0 });
    v1::AddObjectRequest {
        name: name.to_owned(),
        shape: scene.objects[0].shape.clone(),
        pose: Some(v1::Pose {
            position,
            rotation: None,
        }),
        ..v1::AddObjectRequest::default()
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn commands_that_cannot_be_carried_out_are_refused() {
    let daemon = daemon(cubes(2, 240.0), Mode::Lockstep).await;
    let (mut control, mut world) = (control(&daemon).await, world(&daemon).await);
    let now = soon(world.get_scene(v1::GetSceneRequest {}))
        .await
        .expect("a scene")
        .into_inner();
    let scene = now.scene.expect("a scene");
    let above = |name, y| above(&scene, name, y);
    soon(control.remove_object(v1::RemoveObjectRequest { id: 1 }))
        .await
        .expect("it is there");
    let refusals = [
        soon(control.add_object(above("cube 1", 3.0)))
            .await
            .expect_err("the name is taken"),
        soon(control.add_object(above("deep", -3.0)))
            .await
            .expect_err("below the floor"),
        soon(control.add_object(v1::AddObjectRequest::default()))
            .await
            .expect_err("no shape"),
        soon(control.remove_object(v1::RemoveObjectRequest { id: 1 }))
            .await
            .expect_err("gone"),
        soon(control.release(v1::ReleaseRequest { id: 77 }))
            .await
            .expect_err("never there"),
        soon(control.set_model(v1::SetModelRequest {
            model: "magic".to_owned(),
        }))
        .await
        .expect_err("no model"),
    ];
    let codes = refusals.map(|refusal| refusal.code());
    let (bad, absent) = (Code::InvalidArgument, Code::NotFound);
    assert_eq!(codes, [bad, bad, bad, absent, absent, bad]);
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn objects_come_and_go() {
    let daemon = daemon(cubes(2, 240.0), Mode::Lockstep).await;
    let (mut control, mut world) = (control(&daemon).await, world(&daemon).await);
    let before = soon(world.get_scene(v1::GetSceneRequest {}))
        .await
        .expect("a scene")
        .into_inner();
    let scene = before.scene.expect("a scene");
    assert_eq!(
        scene
            .objects
            .iter()
            .map(|o| o.name.as_str())
            .collect::<Vec<_>>(),
        ["floor", "cube 0", "cube 1"]
    );
    let above = |name, y| above(&scene, name, y);
    // The cube on the floor comes to rest, and is of no more interest.
    step(&mut control, 1).await;
    let mut frames = watch(&mut world, 0.0).await;
    next_frame(&mut frames, &mut 0).await;
    // A freed slot is used again, under another id.
    soon(control.remove_object(v1::RemoveObjectRequest { id: 1 }))
        .await
        .expect("it is there");
    let first = soon(control.add_object(above("new", 3.0)))
        .await
        .expect("an object")
        .into_inner()
        .id;
    let second = soon(control.add_object(above("newer", 4.0)))
        .await
        .expect("an object")
        .into_inner()
        .id;
    assert_eq!((first, second), (1 | 1 << 32, 3));
    step(&mut control, 1).await;
    let frame = next_frame(&mut frames, &mut 0).await;
    assert_eq!(frame.removed_ids, [1]);
    assert_eq!(frame.object_ids, [2, 3, 1 | 1 << 32], "ascending");
    let after = soon(world.get_scene(v1::GetSceneRequest {}))
        .await
        .expect("a scene")
        .into_inner();
    assert!(after.scene_version > before.scene_version);
    assert_eq!(after.scene_version, frame.scene_version);
    let names = after
        .scene
        .expect("a scene")
        .objects
        .into_iter()
        .map(|o| (o.id, o.name))
        .collect::<Vec<_>>();
    let expected = [
        (0, "floor"),
        (1 | 1 << 32, "new"),
        (2, "cube 1"),
        (3, "newer"),
    ];
    assert_eq!(names, expected.map(|(id, name)| (id, name.to_owned())));
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_scene_is_loaded_into_a_new_epoch() {
    let daemon = daemon(cubes(2, 240.0), Mode::Lockstep).await;
    let (mut control, mut world) = (control(&daemon).await, world(&daemon).await);
    let mut frames = watch(&mut world, 0.0).await;
    let first = next_frame(&mut frames, &mut 0)
        .await
        .stamp
        .expect("a stamp");
    step(&mut control, 5).await;
    let toml = v1::load_scene_request::Source::Toml("name = \"bare\"\nrate_hz = 100\n".to_owned());
    let loaded = soon(control.load_scene(load(toml)))
        .await
        .expect("a scene")
        .into_inner();
    let stamp = loaded.stamp.expect("a stamp");
    assert_eq!((stamp.epoch, stamp.tick), (first.epoch + 1, 0));
    let frame = loop {
        let frame = next_frame(&mut frames, &mut 0).await;
        if frame.stamp.is_some_and(|stamp| stamp.epoch > first.epoch) {
            break frame;
        }
    };
    assert_eq!(
        (frame.object_ids.len(), frame.keyframe_tick),
        (0, 0),
        "the new epoch begins with a keyframe"
    );
    let status = soon(world.get_status(v1::GetStatusRequest {}))
        .await
        .expect("a status")
        .into_inner();
    assert_eq!(
        (status.scene.as_str(), status.rate_hz, status.n_objects),
        ("bare", 100.0, 0)
    );
    daemon.shutdown().await.expect("a clean end");
}

fn load(source: v1::load_scene_request::Source) -> v1::LoadSceneRequest {
    v1::LoadSceneRequest {
        source: Some(source),
        with_default_hands: false,
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_scene_that_is_none_is_refused() {
    let daemon = daemon(cubes(0, 240.0), Mode::Lockstep).await;
    let mut control = control(&daemon).await;
    let name = v1::load_scene_request::Source::Name("no/such".to_owned());
    assert_eq!(
        soon(control.load_scene(load(name)))
            .await
            .expect_err("no scene")
            .code(),
        Code::NotFound
    );
    let path = v1::load_scene_request::Source::Name("/etc/passwd".to_owned());
    assert_eq!(
        soon(control.load_scene(load(path)))
            .await
            .expect_err("no scene")
            .code(),
        Code::NotFound
    );
    let bad = v1::load_scene_request::Source::Toml("rate_hz = -1\ncolour = 3\n".to_owned());
    let refused = soon(control.load_scene(load(bad)))
        .await
        .expect_err("two mistakes");
    assert!(
        refused.message().contains("rate_hz") && refused.message().contains("colour"),
        "{refused}"
    );
    daemon.shutdown().await.expect("a clean end");
}
