//! Recordings that begin in mid-session: nobody notices, and they are proofs all the same.

use std::path::{Path, PathBuf};

use tonic::Streaming;
use tonic::transport::Channel;
use tsukamu_proto::v1;
use tsukamu_proto::v1::control_client::ControlClient;
use tsukamu_proto::v1::recordings_client::RecordingsClient;
use tsukamu_server::daemon::{Daemon, DaemonConfig, start};
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::record::export::export;
use tsukamu_server::record::reader::{self, Ending};
use tsukamu_server::record::recover::recover;
use tsukamu_server::record::verify::{Verification, verify};
use tsukamu_server::scene_file::parse;
use tsukamu_server::settings::Mode;

use super::support::{connect, control, next_frame, soon, step, tick, watch, world};

const HAND: &str = "synthetic:grasp-throw";
const SCENE: &str = "\
    name = 'mid-session'\nthrow_window_s = 0.02\nhands = ['synthetic:grasp-throw']\n\
    [[object]]\nname = 'cube'\nshape = 'box'\nsize = [0.05, 0.05, 0.05]\nposition = [0, 0, -0.3]\non_floor = true\n";

/// A daemon of [`SCENE`] whose hand begins again and again, and its folder of recordings, empty.
async fn daemon(name: &str, mode: Mode) -> (Daemon, PathBuf) {
    let loaded = parse("mid-session", SCENE, Path::new(".")).expect("a scene");
    let plan = plan(&loaded, Cast::Default { repeats: true }).expect("a plan");
    let mut config = DaemonConfig::new(plan, mode);
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    config.recording.dir.clone_from(&folder);
    (start(config).await.expect("it starts"), folder)
}

async fn recordings(daemon: &Daemon) -> RecordingsClient<Channel> {
    RecordingsClient::new(connect(daemon).await)
}

async fn record(desk: &mut RecordingsClient<Channel>) -> v1::Stamp {
    let request = v1::StartRecordingRequest {
        name: "run".to_owned(),
        frames: true,
        raw: true,
    };
    let begun = soon(desk.start_recording(request))
        .await
        .expect("it begins");
    begun.into_inner().stamp.expect("a stamp")
}

async fn stop(desk: &mut RecordingsClient<Channel>) -> v1::StopRecordingResponse {
    let done = soon(desk.stop_recording(v1::StopRecordingRequest {}))
        .await
        .expect("it ends")
        .into_inner();
    assert_eq!(done.dropped, 0, "{done:?}");
    done
}

async fn play(desk: &mut RecordingsClient<Channel>) -> v1::Stamp {
    let name = "run.mcap".to_owned();
    let played = soon(desk.play_recording(v1::PlayRecordingRequest { name })).await;
    let played = played.expect("it plays").into_inner();
    played.stamp.expect("a stamp")
}

async fn scene(daemon: &Daemon) -> v1::GetSceneResponse {
    let mut world = world(daemon).await;
    let now = soon(world.get_scene(v1::GetSceneRequest {})).await;
    now.expect("a scene").into_inner()
}

/// The first frame in which the hand holds something; `advance` makes the next one come.
async fn held_frame(
    frames: &mut Streaming<v1::WatchFramesResponse>,
    control: Option<&mut ControlClient<Channel>>,
) -> v1::Frame {
    let mut control = control;
    loop {
        if let Some(control) = &mut control {
            step(control, 1).await;
        }
        let frame = next_frame(frames, &mut 0).await;
        if frame.hands.iter().any(|hand| hand.holds != 0) {
            return frame;
        }
    }
}

fn verified(file: &Path) -> Verification {
    let found = verify(reader::open(file).expect("it opens"), |_| {});
    assert_eq!(found.fault, None, "{found:?}");
    assert_eq!(found.ending, Some(Ending::Complete));
    assert!(found.digests > 1, "{found:?}");
    found
}

