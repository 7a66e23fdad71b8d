//! One subscriber's stream: newest wins, keyframe before its deltas, told what it missed.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use futures_core::Stream;
use tokio::sync::watch;
use tokio::time::Instant;
use tonic::Status;
use tsukamu_proto::v1;
use tsukamu_proto::v1::watch_frames_response::Kind;

use crate::metrics::Metrics;
use crate::wire_message::WireMessage;

use super::inbox::Inbox;
use super::publisher::Published;

/// Slowest rate a subscriber may ask for, frames per second: below it a stream looks dead.
const RATE_MIN_HZ: f64 = 0.1;

/// What streams are made of; cheap to clone.
#[derive(Clone, Debug)]
pub struct FrameLane {
    /// To ask the publisher for a frame.
    pub inbox: Arc<Inbox>,
    /// The newest frame.
    pub frames: watch::Receiver<Published>,
    /// Counts subscribers and what they get.
    pub metrics: Arc<Metrics>,
}

impl FrameLane {
    /// Frames from now on, at most `max_rate_hz` per second, 0 for all. The first is a keyframe.
    ///
    /// # Errors
    /// `INVALID_ARGUMENT` when the rate is negative, not a number, or too slow.
    pub fn watch(
        &self,
        max_rate_hz: f64,
    ) -> Result<impl Stream<Item = Result<WireMessage, Status>> + Send + use<>, Status> {
        let interval = match max_rate_hz {
            0.0 => None,
            rate if rate >= RATE_MIN_HZ => Some(Duration::from_secs_f64(1.0 / rate)),
            rate => {
                return Err(Status::invalid_argument(format!(
                    "max_rate_hz is {rate}: it must be 0 (every step) or at least {RATE_MIN_HZ} frames per second"
                )));
            }
        };
        self.metrics
            .frame_subscribers
            .fetch_add(1, Ordering::AcqRel);
        let subscriber = Subscriber {
            // In this order: what is published after the count went up is meant for us.
            holdings: Holdings::new(Arc::clone(&self.metrics), self.inbox.want_frame(), interval),
            frames: self.frames.clone(),
        };
        Ok(futures_util::stream::unfold(
            subscriber,
            |mut subscriber| async {
                let item = subscriber.next().await?;
                Some((Ok(item), subscriber))
            },
        ))
    }
}

/// Counts the subscriber out when its stream goes, in whatever way.
#[derive(Debug)]
struct Present(Arc<Metrics>);

impl Drop for Present {
    fn drop(&mut self) {
        self.0.frame_subscribers.fetch_sub(1, Ordering::AcqRel);
    }
}

#[derive(Debug)]
struct Subscriber {
    frames: watch::Receiver<Published>,
    holdings: Holdings,
}

/// What a subscriber has got, and what it gets next.
#[derive(Debug)]
struct Holdings {
    present: Present,
    first_serial: u64,
    /// Epoch and tick of the keyframe that was sent last.
    held: Option<(u64, u64)>,
    /// Epoch and tick of the frame that was sent last.
    shown: Option<(u64, u64)>,
    /// Number of the published frame that was taken last.
    count: Option<u64>,
    pace: Option<Pace>,
    n_skipped: u64,
    ready: VecDeque<WireMessage>,
}

/// A chosen rate.
#[derive(Debug)]
struct Pace {
    interval: Duration,
    /// When the next frame may be taken; `None` before the first.
    due: Option<Instant>,
}

/// How much earlier than its time a frame may be taken, as a share of the interval: when frames are made at the very
/// rate that was chosen, their jitter must not lose any.
const EARLY: f64 = 0.25;

/// How long after its time a frame is waited for that is made just then, as a share of the interval, before the
/// newest one that is there is taken: a frame made long before its time would be shown that much too late.
const FRESH: f64 = 0.25;

impl Pace {
    /// A frame was taken: moves on to the next one's time, and gives how many times were missed.
    fn advance(&mut self, now: Instant) -> u64 {
        let Some(due) = self.due else {
            self.due = Some(now + self.interval.mul_f64(1.0 - EARLY));
            return 0;
        };
        let late = now.saturating_duration_since(due);
        let n_missed = (late.as_secs_f64() / self.interval.as_secs_f64()) as u64;
        // A multiple of the interval, so that the rate does not drift.
        self.due = Some(due + self.interval.mul_f64(n_missed as f64 + 1.0));
        n_missed
    }
}

impl Subscriber {
    async fn next(&mut self) -> Option<WireMessage> {
        loop {
            if let Some(message) = self.holdings.next_ready() {
                return Some(message);
            }
            if let Some(pace) = &self.holdings.pace
                && let Some(due) = pace.due
            {
                let fresh = due + pace.interval.mul_f64(FRESH);
                tokio::time::sleep_until(due).await;
                self.frames.mark_unchanged();
                // A closed lane is noticed below.
                let _ = tokio::time::timeout_at(fresh, self.frames.changed()).await;
            }
            let has_news = self.holdings.take(&self.frames.borrow_and_update());
            if !has_news {
                self.frames.changed().await.ok()?;
            }
        }
    }
}

impl Holdings {
    fn new(metrics: Arc<Metrics>, first_serial: u64, interval: Option<Duration>) -> Self {
        Self {
            present: Present(metrics),
            first_serial,
            held: None,
            shown: None,
            count: None,
            pace: interval.map(|interval| Pace {
                interval,
                due: None,
            }),
            n_skipped: 0,
            ready: VecDeque::with_capacity(3),
        }
    }

    fn next_ready(&mut self) -> Option<WireMessage> {
        let message = self.ready.pop_front()?;
        let n_bytes = message.message_len() as u64;
        self.present.0.frame_bytes_sent.inc_by(n_bytes);
        Some(message)
    }

    /// Makes ready what this subscriber lacks; false when it lacks nothing.
    fn take(&mut self, newest: &Published) -> bool {
        let Some(key) = &newest.key else { return false };
        let key_is = (newest.epoch, key.tick);
        let newest_is = (
            newest.epoch,
            newest.delta.as_ref().map_or(key.tick, |delta| delta.tick),
        );
        let is_seen = self.shown == Some(newest_is) || newest.serial < self.first_serial;
        let n_between = self
            .count
            .map_or(0, |count| newest.count.saturating_sub(count + 1));
        self.count = Some(newest.count);
        if is_seen {
            return false;
        }
        let is_first = self.shown.is_none();
        let n_missed = match &mut self.pace {
            // Where frames are made more slowly than they are wanted, none was missed.
            Some(pace) => pace.advance(Instant::now()).min(n_between),
            None => n_between,
        };
        if n_missed > 0 && !is_first {
            self.note_skipped(n_missed, newest.stamp);
        }
        if self.held != Some(key_is) {
            self.ready.push_back(key.response.clone());
            self.held = Some(key_is);
        }
        self.ready
            .extend(newest.delta.as_ref().map(|delta| delta.response.clone()));
        self.shown = Some(newest_is);
        self.present.0.frames_sent.inc();
        true
    }

    fn note_skipped(&mut self, n_missed: u64, stamp: v1::Stamp) {
        self.n_skipped += n_missed;
        self.present.0.frames_skipped.inc_by(n_missed);
        let note = v1::FramesSkipped {
            stamp: Some(stamp),
            count: n_missed,
            total: self.n_skipped,
        };
        let response = v1::WatchFramesResponse {
            kind: Some(Kind::Skipped(note)),
        };
        self.ready.push_back(WireMessage::new(&response));
    }
}
