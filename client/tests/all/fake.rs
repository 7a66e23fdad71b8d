use std::collections::VecDeque;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tokio_stream::wrappers::TcpListenerStream;
use tokio_stream::{Stream, StreamExt};
use tonic::transport::Server;
use tonic::{Request, Response, Status, Streaming};
use tsukamu_client::connect::{Client, ConnectOptions};
use tsukamu_client::retry::RetryPolicy;
use tsukamu_proto::v1::clock_server::{Clock, ClockServer};
use tsukamu_proto::v1::hands_server::{Hands, HandsServer};
use tsukamu_proto::v1::watch_frames_response::Kind;
use tsukamu_proto::v1::world_server::{World, WorldServer};
use tsukamu_proto::v1::{
    ContactState, DriveOpen, DriveOpened, DriveRequest, DriveResponse, DriveState, Event, Frame,
    FramesSkipped, GetSceneRequest, GetSceneResponse, GetStatusRequest, GetStatusResponse,
    HandSample, Object, PingRequest, PingResponse, Scene, Stamp, WatchEventsRequest,
    WatchFramesRequest, WatchFramesResponse, drive_request, drive_response,
};

pub(crate) type FrameScript = Vec<Result<WatchFramesResponse, Status>>;
type Out<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// What the daemon says, and what it was told.
#[derive(Default)]
pub(crate) struct Script {
    pub(crate) status: GetStatusResponse,
    pub(crate) scene_version: u64,
    /// One script per stream that is opened; the stream ends with it. Without one the stream stays open.
    pub(crate) frames: VecDeque<FrameScript>,
    /// The log of events, and how many of them the next stream sends before it ends (`None`: all, and stays open).
    pub(crate) events: Vec<Event>,
    pub(crate) events_per_stream: VecDeque<usize>,
    pub(crate) oldest_event: u64,
    pub(crate) n_scene_calls: usize,
    pub(crate) max_rates_hz: Vec<f64>,
    pub(crate) asked_from: Vec<u64>,
    pub(crate) opened: Vec<DriveOpen>,
    pub(crate) samples: Vec<HandSample>,
    pub(crate) n_closed_lanes: usize,
}

#[derive(Clone)]
pub(crate) struct Fake {
    script: Arc<Mutex<Script>>,
    pub(crate) address: SocketAddr,
}

pub(crate) struct Running {
    pub(crate) fake: Fake,
    task: JoinHandle<()>,
}

impl Drop for Running {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Running {
    /// Starts on a free port.
    pub(crate) async fn start() -> Self {
        Self::start_on(TcpListener::bind("127.0.0.1:0").await.unwrap())
    }

    pub(crate) fn start_on(listener: TcpListener) -> Self {
        let status = GetStatusResponse {
            stamp: Some(stamp(1, 5)),
            version: "9.8.7".into(),
            protocol_major: tsukamu_proto::PROTOCOL_MAJOR,
            scene: "demo".into(),
            model: "paper".into(),
            mode: "realtime".into(),
            rate_hz: 240.0,
            uptime_s: 1000.0,
            ..GetStatusResponse::default()
        };
        let script = Script {
            status,
            scene_version: 1,
            oldest_event: 1,
            ..Script::default()
        };
        let fake = Fake {
            script: Arc::new(Mutex::new(script)),
            address: listener.local_addr().unwrap(),
        };
        let serving = Server::builder()
            .add_service(WorldServer::new(fake.clone()))
            .add_service(HandsServer::new(fake.clone()))
            .add_service(ClockServer::new(fake.clone()))
            .serve_with_incoming(TcpListenerStream::new(listener));
        let task = tokio::spawn(async move { serving.await.unwrap() });
        Self { fake, task }
    }

    pub(crate) fn script(&self) -> MutexGuard<'_, Script> {
        self.fake.script.lock().unwrap()
    }

    pub(crate) async fn client(&self) -> Client {
        Client::connect(options(self.fake.address)).await.unwrap()
    }
}

/// Patient enough for a loaded machine, quick enough for a test.
pub(crate) fn options(address: SocketAddr) -> ConnectOptions {
    ConnectOptions {
        address: format!("http://{address}"),
        timeout: Duration::from_secs(5),
        retry: RetryPolicy {
            attempts: 50,
            first_delay: Duration::from_millis(10),
            max_delay: Duration::from_millis(50),
        },
    }
}

pub(crate) fn stamp(epoch: u64, tick: u64) -> Stamp {
    Stamp {
        epoch,
        tick,
        world_time_s: tick as f64 / 240.0,
        wall_ns: 1_000_000 * tick,
    }
}

/// A frame in which each object is at (x, 0, 0).
pub(crate) fn frame(
    at: Stamp,
    keyframe_tick: u64,
    scene_version: u64,
    objects: &[(u64, f64)],
) -> Frame {
    Frame {
        stamp: Some(at),
        keyframe_tick,
        object_ids: objects.iter().map(|object| object.0).collect(),
        positions: objects
            .iter()
            .flat_map(|object| [object.1, 0.0, 0.0])
            .collect(),
        rotations: objects.iter().flat_map(|_| [0.0, 0.0, 0.0, 1.0]).collect(),
        states: objects.iter().map(|_| ContactState::Free as u8).collect(),
        holders: vec![0; objects.len()],
        scene_version,
        ..Frame::default()
    }
}

