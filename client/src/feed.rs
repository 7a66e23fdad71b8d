use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::sync::broadcast;
use tokio::time::Instant;
use tokio_stream::wrappers::BroadcastStream;
use tokio_stream::wrappers::errors::BroadcastStreamRecvError;
use tokio_stream::{Stream, StreamExt};
use tonic::{Code, Streaming};
use tsukamu_motion::track::TrackHand;
use tsukamu_proto::v1::{
    DriveOpen, DriveRequest, DriveResponse, DriveState, HandModel, HandSample, OneEuro, Side,
    drive_request, drive_response,
};

use crate::clock::ClientClock;
use crate::connect::Client;
use crate::sample;
use crate::subscribe::{WatchError, refused};
use crate::view::Stamp;

/// Samples that may wait for the network. When it is full the oldest gives way: a hand is where it is now.
const QUEUE_CAPACITY: usize = 64;
/// A sample of a file that is later than this is left out, not made up for: a quarter of the usual grace time.
const LATEST: Duration = Duration::from_millis(60);
/// Longest wait for the daemon to open the lane.
const OPEN_TIMEOUT: Duration = Duration::from_secs(3);

/// The hand to drive.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedOptions {
    /// What people will see it called.
    pub name: String,
    /// Left or right.
    pub side: Side,
    /// The wearer's hand; `None` takes the default hand of that side.
    pub model: Option<HandModel>,
    /// A filter in the daemon; `None` is off.
    pub filter: Option<OneEuro>,
}

/// A hand that this client drives. Its two halves may go separate ways.
#[derive(Debug)]
pub struct HandFeed {
    /// Id of the hand in frames and events.
    pub hand: u32,
    /// Takes samples.
    pub samples: FeedSender,
    /// Gives the daemon's answers.
    pub answers: FeedAnswers,
}

/// Takes samples of one hand. When the last clone is dropped the lane closes, and the hand leaves the world.
#[derive(Clone, Debug)]
pub struct FeedSender {
    queue: broadcast::Sender<HandSample>,
    n_dropped: Arc<AtomicU64>,
}

/// The daemon's answers about one hand, at most one per step, newest wins.
#[derive(Debug)]
pub struct FeedAnswers {
    stream: Streaming<DriveResponse>,
}

/// How a driven hand stands.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedAnswer {
    /// When.
    pub stamp: Stamp,
    /// What it touches and holds, and which sample was applied last.
    pub state: DriveState,
}

/// How far a track has been played.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlayProgress {
    /// Rounds done.
    pub n_rounds: u64,
    /// Seconds into this round.
    pub into_s: f64,
    /// Samples sent.
    pub n_sent: u64,
    /// Samples left out because this machine was too late for them.
    pub n_skipped: u64,
}

impl HandFeed {
    /// Opens a lane for one hand.
    ///
    /// # Errors
    /// When the daemon refuses the hand, is gone, or gives no answer in time.
    pub async fn open(client: &Client, options: FeedOptions) -> Result<Self, WatchError> {
        let (queue, receiver) = broadcast::channel(QUEUE_CAPACITY);
        let n_dropped = Arc::new(AtomicU64::new(0));
        let requests = requests(options, receiver, Arc::clone(&n_dropped));
        let opening = async {
            let stream = client
                .hands()
                .drive(requests)
                .await
                .map_err(|status| refused(&status))?
                .into_inner();
            let mut answers = FeedAnswers { stream };
            let hand = answers.opened().await?;
            Ok::<_, WatchError>((hand, answers))
        };
        let (hand, answers) =
            tokio::time::timeout(OPEN_TIMEOUT, opening)
                .await
                .map_err(|_elapsed| WatchError::Refused {
                    code: Code::DeadlineExceeded,
                    message: "it gave no answer about the hand".into(),
                })??;
        Ok(Self {
            hand,
            samples: FeedSender { queue, n_dropped },
            answers,
        })
    }
}

