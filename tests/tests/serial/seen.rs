//! What a client sees. Every wait is for a value and has a deadline.

use std::future::Future;
use std::time::Duration;

use nalgebra::{Isometry3, Vector3};
use tsukamu_client::connect::{Client, ConnectOptions};
use tsukamu_client::event_watch::{EventUpdate, EventWatch};
use tsukamu_client::subscribe::{FrameOptions, FrameUpdate, FrameWatch};
use tsukamu_client::view::WorldView;
use tsukamu_proto::v1;
use tsukamu_proto::v1::event::Kind;
use tsukamu_server::daemon::Daemon;

/// Longest that a test waits for anything: far beyond what it takes on a loaded machine.
const DEADLINE: Duration = Duration::from_secs(30);

/// A client of the daemon.
pub(crate) struct Seen {
    client: Client,
    events: EventWatch,
    /// Events of the present wait, for the message when it is in vain.
    log: Vec<String>,
}

/// The value of a future that comes within the deadline.
pub(crate) async fn soon<T>(what: &str, future: impl Future<Output = T>) -> T {
    match tokio::time::timeout(DEADLINE, future).await {
        Ok(value) => value,
        Err(_) => panic!("{what}: not within {DEADLINE:?}"),
    }
}

impl Seen {
    pub(crate) async fn connect(daemon: &Daemon) -> Self {
        let address = format!("http://{}", daemon.local_addr());
        let client = Client::connect(ConnectOptions {
            address,
            ..ConnectOptions::default()
        });
        let client = soon("connecting", client).await.unwrap();
        let events = EventWatch::open(&client, 1).await.unwrap();
        Self {
            client,
            events,
            log: Vec::new(),
        }
    }

    /// Waits for the next event of that kind.
    pub(crate) async fn event(&mut self, wanted: impl Fn(&Kind) -> bool) {
        self.log.clear();
        let found = tokio::time::timeout(DEADLINE, async {
            loop {
                let kind = self.next_kind().await;
                if wanted(&kind) {
                    return;
                }
                self.log.push(format!("{kind:?}"));
            }
        });
        let is_found = found.await.is_ok();
        assert!(
            is_found,
            "the event did not come; these did:\n{}",
            self.log.join("\n")
        );
    }

    async fn next_kind(&mut self) -> Kind {
        match self.events.next().await.unwrap() {
            EventUpdate::Event(event) => event.kind.expect("every event has a kind"),
            other => panic!("the event lane: {other:?}"),
        }
    }

    /// Waits until both devices are in that state.
    pub(crate) async fn devices_become(&self, state: &str) {
        let mut devices = self.client.devices();
        let stream = devices
            .watch_devices(v1::WatchDevicesRequest {})
            .await
            .unwrap();
        let mut stream = stream.into_inner();
        soon(state, async {
            loop {
                let list = stream
                    .message()
                    .await
                    .unwrap()
                    .expect("the stream goes on")
                    .devices;
                let mut ports = list.iter().filter(|device| device.kind != "hand");
                if ports.all(|device| device.state == state) {
                    return;
                }
            }
        })
        .await;
        let list = devices
            .list_devices(v1::ListDevicesRequest {})
            .await
            .unwrap()
            .into_inner()
            .devices;
        let ports: Vec<&v1::Device> = list.iter().filter(|device| device.kind != "hand").collect();
        assert_eq!(ports.len(), 2);
        for port in ports {
            assert_eq!(port.state, state, "{port:?}");
            assert_eq!(port.error.is_empty(), state == "running", "{port:?}");
        }
    }

    /// Waits for a frame that the question finds an answer in.
    async fn frame<T>(&self, what: &str, mut ask: impl FnMut(&WorldView) -> Option<T>) -> T {
        let mut frames = FrameWatch::open(&self.client, FrameOptions::default())
            .await
            .unwrap();
        soon(what, async {
            loop {
                match frames.next().await.unwrap() {
                    FrameUpdate::Frame { .. } | FrameUpdate::Skipped(_) => {}
                    other => panic!("the frame lane: {other:?}"),
                }
                if let Some(answer) = frames.view().and_then(&mut ask) {
                    return answer;
                }
            }
        })
        .await
    }

    /// `world_from_wrist` of the hand.
    pub(crate) async fn wrist(&self) -> Isometry3<f64> {
        self.frame("a hand", |view| {
            let hand = view.hands.first()?;
            let is_fresh = hand.tracking == v1::Tracking::Tracked;
            is_fresh.then_some(hand.wrist)
        })
        .await
    }

    /// Waits until the hand has carried the first object so far, in metres, from where the scene puts it.
    pub(crate) async fn carried(&self, way_m: f64) {
        let mut world = self.client.world();
        let scene = world
            .get_scene(v1::GetSceneRequest {})
            .await
            .unwrap()
            .into_inner()
            .scene;
        let object = scene
            .expect("a scene")
            .objects
            .first()
            .expect("an object")
            .clone();
        let start = Vector3::new(0.0, 0.025, -0.30);
        self.frame("carrying", |view| {
            let hand = view.hands.first()?;
            let now = view.objects.get(&object.id)?;
            let way = (now.pose.translation.vector - start).norm();
            (hand.holds == Some(object.id) && now.holder == Some(hand.id) && way > way_m)
                .then_some(())
        })
        .await;
    }

    /// Everything back to the start of the scene.
    pub(crate) async fn reset(&self) {
        soon("reset", self.client.control().reset(v1::ResetRequest {}))
            .await
            .unwrap();
    }

    /// Begins to record, in a new epoch.
    pub(crate) async fn record(&self, name: &str) {
        let name = name.to_owned();
        let request = v1::StartRecordingRequest {
            name,
            frames: false,
            raw: true,
        };
        soon(
            "recording",
            self.client.recordings().start_recording(request),
        )
        .await
        .unwrap();
    }

    /// Finishes the recording; nothing was dropped.
    pub(crate) async fn stop_recording(&self) {
        let mut recordings = self.client.recordings();
        let stopped = recordings.stop_recording(v1::StopRecordingRequest {});
        let stopped = soon("the end of the recording", stopped)
            .await
            .unwrap()
            .into_inner();
        assert!(stopped.messages > 0 && stopped.dropped == 0, "{stopped:?}");
    }
}
