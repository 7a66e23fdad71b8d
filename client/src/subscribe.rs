use thiserror::Error;
use tokio::time::Instant;
use tonic::{Code, Status, Streaming};
use tsukamu_proto::v1::watch_frames_response::Kind;
use tsukamu_proto::v1::{Frame, GetSceneRequest, Scene, WatchFramesRequest, WatchFramesResponse};

use crate::connect::Client;
use crate::connect_error::ConnectError;
use crate::retry::RetryPolicy;
use crate::view::{FrameFault, FrameFold, WorldView};

/// Which frames are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameOptions {
    /// Most frames per second; 0 is every step.
    pub max_rate_hz: f64,
}

/// What happened on the frame lane.
#[derive(Clone, Debug, PartialEq)]
pub enum FrameUpdate {
    /// A frame was applied: see [`FrameWatch::view`].
    Frame {
        /// When it arrived, by the client's clock, nanoseconds.
        arrival_ns: u64,
        /// Whether the scene was fetched anew before it: see [`FrameWatch::scene`].
        new_scene: bool,
    },
    /// This subscriber was slow: so many frames were skipped since the last one.
    Skipped(u64),
    /// A frame could not be applied and was dropped; the next keyframe mends it.
    Dropped(FrameFault),
    /// The stream broke, for this reason. The next call tries to open it again.
    Lost(String),
    /// The stream is open again; the next update is a whole frame, maybe of another daemon.
    Resumed,
}

/// Counts of a watch since it began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Frames applied.
    pub applied: u64,
    /// Frames that the daemon skipped for us because we were slow.
    pub skipped: u64,
    /// Frames that could not be applied.
    pub dropped: u64,
    /// Times the stream broke.
    pub lost: u64,
}

/// Why a watch ended for good.
#[derive(Clone, Debug, Error)]
pub enum WatchError {
    /// The daemon could not be reached again, or is another one now.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// The daemon refused the request.
    #[error("the daemon refuses: {}", if message.is_empty() { code.description() } else { message })]
    Refused {
        /// What kind of refusal.
        code: Code,
        /// The daemon's words.
        message: String,
    },
}

/// Watches frames: keeps a view of the world, fetches the scene whenever it changed, reconnects.
#[derive(Debug)]
pub struct FrameWatch {
    client: Client,
    options: FrameOptions,
    stream: Option<Streaming<WatchFramesResponse>>,
    fold: FrameFold,
    scene: Option<HeldScene>,
    /// A frame whose scene is not fetched yet, with its arrival.
    waiting: Option<(Box<Frame>, u64)>,
    counts: FrameCounts,
    again: Again,
}

#[derive(Debug)]
struct HeldScene {
    epoch: u64,
    version: u64,
    scene: Scene,
}

impl FrameWatch {
    /// Opens the stream.
    ///
    /// # Errors
    /// When the daemon refuses or is gone.
    pub async fn open(client: &Client, options: FrameOptions) -> Result<Self, WatchError> {
        let stream = open_stream(client, options)
            .await
            .map_err(|status| refused(&status))?;
        Ok(Self {
            client: client.clone(),
            options,
            stream: Some(stream),
            fold: FrameFold::default(),
            scene: None,
            waiting: None,
            counts: FrameCounts::default(),
            again: Again::default(),
        })
    }

    /// The world as the newest frame shows it; `None` before the first, and after the stream broke.
    pub fn view(&self) -> Option<&WorldView> {
        self.fold.view()
    }

    /// The scene that belongs to the view.
    pub fn scene(&self) -> Option<&Scene> {
        self.scene.as_ref().map(|held| &held.scene)
    }

    /// Counts since the watch began.
    pub fn counts(&self) -> FrameCounts {
        self.counts
    }

    /// Waits for what happens next. May be dropped while it waits: nothing is lost.
    ///
    /// # Errors
    /// When the stream broke and could not be opened again, or the daemon refuses it.
    pub async fn next(&mut self) -> Result<FrameUpdate, WatchError> {
        if self.stream.is_none() {
            return self.reopen().await;
        }
        if self.waiting.is_none() {
            let message = match self.stream.as_mut() {
                Some(stream) => stream.message().await,
                None => Ok(None),
            };
            match message {
                Ok(Some(message)) => match message.kind {
                    Some(Kind::Frame(frame)) => {
                        self.waiting = Some((Box::new(frame), self.client.clock().now_ns()))
                    }
                    Some(Kind::Skipped(skipped)) => {
                        self.counts.skipped += skipped.count;
                        return Ok(FrameUpdate::Skipped(skipped.count));
                    }
                    // Something a newer daemon says.
                    None => return Ok(FrameUpdate::Skipped(0)),
                },
                Ok(None) => return Ok(self.lose("the daemon ended the stream".into())),
                Err(status) if is_passing(&status) => return Ok(self.lose(status.message().into())),
                Err(status) => return Err(refused(&status)),
            }
        }
        self.take_waiting().await
    }