/// Adds two objects and takes the first out again, so that a slot is empty.
async fn leave_a_hole(daemon: &Daemon, control: &mut ControlClient<Channel>) {
    let shape = scene(daemon).await.scene.expect("a scene").objects[0]
        .shape
        .clone();
    let mut ids = Vec::new();
    for (name, x) in [("early", 5.0), ("late", 6.0)] {
        let position = Some(v1::Vec3 { x, y: 1.0, z: 0.0 });
        let request = v1::AddObjectRequest {
            name: name.to_owned(),
            shape: shape.clone(),
            pose: Some(v1::Pose {
                position,
                rotation: None,
            }),
            ..v1::AddObjectRequest::default()
        };
        let added = soon(control.add_object(request))
            .await
            .expect("it is added");
        ids.push(added.into_inner().id);
    }
    step(control, 30).await;
    let id = ids[0];
    soon(control.remove_object(v1::RemoveObjectRequest { id }))
        .await
        .expect("it was there");
    step(control, 30).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recording_begins_while_the_object_is_held() {
    let (daemon, folder) = daemon("daemon-mid-session", Mode::Lockstep).await;
    let (mut control, mut desk) = (control(&daemon).await, recordings(&daemon).await);
    leave_a_hole(&daemon, &mut control).await;
    let mut frames = watch(&mut world(&daemon).await, 0.0).await;
    held_frame(&mut frames, Some(&mut control)).await;
    let now = step(&mut control, 1).await.stamp.expect("a stamp");
    let before = scene(&daemon).await;
    let begun = record(&mut desk).await;
    assert_eq!((begun.epoch, begun.tick), (now.epoch, now.tick), "no jump");
    assert_eq!(scene(&daemon).await, before, "nothing has changed");
    step(&mut control, 400).await;
    soon(control.reset(v1::ResetRequest {}))
        .await
        .expect("a reset");
    let end = step(&mut control, 400).await;
    assert_eq!(
        (end.stamp.map(|stamp| stamp.epoch), tick(end.stamp)),
        (Some(now.epoch), now.tick + 800)
    );
    stop(&mut desk).await;
    let file = folder.join("run.mcap");
    let found = verified(&file);
    assert_eq!((found.epochs, found.ticks), (1, 800));
    let copy = folder.join("copy.mcap");
    recover(&file, &copy).expect("a copy");
    assert_eq!(verified(&copy).ticks, 800);
    exported(&file, &folder.join("tables"), now.tick + 1);

    let played = play(&mut desk).await;
    assert_eq!((played.epoch, played.tick), (now.epoch + 1, now.tick));
    let shown = scene(&daemon).await.scene.expect("a scene");
    assert_eq!(
        Some(shown),
        before.scene,
        "objects, poses, hands and their names"
    );
    let again = step(&mut control, 800).await;
    assert_eq!(again.digest, end.digest, "the same to the last bit");
    // The recording is through: its hand leaves, and there is no other.
    step(&mut control, 2).await;
    let hands = scene(&daemon).await.scene.expect("a scene").hands;
    assert_eq!(hands, []);
    daemon.shutdown().await.expect("a clean end");
}

/// Tables of the recording, in which the hand has its name from the first tick on.
fn exported(file: &Path, tables: &Path, first_tick: u64) {
    export(reader::open(file).expect("it opens"), tables, |_| {}).expect("tables");
    let table = |name: &str| std::fs::read_to_string(tables.join(name)).expect("a table");
    let (hands, poses) = (table("hands.csv"), table("poses.csv"));
    assert_eq!(hands.lines().count(), 801);
    assert!(hands.lines().skip(1).all(|row| row.contains(HAND)));
    let column = poses
        .lines()
        .next()
        .expect("a head")
        .split(',')
        .position(|name| name == "tick");
    let first = poses
        .lines()
        .nth(1)
        .expect("a row")
        .split(',')
        .nth(column.expect("ticks"));
    assert_eq!(first, Some(first_tick.to_string().as_str()));
    let objects = ["cube", "late", "early"].map(|name| poses.contains(&format!(",{name},")));
    assert_eq!(objects, [true, true, false]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn frames_go_on_in_real_time_while_a_recording_begins() {
    let (daemon, folder) = daemon("daemon-mid-realtime", Mode::Realtime).await;
    let mut desk = recordings(&daemon).await;
    let mut frames = watch(&mut world(&daemon).await, 0.0).await;
    let held = held_frame(&mut frames, None).await.stamp.expect("a stamp");
    let begun = record(&mut desk).await;
    assert!(
        begun.epoch == held.epoch && begun.tick >= held.tick,
        "{begun:?} after {held:?}"
    );
    let mut last = held.tick;
    while last < begun.tick + 120 {
        let stamp = next_frame(&mut frames, &mut 0)
            .await
            .stamp
            .expect("a stamp");
        assert!(
            stamp.epoch == held.epoch && stamp.tick > last,
            "{stamp:?} after tick {last}"
        );
        last = stamp.tick;
    }
    let done = stop(&mut desk).await;
    let found = verified(&folder.join("run.mcap"));
    assert_eq!(found.ticks, tick(done.stamp) - begun.tick);
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn all_epochs_of_a_recording_are_played() {
    let (daemon, folder) = daemon("daemon-epochs", Mode::Lockstep).await;
    let (mut control, mut desk) = (control(&daemon).await, recordings(&daemon).await);
    step(&mut control, 50).await;
    record(&mut desk).await;
    let first = step(&mut control, 100).await;
    // Another rate, too.
    let toml = SCENE.replace("name = 'mid-session'", "name = 'second'\nrate_hz = 120");
    let request = v1::LoadSceneRequest {
        source: Some(v1::load_scene_request::Source::Toml(toml)),
        with_default_hands: true,
    };
    soon(control.load_scene(request)).await.expect("a scene");
    let second = step(&mut control, 200).await;
    stop(&mut desk).await;
    let found = verified(&folder.join("run.mcap"));
    assert_eq!((found.epochs, found.ticks), (2, 300));

    let played = play(&mut desk).await;
    assert_eq!(played.tick, 50);
    assert_eq!(step(&mut control, 100).await.digest, first.digest);
    let again = step(&mut control, 200).await;
    assert_eq!(again.digest, second.digest);
    let stamp = again.stamp.expect("a stamp");
    assert_eq!((stamp.epoch, stamp.tick), (played.epoch + 1, 200));
    assert_eq!(
        scene(&daemon)
            .await
            .scene
            .map(|scene| scene.name)
            .as_deref(),
        Some("second")
    );
    daemon.shutdown().await.expect("a clean end");
}
