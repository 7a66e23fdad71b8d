//! A daemon in process, and what the tests ask it.

use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use tonic::Streaming;
use tonic::transport::Channel;
use tsukamu_proto::v1;
use tsukamu_proto::v1::control_client::ControlClient;
use tsukamu_proto::v1::watch_frames_response::Kind;
use tsukamu_proto::v1::world_client::WorldClient;
use tsukamu_server::daemon::{Daemon, DaemonConfig, start};
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file::LoadedScene;
use tsukamu_server::settings::Mode;
use tsukamu_world::polyhedron::shapes;
use tsukamu_world::scene::{ObjectSpec, Scene};

/// Longest that a test waits for anything: far beyond what it takes on a loaded machine.
const DEADLINE: Duration = Duration::from_secs(30);

/// The value of a future that comes within the deadline.
pub(crate) async fn soon<T>(future: impl Future<Output = T>) -> T {
    tokio::time::timeout(DEADLINE, future)
        .await
        .expect("it comes within the deadline")
}

/// `n_falling` cubes high above the floor and one that lies on it, called `floor`, at `rate_hz` steps per second.
pub(crate) fn cubes(n_falling: usize, rate_hz: f64) -> Scene {
    let shape = Arc::new(shapes::cuboid(&Vector3::repeat(0.05)).expect("a cube"));
    let at = |name: String, x: f64, y: f64| ObjectSpec {
        name,
        shape: Arc::clone(&shape),
        pose: Isometry3::from_parts(Translation3::new(x, y, 0.0), UnitQuaternion::identity()),
        grasp_angle: None,
        density: 700.0,
        colour: [0.5; 3],
    };
    let falling = (0..n_falling).map(|k| at(format!("cube {k}"), 0.1 * k as f64, 1000.0));
    let objects = std::iter::once(at("floor".to_owned(), -1.0, 0.025))
        .chain(falling)
        .collect();
    Scene {
        name: "cubes".to_owned(),
        rate_hz,
        objects,
        ..Scene::default()
    }
}

/// What a daemon of this scene is started with.
pub(crate) fn config(scene: Scene, mode: Mode) -> DaemonConfig {
    let loaded = LoadedScene {
        scene,
        default_hands: Vec::new(),
        source_text: "# a scene\n".to_owned(),
    };
    DaemonConfig::new(plan(&loaded, Cast::Nobody).expect("a plan"), mode)
}

/// A daemon of this scene.
pub(crate) async fn daemon(scene: Scene, mode: Mode) -> Daemon {
    start(config(scene, mode)).await.expect("it starts")
}

/// A connection of its own.
pub(crate) async fn connect(daemon: &Daemon) -> Channel {
    let uri = format!("http://{}", daemon.local_addr());
    soon(Channel::from_shared(uri).expect("an address").connect())
        .await
        .expect("it listens")
}

pub(crate) async fn world(daemon: &Daemon) -> WorldClient<Channel> {
    WorldClient::new(connect(daemon).await)
}

pub(crate) async fn control(daemon: &Daemon) -> ControlClient<Channel> {
    ControlClient::new(connect(daemon).await)
}

/// Does steps in lockstep.
pub(crate) async fn step(control: &mut ControlClient<Channel>, n: u32) -> v1::StepResponse {
    soon(control.step(v1::StepRequest { n }))
        .await
        .expect("lockstep")
        .into_inner()
}

/// Frames from now on.
pub(crate) async fn watch(
    world: &mut WorldClient<Channel>,
    max_rate_hz: f64,
) -> Streaming<v1::WatchFramesResponse> {
    soon(world.watch_frames(v1::WatchFramesRequest { max_rate_hz }))
        .await
        .expect("a stream")
        .into_inner()
}

/// The next message of a stream that goes on.
pub(crate) async fn next<T>(stream: &mut Streaming<T>) -> T {
    soon(stream.message())
        .await
        .expect("no error")
        .expect("the stream goes on")
}

/// The next frame; what was skipped is added to `n_skipped`.
pub(crate) async fn next_frame(
    stream: &mut Streaming<v1::WatchFramesResponse>,
    n_skipped: &mut u64,
) -> v1::Frame {
    loop {
        match next(stream).await.kind.expect("a kind") {
            Kind::Frame(frame) => return frame,
            Kind::Skipped(skipped) => *n_skipped += skipped.count,
        }
    }
}

/// The tick of a stamp.
pub(crate) fn tick(stamp: Option<v1::Stamp>) -> u64 {
    stamp.expect("every message carries a stamp").tick
}
