//! The gRPC services: a few lines each.

/// Calibration of gloves and trackers.
pub mod calibration;
/// The daemon's clock.
pub mod clock;
/// Commands.
pub mod control;
/// Gloves, trackers and other sources.
pub mod devices;
/// Driving hands.
pub mod hands;
/// Recordings.
pub mod recordings;
/// Streams that are encoded once for all.
mod stream;
/// The world: scene, frames, events, status.
pub mod world;

use std::pin::Pin;
use std::sync::Arc;

use futures_core::Stream;
use tokio::sync::watch;
use tonic::Status;

use crate::broadcast::subscriber::FrameLane;
use crate::calibration::desk::CalibrationDesk;
use crate::clock::Clock;
use crate::event_log::EventLog;
use crate::input::sources::Sources;
use crate::metrics::Metrics;
use crate::recording_desk::RecordingDesk;
use crate::status::StatusBoard;
use crate::ticker::request::TickerHandle;

/// What the services share; cheap to clone.
#[derive(Clone, Debug)]
pub struct Backend {
    /// The tick thread.
    pub ticker: TickerHandle,
    /// The frame lane.
    pub frames: FrameLane,
    /// The event lane.
    pub events: EventLog,
    /// All sources.
    pub sources: Sources,
    /// Counters.
    pub metrics: Arc<Metrics>,
    /// The daemon at a glance.
    pub status: Arc<StatusBoard>,
    /// Recordings.
    pub recordings: Arc<RecordingDesk>,
    /// Calibration of devices.
    pub calibration: Arc<CalibrationDesk>,
    /// The time.
    pub clock: Clock,
    /// True when the daemon stops.
    pub stopping: watch::Receiver<bool>,
}

/// A stream of answers.
pub type Answers<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// Does work to its end, also when the client that asked for it goes away meanwhile: what has two sides would be left
/// with one of them done.
pub(crate) async fn to_its_end<T, F>(work: F) -> Result<T, Status>
where
    T: Send + 'static,
    F: Future<Output = T> + Send + 'static,
{
    tokio::spawn(work)
        .await
        .map_err(|failure| Status::internal(failure.to_string()))
}

/// Runs work that reads or writes files, away from the async threads.
pub(crate) async fn off_thread<T, F>(work: F) -> Result<T, Status>
where
    T: Send + 'static,
    F: FnOnce() -> T + Send + 'static,
{
    tokio::task::spawn_blocking(work)
        .await
        .map_err(|failure| Status::internal(failure.to_string()))
}
