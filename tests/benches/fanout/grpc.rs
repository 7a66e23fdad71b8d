//! The daemon, and its subscribers.

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};
use prost::bytes::Buf;
use tonic::Status;
use tonic::client::Grpc;
use tonic::codec::{Codec, DecodeBuf, Decoder};
use tonic::codegen::http::uri::PathAndQuery;
use tonic::transport::Endpoint;
use tonic_prost::ProstCodec;
use tsukamu_proto::v1::WatchFramesRequest;
use tsukamu_server::daemon::{DaemonConfig, start};
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file::LoadedScene;
use tsukamu_server::settings::Mode;
use tsukamu_world::polyhedron::shapes;
use tsukamu_world::scene::{ObjectSpec, Scene};

use crate::count::Count;
use crate::process::{Server, say};
use crate::{N_OBJECTS, Outcome, RATE_HZ};

/// The method.
const PATH: &str = "/tsukamu.v1.World/WatchFrames";
/// First byte of a message that holds a frame: field 1, length-delimited.
const FRAME_TAG: u8 = 0x0a;
/// The objects fall this slowly, so that they are on the way for minutes, m/s².
const GRAVITY: f64 = -0.01;
/// Where they begin, metres above the floor.
const HEIGHT_M: f64 = 1000.0;

/// Runs a daemon until it is killed.
pub(crate) fn serve() -> anyhow::Result<()> {
    let loaded = LoadedScene {
        scene: scene()?,
        default_hands: Vec::new(),
        source_text: String::new(),
    };
    let config = DaemonConfig::new(plan(&loaded, Cast::Nobody)?, Mode::Realtime);
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?;
    runtime.block_on(async {
        let daemon = start(config).await?;
        say(daemon.local_addr())?;
        daemon.failed().await;
        Ok(())
    })
}

/// A hundred cubes that fall all the time, side by side.
fn scene() -> anyhow::Result<Scene> {
    let shape = Arc::new(shapes::cuboid(&Vector3::repeat(0.05))?);
    let object = |index: usize| ObjectSpec {
        name: format!("cube {index}"),
        shape: Arc::clone(&shape),
        pose: Isometry3::translation(index as f64, HEIGHT_M, 0.0),
        grasp_angle: None,
        density: 500.0,
        colour: [0.5; 3],
    };
    Ok(Scene {
        name: "falling".to_owned(),
        rate_hz: RATE_HZ,
        gravity: Vector3::new(0.0, GRAVITY, 0.0),
        objects: (0..N_OBJECTS).map(object).collect(),
        ..Scene::default()
    })
}

/// Subscribes so often and measures.
pub(crate) async fn watch(server: &Server, n_subscribers: usize) -> anyhow::Result<Outcome> {
    let count = Arc::new(Count::default());
    let mut tasks = tokio::task::JoinSet::new();
    for _ in 0..n_subscribers {
        let address = format!("http://{}", server.address());
        let channel = Endpoint::from_shared(address)?
            .tcp_nodelay(true)
            .connect()
            .await?;
        let mut grpc = Grpc::new(channel);
        grpc.ready().await?;
        let request = tonic::Request::new(WatchFramesRequest { max_rate_hz: 0.0 });
        let path = PathAndQuery::from_static(PATH);
        let mut frames = grpc
            .server_streaming(request, path, CountingCodec)
            .await?
            .into_inner();
        let count = Arc::clone(&count);
        tasks.spawn(async move {
            let mut first = true;
            // The stream ends with an error when the server is killed.
            while let Ok(Some(message)) = frames.message().await {
                if !message.is_frame {
                    continue;
                }
                count.add(message.n_bytes);
                if std::mem::replace(&mut first, false) {
                    count.join();
                }
            }
        });
    }
    let outcome = count.measure(server, n_subscribers).await;
    tasks.shutdown().await;
    outcome
}

/// A message that is not looked into, so that the subscribers leave the processor to the server.
#[derive(Clone, Copy, Debug)]
struct Counted {
    is_frame: bool,
    n_bytes: usize,
}

#[derive(Clone, Copy, Debug, Default)]
struct CountingCodec;

#[derive(Clone, Copy, Debug, Default)]
struct CountingDecoder;

impl Codec for CountingCodec {
    type Encode = WatchFramesRequest;
    type Decode = Counted;
    type Encoder = <ProstCodec<WatchFramesRequest, ()> as Codec>::Encoder;
    type Decoder = CountingDecoder;

    fn encoder(&mut self) -> Self::Encoder {
        ProstCodec::<WatchFramesRequest, ()>::default().encoder()
    }

    fn decoder(&mut self) -> Self::Decoder {
        CountingDecoder
    }
}

impl Decoder for CountingDecoder {
    type Item = Counted;
    type Error = Status;

    fn decode(&mut self, buffer: &mut DecodeBuf<'_>) -> Result<Option<Counted>, Status> {
        let n_bytes = buffer.remaining();
        let is_frame = buffer.chunk().first() == Some(&FRAME_TAG);
        buffer.advance(n_bytes);
        Ok(Some(Counted { is_frame, n_bytes }))
    }
}