impl FeedSender {
    /// Sends one sample. Never waits: a full queue loses its oldest sample.
    ///
    /// False when the lane is closed.
    pub fn push(&self, sample: HandSample) -> bool {
        self.queue.send(sample).is_ok()
    }

    /// Whether the lane still takes samples.
    pub fn is_open(&self) -> bool {
        self.queue.receiver_count() > 0
    }

    /// Samples that gave way to newer ones because the network was slow.
    pub fn n_dropped(&self) -> u64 {
        self.n_dropped.load(Ordering::Relaxed)
    }
}

impl FeedAnswers {
    /// The next answer; `None` when the daemon has closed the lane.
    ///
    /// # Errors
    /// When the connection broke or the daemon refuses to go on.
    pub async fn next(&mut self) -> Result<Option<FeedAnswer>, WatchError> {
        while let Some(message) = self
            .stream
            .message()
            .await
            .map_err(|status| refused(&status))?
        {
            let stamp = message.stamp.as_ref().map(Stamp::from).unwrap_or_default();
            if let Some(drive_response::Kind::State(state)) = message.kind {
                return Ok(Some(FeedAnswer { stamp, state }));
            }
        }
        Ok(None)
    }

    async fn opened(&mut self) -> Result<u32, WatchError> {
        while let Some(message) = self
            .stream
            .message()
            .await
            .map_err(|status| refused(&status))?
        {
            if let Some(drive_response::Kind::Opened(opened)) = message.kind {
                return Ok(opened.hand);
            }
        }
        Err(WatchError::Refused {
            code: Code::Aborted,
            message: "it closed the lane of the hand at once".into(),
        })
    }
}

fn requests(
    options: FeedOptions,
    receiver: broadcast::Receiver<HandSample>,
    n_dropped: Arc<AtomicU64>,
) -> impl Stream<Item = DriveRequest> {
    let open = DriveOpen {
        name: options.name,
        side: options.side.into(),
        model: options.model,
        filter: options.filter,
    };
    let samples = BroadcastStream::new(receiver).filter_map(move |received| match received {
        Ok(sample) => Some(drive_request::Kind::Sample(sample)),
        Err(BroadcastStreamRecvError::Lagged(n)) => {
            n_dropped.fetch_add(n, Ordering::Relaxed);
            None
        }
    });
    tokio_stream::once(drive_request::Kind::Open(open))
        .chain(samples)
        .map(|kind| DriveRequest { kind: Some(kind) })
}

/// Plays the motion of one hand at its own times, against absolute deadlines, until its end or until the lane closes.
/// With `repeat` it begins again and again. Between two samples further apart than the daemon's grace time the
/// hand is lost there, as it was in the file.
pub async fn play(
    hand: &TrackHand,
    repeat: bool,
    samples: &FeedSender,
    clock: ClientClock,
    progress: &mut (dyn FnMut(PlayProgress) + Send),
) -> PlayProgress {
    let mut played = PlayProgress::default();
    let (Some(first_s), Some(last_s)) = (hand.times_s.first(), hand.times_s.last()) else {
        return played;
    };
    // The way back to the start takes as long as the average step.
    let round_s = (last_s - first_s) * (1.0 + 1.0 / (hand.times_s.len().max(2) - 1) as f64);
    let start = Instant::now();
    loop {
        for (time_s, hand_sample) in hand.times_s.iter().zip(&hand.samples) {
            played.into_s = time_s - first_s;
            let due =
                start + Duration::from_secs_f64(played.n_rounds as f64 * round_s + played.into_s);
            tokio::time::sleep_until(due).await;
            if due.elapsed() > LATEST {
                played.n_skipped += 1;
                continue;
            }
            if !samples.push(sample::to_wire(hand_sample, clock.now_ns())) {
                return played;
            }
            played.n_sent += 1;
            progress(played);
        }
        played.n_rounds += 1;
        if !repeat || round_s <= 0.0 {
            return played;
        }
    }
}