pub(crate) fn sent(frame: Frame) -> Result<WatchFramesResponse, Status> {
    Ok(WatchFramesResponse {
        kind: Some(Kind::Frame(frame)),
    })
}

pub(crate) fn skipped(count: u64) -> Result<WatchFramesResponse, Status> {
    let skipped = FramesSkipped {
        stamp: Some(stamp(1, 0)),
        count,
        total: count,
    };
    Ok(WatchFramesResponse {
        kind: Some(Kind::Skipped(skipped)),
    })
}

#[tonic::async_trait]
impl World for Fake {
    type WatchFramesStream = Out<WatchFramesResponse>;
    type WatchEventsStream = Out<Event>;

    async fn get_scene(
        &self,
        _: Request<GetSceneRequest>,
    ) -> Result<Response<GetSceneResponse>, Status> {
        let mut script = self.script.lock().unwrap();
        script.n_scene_calls += 1;
        let object = |id: u64| Object {
            id,
            name: format!("block {id}"),
            ..Object::default()
        };
        let scene = Scene {
            name: format!("scene {}", script.scene_version),
            objects: (1..=3).map(object).collect(),
            ..Scene::default()
        };
        Ok(Response::new(GetSceneResponse {
            stamp: script.status.stamp,
            scene: Some(scene),
            scene_version: script.scene_version,
        }))
    }

    async fn watch_frames(
        &self,
        request: Request<WatchFramesRequest>,
    ) -> Result<Response<Self::WatchFramesStream>, Status> {
        let mut script = self.script.lock().unwrap();
        script.max_rates_hz.push(request.into_inner().max_rate_hz);
        Ok(Response::new(match script.frames.pop_front() {
            Some(frames) => Box::pin(tokio_stream::iter(frames)),
            None => Box::pin(tokio_stream::pending()),
        }))
    }

    async fn watch_events(
        &self,
        request: Request<WatchEventsRequest>,
    ) -> Result<Response<Self::WatchEventsStream>, Status> {
        let mut script = self.script.lock().unwrap();
        let from = request.into_inner().from_sequence;
        script.asked_from.push(from);
        if from > 0 && from < script.oldest_event {
            return Err(Status::out_of_range(format!(
                "the oldest event held is {}",
                script.oldest_event
            )));
        }
        let events: Vec<_> = script
            .events
            .iter()
            .filter(|event| from > 0 && event.sequence >= from)
            .cloned()
            .map(Ok)
            .collect();
        let next = script.events.last().map_or(1, |event| event.sequence + 1);
        if from > next {
            return Err(Status::out_of_range(format!(
                "event {from} has not happened: the next one is {next}"
            )));
        }
        Ok(Response::new(match script.events_per_stream.pop_front() {
            Some(n) => Box::pin(tokio_stream::iter(events.into_iter().take(n))),
            None => Box::pin(tokio_stream::iter(events).chain(tokio_stream::pending())),
        }))
    }

    async fn get_status(
        &self,
        _: Request<GetStatusRequest>,
    ) -> Result<Response<GetStatusResponse>, Status> {
        Ok(Response::new(self.script.lock().unwrap().status.clone()))
    }
}

#[tonic::async_trait]
impl Hands for Fake {
    type DriveStream = Out<DriveResponse>;

    async fn drive(
        &self,
        request: Request<Streaming<DriveRequest>>,
    ) -> Result<Response<Self::DriveStream>, Status> {
        let (script, closing) = (Arc::clone(&self.script), Arc::clone(&self.script));
        let end = tokio_stream::once(()).filter_map(move |()| {
            closing.lock().unwrap().n_closed_lanes += 1;
            None
        });
        let answers = request.into_inner().filter_map(move |request| {
            let mut script = script.lock().unwrap();
            let kind = match request.ok()?.kind? {
                drive_request::Kind::Open(open) if open.name == "refused" => {
                    return Some(Err(Status::resource_exhausted(
                        "there are 16 hands already",
                    )));
                }
                drive_request::Kind::Open(open) => {
                    script.opened.push(open);
                    drive_response::Kind::Opened(DriveOpened { hand: 7 })
                }
                drive_request::Kind::Sample(_)
                    if script.opened.iter().any(|open| open.name == "closing") =>
                {
                    return Some(Err(Status::aborted("the scene was loaded anew")));
                }
                drive_request::Kind::Sample(sample) => {
                    let applied_source_ns = sample.source_ns;
                    script.samples.push(sample);
                    drive_response::Kind::State(DriveState {
                        applied_source_ns,
                        holds: 3,
                        ..DriveState::default()
                    })
                }
            };
            Some(Ok(DriveResponse {
                stamp: Some(stamp(1, 9)),
                kind: Some(kind),
            }))
        });
        Ok(Response::new(Box::pin(answers.chain(end))))
    }
}

#[tonic::async_trait]
impl Clock for Fake {
    async fn ping(&self, request: Request<PingRequest>) -> Result<Response<PingResponse>, Status> {
        let client_ns = request.into_inner().client_ns;
        let (received_ns, sent_ns) = (client_ns + 5_000_000_000, client_ns + 5_000_000_001);
        Ok(Response::new(PingResponse {
            stamp: Some(stamp(1, 5)),
            client_ns,
            received_ns,
            sent_ns,
        }))
    }
}
