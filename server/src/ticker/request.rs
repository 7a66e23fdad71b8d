//! What others ask of the tick thread: one closed set, through one bounded channel.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use thiserror::Error;
use tokio::sync::{oneshot, watch};
use tsukamu_proto::v1;
use tsukamu_world::World;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::Command;
use tsukamu_world::scene::ObjectSpec;
use tsukamu_world::state::{HandId, ObjectId};

use crate::input::fusion::FusionSettings;
use crate::input::intake::DriveNow;
use crate::input::one_euro::OneEuro;
use crate::input::sources::Source;
use crate::offline::hands::RunHand;
use crate::recorder_handle::RecorderHandle;

/// Requests that wait, at most; further ones are refused.
const CAPACITY: usize = 1024;

/// Where an answer goes.
pub type Reply<T> = oneshot::Sender<Result<T, Refusal>>;

/// Everything that can wake the tick thread besides the time.
#[derive(Debug)]
pub enum Request {
    /// In lockstep: steps to do.
    Step {
        /// How many.
        n: u32,
        /// When they are done.
        reply: Reply<Stepped>,
    },
    /// Stops the clock.
    Pause(Reply<v1::Stamp>),
    /// Lets it run again.
    Resume(Reply<v1::Stamp>),
    /// A command for the next step.
    Command {
        /// Which one.
        command: Command,
        /// When it was carried out; at once while the world stands still.
        reply: Reply<v1::Stamp>,
    },
    /// An object for the next step.
    AddObject {
        /// The object.
        spec: Box<ObjectSpec>,
        /// Its id, when it is in the world; at once while the world stands still.
        reply: Reply<(v1::Stamp, ObjectId)>,
    },
    /// A new epoch.
    Load {
        /// What it begins with.
        plan: Box<Plan>,
        /// When it has begun.
        reply: Reply<v1::Stamp>,
    },
    /// A hand joins.
    OpenHand {
        /// The hand.
        hand: Box<NewHand>,
        /// Its id.
        reply: Reply<HandId>,
    },
    /// Everything from now on is recorded.
    Record {
        /// Where it goes.
        recorder: RecorderHandle,
        /// The recording's name.
        name: String,
        /// What it begins with.
        beginning: Beginning,
        /// When it has begun.
        reply: Reply<v1::Stamp>,
    },
    /// The recording ends.
    StopRecording(Reply<v1::Stamp>),
    /// Nothing: a thread that waits is to show that it lives.
    Pulse,
    /// The thread ends.
    Stop,
}

/// What a new epoch begins with.
#[derive(Debug)]
pub struct Plan {
    /// The world at its start.
    pub world: Box<World>,
    /// The same for a recording; its epoch is filled in.
    pub record: v1::SceneRecord,
    /// Hands whose motion is known; their ids are given anew.
    pub hands: Vec<RunHand>,
    /// Whether scene and hands begin again when these hands are through.
    pub repeats: bool,
    /// What to play instead of the inputs of any source.
    pub playback: Option<Receiver<Played>>,
}

/// What a recording begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beginning {
    /// The world as it stands; nobody notices.
    AsItStands,
    /// A new epoch of the same scene: objects go back to their start, and those added while running are gone.
    NewEpoch,
}

/// One thing of a recording that is played.
#[derive(Debug)]
pub enum Played {
    /// What enters the world in the next step.
    Input(v1::StepInput),
    /// A new epoch, and its record.
    Epoch(Box<World>, Box<v1::SceneRecord>),
}

/// A hand that joins.
#[derive(Debug)]
pub struct NewHand {
    /// Its shape.
    pub model: HandModel,
    /// Its lane.
    pub source: std::sync::Arc<Source>,
    /// Filter of whole samples; those of devices have one for each stream.
    pub filter: Option<OneEuro>,
    /// Who drives it.
    pub driver: NewDriver,
}

/// Who drives a hand that joins.
#[derive(Debug)]
pub enum NewDriver {
    /// A client; answers go back to it.
    Remote(watch::Sender<DriveNow>),
    /// A glove and a tracker.
    Device(FusionSettings),
}

/// Steps were done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepped {
    /// After the last one.
    pub stamp: v1::Stamp,
    /// The world's digest then.
    pub digest: u64,
}

/// Why a request is refused.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Refusal {
    /// The daemon stops.
    #[error("the daemon is stopping")]
    Stopping,
    /// Too many requests wait.
    #[error("too many requests are waiting; try again")]
    Busy,
    /// A step was asked for in real time.
    #[error("the daemon runs in real time: Step is for lockstep (mode = \"lockstep\")")]
    NotLockstep,
    /// Pause or resume was asked for in lockstep.
    #[error("the daemon runs in lockstep: it has no clock to stop")]
    NotRealtime,
    /// A number of steps out of bounds.
    #[error("{0} steps: it must be from 1 to {STEPS_MAX}")]
    Steps(u32),
    /// A recording is being played.
    #[error("a recording is being played: load a scene first")]
    Playing,
    /// No object of that id.
    #[error("there is no object of id {0}")]
    NoObject(u64),
    /// An object that cannot be added.
    #[error("the object cannot be added: {0}")]
    Object(String),
    /// No further hand may join.
    #[error("there are {HANDS_MAX} hands already: no further one may join")]
    TooManyHands,
    /// A new epoch began before the command was carried out.
    #[error("a new epoch began before the command was carried out")]
    NewEpoch,
    /// A recording is under way.
    #[error("{0:?} is being recorded: stop it first")]
    Recording(String),
    /// No recording is under way.
    #[error("nothing is being recorded")]
    NotRecording,
}

/// Most hands that sources drive at a time.
pub const HANDS_MAX: usize = 256;
/// Most steps of one request.
pub const STEPS_MAX: u32 = 1_000_000;

/// The askers' end; cheap to clone.
#[derive(Clone, Debug)]
pub struct TickerHandle {
    requests: SyncSender<Request>,
}

impl TickerHandle {
    /// A handle and the tick thread's end.
    pub fn channel() -> (Self, Receiver<Request>) {
        let (requests, receiver) = sync_channel(CAPACITY);
        (Self { requests }, receiver)
    }

    /// Asks and waits for the answer. `make` puts the reply into the request.
    ///
    /// # Errors
    /// What the tick thread answers, or that it is busy or gone.
    pub async fn ask<T>(&self, make: impl FnOnce(Reply<T>) -> Request) -> Result<T, Refusal> {
        let (reply, answer) = oneshot::channel();
        self.send(make(reply))?;
        answer.await.unwrap_or(Err(Refusal::Stopping))
    }

    /// Sends a request without waiting.
    ///
    /// # Errors
    /// When the tick thread is busy or gone.
    pub fn send(&self, request: Request) -> Result<(), Refusal> {
        self.requests
            .try_send(request)
            .map_err(|failure| match failure {
                TrySendError::Full(_) => Refusal::Busy,
                TrySendError::Disconnected(_) => Refusal::Stopping,
            })
    }

    /// Tells the tick thread to end, waiting for a place in the channel. Not for async code.
    pub fn stop(&self) {
        // It may have ended already.
        let _ = self.requests.send(Request::Stop);
    }
}
