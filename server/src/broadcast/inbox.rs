//! What the tick hands over to the publisher: a box that is merged into when it was not emptied in time.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use nalgebra::Isometry3;
use tokio::sync::oneshot;
use tsukamu_proto::v1;
use tsukamu_world::frame::{Event, HandFrame};
use tsukamu_world::hand::joint::N_FINGERS;
use tsukamu_world::scene::{ObjectSpec, Target};
use tsukamu_world::state::ObjectId;

use crate::convert::frame::ObjectNow;
use crate::convert::scene::NamedHand;
use crate::recorder_handle::RecorderHandle;

/// Requests for the scene that wait, at most; further ones are refused.
const SCENE_REQUESTS_MAX: usize = 64;
/// Changes that wait, as a multiple of the number of objects, before they are merged.
const CHANGES_PER_OBJECT: usize = 2;

/// What is in the world and changes seldom.
#[derive(Debug)]
pub struct Content {
    /// Session epoch.
    pub epoch: u64,
    /// Counts changes of content over the daemon's life.
    pub version: u64,
    /// The scene without its objects and hands.
    pub surroundings: v1::Scene,
    /// The scene's grasp angle, radians.
    pub grasp_angle: f64,
    /// Targets of the scene.
    pub targets: Vec<Target>,
    /// Objects by id, ascending.
    pub objects: Vec<(ObjectId, Arc<ObjectSpec>)>,
    /// Hands by id, ascending.
    pub hands: Vec<NamedHand>,
}

/// What a tick shows besides its objects.
#[derive(Debug)]
pub struct Head {
    /// When.
    pub stamp: v1::Stamp,
    /// The hands.
    pub hands: Vec<HandNow>,
}

/// A hand as a tick shows it.
#[derive(Clone, Debug)]
pub struct HandNow {
    /// Where it is.
    pub frame: HandFrame,
    /// Age of the sample that stands, seconds.
    pub sample_age_s: f32,
    /// Whether each finger touches anything.
    pub touching: [bool; N_FINGERS],
}

/// An event with what is needed to say it in words.
#[derive(Debug)]
pub struct EventEntry {
    /// When.
    pub stamp: v1::Stamp,
    /// What happened.
    pub what: What,
    /// The object it happened to, where the world still has it.
    pub object: Option<Arc<ObjectSpec>>,
    /// The world's content then; `None` for what is not of the world.
    pub content: Option<Arc<Content>>,
}

/// What happened.
#[derive(Debug)]
pub enum What {
    /// Something in the world.
    World(Event),
    /// A new epoch began.
    SceneLoaded,
    /// A device went or came.
    Device(DeviceNews),
}

/// What happened to a device.
#[derive(Clone, Debug, PartialEq)]
pub enum DeviceNews {
    /// One that ran is gone.
    Lost {
        /// Its name.
        device: String,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// One that was lost runs again.
    Returned {
        /// Its name.
        device: String,
        /// Time since it was lost, seconds.
        absent_s: f64,
    },
}

/// A scene as it stands: its content and where everything is.
#[derive(Debug)]
pub struct SceneNow {
    /// When.
    pub stamp: v1::Stamp,
    /// What is in it.
    pub content: Arc<Content>,
    /// Pose of each object of the content.
    pub poses: Vec<Isometry3<f64>>,
    /// The hands.
    pub hands: Vec<HandNow>,
}

/// What waits for the publisher.
#[derive(Debug, Default)]
pub struct Batch {
    /// The content, when it changed.
    pub content: Option<Arc<Content>>,
    /// Whether a new epoch began: what was known before is void, and every object is among the changes.
    pub restarted: bool,
    /// Objects that changed, in the order of the ticks; the last entry of an id counts.
    pub changes: Vec<ObjectNow>,
    /// Objects that left.
    pub removed: Vec<ObjectId>,
    /// The newest tick.
    pub head: Option<Head>,
    /// What happened in all these ticks.
    pub events: Vec<EventEntry>,
    /// The recording to write to, when that changed, and how many of the events here came before.
    pub recorder: Option<(usize, Option<RecorderHandle>)>,
    /// Who wants the scene.
    pub scene_requests: Vec<oneshot::Sender<SceneNow>>,
    /// Number of the newest tick, over all epochs.
    pub serial: u64,
    /// Whether a subscriber came who needs a frame that is up to date.
    pub wanted: bool,
    /// Whether this is the end.
    pub stopped: bool,
}

/// The box between tick and publisher.
#[derive(Debug, Default)]
pub struct Inbox {
    batch: Mutex<Batch>,
    filled: Condvar,
}

impl Inbox {
    /// Puts something in. Whoever fills it holds the lock only while copying.
    pub fn post(&self, fill: impl FnOnce(&mut Batch)) {
        fill(&mut self.lock());
        self.filled.notify_one();
    }

    /// Waits for something and takes it all; `spare` is the emptied batch of the last time.
    pub fn take(&self, spare: Batch) -> Batch {
        let mut batch = self.lock();
        while !batch.has_news() {
            batch = self
                .filled
                .wait(batch)
                .unwrap_or_else(PoisonError::into_inner);
        }
        // Who asks after the end is told so.
        let (serial, stopped) = (batch.serial, batch.stopped);
        let next = Batch {
            serial,
            stopped,
            ..spare
        };
        std::mem::replace(&mut *batch, next)
    }

    /// Asks for a frame that is up to date; gives the number of the newest tick.
    pub fn want_frame(&self) -> u64 {
        let mut batch = self.lock();
        batch.wanted = true;
        self.filled.notify_one();
        batch.serial
    }

    /// The scene as it stands; `None` when too many ask at once or the daemon stops.
    pub async fn scene(&self) -> Option<SceneNow> {
        let (reply, answer) = oneshot::channel();
        {
            let mut batch = self.lock();
            if batch.scene_requests.len() >= SCENE_REQUESTS_MAX || batch.stopped {
                return None;
            }
            batch.scene_requests.push(reply);
        }
        self.filled.notify_one();
        answer.await.ok()
    }

    /// A panic elsewhere leaves the batch usable: it is filled field by field.
    fn lock(&self) -> MutexGuard<'_, Batch> {
        self.batch.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Batch {
    fn has_news(&self) -> bool {
        self.head.is_some()
            || self.content.is_some()
            || self.recorder.is_some()
            || self.wanted
            || self.stopped
            || !self.events.is_empty()
            || !self.scene_requests.is_empty()
    }

    /// Adds the objects that changed in one more tick, and keeps the list bounded.
    pub fn add_changes(&mut self, changed: impl Iterator<Item = ObjectNow>, n_objects: usize) {
        self.changes.extend(changed);
        if self.changes.len() > CHANGES_PER_OBJECT * n_objects + 64 {
            self.changes.reverse();
            self.changes.sort_by_key(|object| object.id);
            self.changes.dedup_by_key(|object| object.id);
        }
    }

    /// Says which recording takes the events from now on.
    pub fn set_recorder(&mut self, recorder: Option<RecorderHandle>) {
        self.recorder = Some((self.events.len(), recorder));
    }

    /// Forgets what was posted of the world before: a new epoch begins. Events stay.
    pub fn restart(&mut self) {
        self.restarted = true;
        self.changes.clear();
        self.removed.clear();
        self.head = None;
    }

    /// Empties it, keeping its memory.
    pub fn cleared(mut self) -> Self {
        self.changes.clear();
        self.removed.clear();
        self.events.clear();
        self.scene_requests.clear();
        Self {
            changes: self.changes,
            removed: self.removed,
            events: self.events,
            scene_requests: self.scene_requests,
            ..Self::default()
        }
    }
}
