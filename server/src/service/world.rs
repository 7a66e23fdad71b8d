//! The world: scene, frames, events, status.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use axum::body::Body;
use axum::http;
use futures_util::StreamExt;
use tonic::{Request, Response, Status};
use tsukamu_proto::unary::world_server::World;
use tsukamu_proto::{PROTOCOL_MAJOR, PROTOCOL_MINOR, v1};

use crate::convert::scene::scene_now;
use crate::metrics::Metrics;

use super::stream::answer;
use super::{Backend, off_thread};

/// The service.
#[derive(Clone, Debug)]
pub struct WorldService(pub Backend);

/// Counts an event subscriber out when its stream goes.
#[derive(Debug)]
struct Present(Arc<Metrics>);

impl Drop for Present {
    fn drop(&mut self) {
        self.0.event_subscribers.fetch_sub(1, Ordering::AcqRel);
    }
}

#[tonic::async_trait]
impl World for WorldService {
    async fn get_scene(
        &self,
        _: Request<v1::GetSceneRequest>,
    ) -> Result<Response<v1::GetSceneResponse>, Status> {
        let busy = || {
            Status::resource_exhausted(
                "too many ask for the scene, or the daemon is stopping; try again",
            )
        };
        let now = self.0.frames.inbox.scene().await.ok_or_else(busy)?;
        off_thread(move || Response::new(scene_now(&now))).await
    }

    async fn get_status(
        &self,
        _: Request<v1::GetStatusRequest>,
    ) -> Result<Response<v1::GetStatusResponse>, Status> {
        Ok(Response::new(self.0.status_now()))
    }
}

impl Backend {
    /// Answers `WatchFrames`.
    pub(crate) async fn watch_frames(self, request: http::Request<Body>) -> http::Response<Body> {
        answer(request, |wanted: v1::WatchFramesRequest| {
            self.frames.watch(wanted.max_rate_hz)
        })
        .await
    }

    /// Answers `WatchEvents`.
    pub(crate) async fn watch_events(self, request: http::Request<Body>) -> http::Response<Body> {
        answer(request, |wanted: v1::WatchEventsRequest| {
            let events = self.events.watch(wanted.from_sequence)?;
            self.metrics
                .event_subscribers
                .fetch_add(1, Ordering::AcqRel);
            let present = Present(self.metrics);
            Ok(events.map(move |event| {
                let _ = &present;
                event
            }))
        })
        .await
    }

    /// The daemon at a glance, as a message.
    pub fn status_now(&self) -> v1::GetStatusResponse {
        let (status, metrics) = (self.status.now(), &self.metrics);
        v1::GetStatusResponse {
            stamp: Some(status.stamp),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            protocol_major: PROTOCOL_MAJOR,
            protocol_minor: PROTOCOL_MINOR,
            scene: status.scene,
            model: status.model.to_owned(),
            mode: status.mode.to_owned(),
            paused: status.is_paused,
            rate_hz: status.rate_hz,
            measured_rate_hz: status.measured_rate_hz,
            overruns: metrics.overruns.get(),
            step_time_p50_s: metrics.step_times.quantile_s(0.5),
            step_time_p99_s: metrics.step_times.quantile_s(0.99),
            n_objects: status.n_objects,
            n_hands: status.n_hands,
            n_frame_subscribers: metrics.frame_subscribers.load(Ordering::Relaxed) as u32,
            n_event_subscribers: metrics.event_subscribers.load(Ordering::Relaxed) as u32,
            recording: status.recording,
            uptime_s: self.clock.monotonic_ns() as f64 * 1.0e-9,
        }
    }
}
