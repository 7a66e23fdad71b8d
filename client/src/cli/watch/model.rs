use std::collections::VecDeque;

use tsukamu_client::clock_sync::{ClockEstimate, ClockSync, PingSample};
use tsukamu_client::event_watch::EventUpdate;
use tsukamu_client::subscribe::{FrameCounts, FrameUpdate, FrameWatch};
use tsukamu_client::timeline::Timeline;
use tsukamu_client::view::WorldView;
use tsukamu_proto::v1::{Event, GetStatusResponse, Scene};

use super::super::events::is_contact;
use super::super::scene_names::SceneNames;
use super::meter::Meter;
use super::picture::Fit;

/// Views that are kept: half a second at 60 Hz, for speeds.
const N_VIEWS: usize = 32;
/// World time over which a speed is taken, seconds.
const SPEED_WINDOW_S: f64 = 0.1;
/// Events that are kept.
const N_EVENTS: usize = 200;
/// Exchanges of times that are kept.
const N_EXCHANGES: usize = 32;

/// What is known about the daemon while it is watched.
pub(super) struct WatchModel {
    pub(super) address: String,
    pub(super) status: Option<GetStatusResponse>,
    pub(super) counts: FrameCounts,
    pub(super) meter: Meter,
    /// Why the connection is gone, while it is.
    pub(super) lost: Option<String>,
    pub(super) scene: Scene,
    pub(super) fit: Fit,
    names: SceneNames,
    timeline: Timeline,
    clock: ClockSync,
    events: VecDeque<Event>,
}

impl WatchModel {
    pub(super) fn new(address: &str) -> Self {
        Self {
            address: address.to_owned(),
            status: None,
            counts: FrameCounts::default(),
            meter: Meter::default(),
            lost: None,
            scene: Scene::default(),
            fit: Fit::default(),
            names: SceneNames::default(),
            timeline: Timeline::new(N_VIEWS),
            clock: ClockSync::new(N_EXCHANGES),
            events: VecDeque::new(),
        }
    }

    pub(super) fn take_frame(&mut self, update: &FrameUpdate, frames: &FrameWatch) {
        self.counts = frames.counts();
        match update {
            FrameUpdate::Frame {
                arrival_ns,
                new_scene,
            } => {
                if let (true, Some(scene)) = (new_scene, frames.scene()) {
                    self.take_scene(scene.clone());
                }
                if let Some(view) = frames.view() {
                    self.take_view(view.clone(), *arrival_ns);
                }
            }
            FrameUpdate::Lost(reason) => {
                self.lost = Some(reason.clone());
                self.timeline.clear();
                self.meter.clear();
                self.clock.clear();
            }
            FrameUpdate::Resumed => self.lost = None,
            FrameUpdate::Skipped(_) | FrameUpdate::Dropped(_) => {}
        }
    }

    pub(super) fn take_view(&mut self, view: WorldView, arrival_ns: u64) {
        let latency_ns = self
            .latency_s(arrival_ns, view.stamp.wall_ns)
            .map(|seconds| seconds * 1e9);
        self.meter.push(arrival_ns, latency_ns);
        self.timeline.push(view, arrival_ns);
    }

    pub(super) fn take_scene(&mut self, scene: Scene) {
        self.names = SceneNames::of(&scene);
        self.fit = Fit::of_scene(&scene);
        self.scene = scene;
    }

    pub(super) fn take_status(&mut self, status: GetStatusResponse) {
        self.status = Some(status);
    }

    pub(super) fn take_ping(&mut self, sample: PingSample) {
        // A sample that contradicts itself is of no use, and the next one comes in a second.
        let _ = self.clock.push(sample);
    }

    /// Keeps it, unless it is about a single contact: those would push all others off the screen.
    pub(super) fn take_event(&mut self, update: EventUpdate) {
        match update {
            EventUpdate::Event(event) if !is_contact(&event) => {
                if self.events.len() == N_EVENTS {
                    self.events.pop_front();
                }
                self.events.push_back(*event);
            }
            EventUpdate::Restarted => self.events.clear(),
            _ => {}
        }
    }

    pub(super) fn names(&self) -> &SceneNames {
        &self.names
    }

    pub(super) fn view(&self) -> Option<&WorldView> {
        self.timeline.newest()
    }

    pub(super) fn jitter_ns(&self) -> f64 {
        self.timeline.jitter_ns()
    }

    pub(super) fn clock(&self) -> Option<ClockEstimate> {
        self.clock.estimate()
    }

    /// The newest events, oldest first.
    pub(super) fn last_events(&self, n: usize) -> impl Iterator<Item = &Event> {
        self.events.iter().skip(self.events.len().saturating_sub(n))
    }

    /// From the step to the arrival of its frame, seconds; `None` before the clocks are compared.
    pub(super) fn latency_s(&self, arrival_ns: u64, wall_ns: u64) -> Option<f64> {
        let server_ns = self.clock.estimate()?.server_ns(arrival_ns);
        Some((i128::from(server_ns) - i128::from(wall_ns)) as f64 * 1e-9)
    }

    /// Mean speed of an object over the last tenth of a second of world time, m/s.
    pub(super) fn speed(&self, id: u64) -> Option<f64> {
        let (newest, earlier) = (
            self.timeline.newest()?,
            self.timeline.back_by(SPEED_WINDOW_S)?,
        );
        let span_s = newest.stamp.world_time_s - earlier.stamp.world_time_s;
        let (now, then) = (newest.objects.get(&id)?, earlier.objects.get(&id)?);
        let way = now.pose.translation.vector - then.pose.translation.vector;
        (span_s > 0.0).then(|| way.norm() / span_s)
    }
}