    /// Applies the frame that waits, after its scene.
    async fn take_waiting(&mut self) -> Result<FrameUpdate, WatchError> {
        let new_scene = match self.fetch_scene_if_changed().await {
            Ok(new_scene) => new_scene,
            Err(status) if is_passing(&status) => return Ok(self.lose(status.message().into())),
            Err(status) => return Err(refused(&status)),
        };
        let Some((frame, arrival_ns)) = self.waiting.take() else {
            return Ok(FrameUpdate::Skipped(0));
        };
        match self.fold.apply(&frame) {
            Ok(_) => {
                self.counts.applied += 1;
                Ok(FrameUpdate::Frame {
                    arrival_ns,
                    new_scene,
                })
            }
            Err(fault) => {
                self.counts.dropped += 1;
                Ok(FrameUpdate::Dropped(fault))
            }
        }
    }

    async fn fetch_scene_if_changed(&mut self) -> Result<bool, Status> {
        let Some((frame, _)) = &self.waiting else {
            return Ok(false);
        };
        let epoch = frame.stamp.as_ref().map_or(0, |stamp| stamp.epoch);
        let is_current = self
            .scene
            .as_ref()
            .is_some_and(|held| held.epoch == epoch && held.version == frame.scene_version);
        if is_current {
            return Ok(false);
        }
        let answer = self
            .client
            .world()
            .get_scene(GetSceneRequest {})
            .await?
            .into_inner();
        // The answer may be newer than the frame. It is held under the frame's own mark, so that one frame asks once:
        // a scene that changed again announces itself with the next frame.
        let (epoch, version) = (epoch, frame.scene_version);
        self.scene = Some(HeldScene {
            epoch,
            version,
            scene: answer.scene.unwrap_or_default(),
        });
        Ok(true)
    }

    fn lose(&mut self, reason: String) -> FrameUpdate {
        self.stream = None;
        self.waiting = None;
        self.fold = FrameFold::default();
        self.scene = None;
        self.counts.lost += 1;
        FrameUpdate::Lost(reason)
    }

    /// Attempts to open the stream again, with the waits of the retry policy in between.
    async fn reopen(&mut self) -> Result<FrameUpdate, WatchError> {
        loop {
            self.again.wait().await;
            match self.client.status().await {
                Ok(_) => {}
                Err(error) if error.is_passing() && self.again.fail(self.client.retry()) => {
                    continue;
                }
                Err(error) => return Err(error.into()),
            }
            match open_stream(&self.client, self.options).await {
                Ok(stream) => {
                    self.stream = Some(stream);
                    self.again = Again::default();
                    return Ok(FrameUpdate::Resumed);
                }
                Err(status) if is_passing(&status) && self.again.fail(self.client.retry()) => {}
                Err(status) => return Err(refused(&status)),
            }
        }
    }
}

/// Where a stream stands in trying again. Kept outside the futures, so that a dropped one forgets nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Again {
    n_failed: u32,
    not_before: Option<Instant>,
}

impl Again {
    /// Until the next attempt is due.
    pub(crate) async fn wait(&self) {
        if let Some(not_before) = self.not_before {
            tokio::time::sleep_until(not_before).await;
        }
    }

    /// Notes a failed attempt; false when it was the last.
    pub(crate) fn fail(&mut self, retry: RetryPolicy) -> bool {
        self.n_failed += 1;
        let delay = retry.delay_after(self.n_failed);
        self.not_before = delay.map(|delay| Instant::now() + delay);
        delay.is_some()
    }
}

async fn open_stream(
    client: &Client,
    options: FrameOptions,
) -> Result<Streaming<WatchFramesResponse>, Status> {
    let request = WatchFramesRequest {
        max_rate_hz: options.max_rate_hz,
    };
    Ok(client.world().watch_frames(request).await?.into_inner())
}

/// Whether a stream that ended with this status may be opened again.
pub(crate) fn is_passing(status: &Status) -> bool {
    use std::error::Error;
    matches!(
        status.code(),
        Code::Unavailable | Code::Cancelled | Code::Aborted
    ) || (matches!(status.code(), Code::Unknown | Code::Internal) && status.source().is_some())
}

pub(crate) fn refused(status: &Status) -> WatchError {
    WatchError::Refused {
        code: status.code(),
        message: status.message().into(),
    }
}
