//! New epochs: another scene, the same one from its start, a recording to be played. And where a recording begins.

use std::sync::Arc;

use tsukamu_motion::track::Outside;
use tsukamu_proto::v1;
use tsukamu_world::World;

use crate::input::intake::{Driver, Feed};
use crate::offline::hands::RunHand;
use crate::record::beginning::{hands_of, record_of};
use crate::recorder_handle::{RecordItem, RecorderHandle};

use super::engine::{Engine, Waiting};
use super::request::{Beginning, Plan, Refusal};

/// How long a scene that repeats stands still at its end, in seconds.
const REPEAT_PAUSE_S: f64 = 3.0;

impl Engine {
    /// Begins a new epoch. Hands of devices and clients stay, hands of the old scene go.
    pub fn load(&mut self, plan: Plan) {
        for driver in self
            .drivers
            .extract_if(.., |driver| matches!(driver.feed, Feed::Track { .. }))
        {
            self.outlets.sources.remove(&driver.source);
        }
        self.world = *plan.world;
        self.record = plan.record;
        self.playback = plan.playback;
        self.played_names.clear();
        self.period_ticks = self.period(&plan.hands).filter(|_| plan.repeats);
        plan.hands.into_iter().for_each(|hand| self.add_track(hand));
        self.begin();
    }

    /// Goes on with the next epoch of the recording that is played.
    pub(super) fn play_epoch(&mut self, world: World, record: v1::SceneRecord) {
        self.world = world;
        self.record = record;
        self.played_names.clear();
        self.begin();
    }

    /// Records from now on.
    ///
    /// # Errors
    /// When something is being recorded already, or played.
    pub(super) fn record(
        &mut self,
        recorder: RecorderHandle,
        name: String,
        beginning: Beginning,
    ) -> Result<v1::Stamp, Refusal> {
        if self.recorder.is_some() {
            return Err(Refusal::Recording(self.outlets.status.now().recording));
        }
        if self.playback.is_some() {
            return Err(Refusal::Playing);
        }
        let again = match beginning {
            Beginning::AsItStands => None,
            Beginning::NewEpoch => Some(self.world_again()?),
        };
        self.outlets
            .inbox
            .post(|batch| batch.set_recorder(Some(recorder.clone())));
        self.outlets
            .raw_tap
            .set(recorder.options().raw.then(|| recorder.clone().impatient()));
        self.recorder = Some(recorder);
        self.outlets.status.update(|status| status.recording = name);
        match again {
            Some(world) => self.start_again(world),
            None => self.record_world(),
        }
        // The first proof: the recording begins with this very world.
        self.record_digest();
        Ok(self.stamp)
    }

    /// The scene's world at its start. Where a model was chosen since, the scene goes on with it.
    fn world_again(&self) -> Result<World, Refusal> {
        // The world has checked everything else before.
        World::new(self.world.scene().clone())
            .map_err(|faults| Refusal::Object(format!("the scene cannot start again: {faults}")))
    }

    /// Begins a new epoch of the same scene.
    fn start_again(&mut self, world: World) {
        self.record = v1::SceneRecord {
            scene: Some(crate::convert::scene::scene(world.scene())),
            source_text: std::mem::take(&mut self.record.source_text),
            ..v1::SceneRecord::default()
        };
        self.world = world;
        self.begin();
    }

    /// Hands the world as it stands to the recording.
    fn record_world(&self) {
        let Some(recorder) = &self.recorder else {
            return;
        };
        let text = &self.record.source_text;
        let record = record_of(&self.world, self.stamp.epoch, &self.hands, text);
        recorder.offer(self.stamp.wall_ns, RecordItem::Scene(Box::new(record)));
    }

    /// Ends the recording with a last digest.
    ///
    /// # Errors
    /// When nothing is being recorded.
    pub(super) fn stop_recording(&mut self) -> Result<v1::Stamp, Refusal> {
        if self.recorder.is_none() {
            return Err(Refusal::NotRecording);
        }
        self.record_digest();
        self.recorder = None;
        self.outlets.raw_tap.set(None);
        self.outlets.inbox.post(|batch| batch.set_recorder(None));
        self.outlets
            .status
            .update(|status| status.recording.clear());
        Ok(self.stamp)
    }

    /// The start of an epoch whose world is there.
    fn begin(&mut self) {
        let now = self.now_ns();
        self.stamp.epoch += 1;
        self.serial += 1;
        self.set_stamp(now);
        self.hands = hands_of(&self.world, &self.record);
        self.pending.clear();
        // Commands for the world that was. Whoever is gone is gone.
        for waiting in self.waiting.drain(..) {
            match waiting {
                Waiting::Command(reply) => {
                    let _ = reply.send(Err(Refusal::NewEpoch));
                }
                Waiting::Object(_, reply) => {
                    let _ = reply.send(Err(Refusal::NewEpoch));
                }
            }
        }
        self.drivers.iter_mut().for_each(Driver::begin_epoch);
        if self.playback.is_none() {
            self.enter_drivers();
        }
        self.changed_content = false;
        self.content = Arc::new(self.content_now());
        self.record.epoch = self.stamp.epoch;
        if let Some(recorder) = &self.recorder {
            recorder.offer(
                self.stamp.wall_ns,
                RecordItem::Scene(Box::new(self.record.clone())),
            );
        }
        self.post(now, true);
        let scene = self.world.scene();
        self.outlets.status.update(|status| {
            status.stamp = self.stamp;
            status.scene.clone_from(&scene.name);
            status.model = scene.model.name();
            status.rate_hz = scene.rate_hz;
            status.n_objects = self.content.objects.len() as u32;
            status.n_hands = self.hands.len() as u32;
        });
    }

    /// Ticks after which the scene and these hands begin again.
    fn period(&self, hands: &[RunHand]) -> Option<u64> {
        let end_s = hands.iter().map(RunHand::end_s).fold(0.0, f64::max);
        (end_s > 0.0).then(|| ((end_s + REPEAT_PAUSE_S) * self.rate_hz()).ceil() as u64)
    }

    fn add_track(&mut self, hand: RunHand) {
        let (kind, place) = match hand.name.starts_with("synthetic:") {
            true => ("synthetic", String::new()),
            false => ("csv", hand.name.clone()),
        };
        let source = self.outlets.sources.add(&hand.name, kind, place, "running");
        // Between two rounds the hand is out of sight, so that it lets go.
        let outside = Outside::NoSample;
        let feed = Feed::Track {
            track: Arc::new(hand.motion),
            outside,
        };
        self.add_driver(|id| Driver::new(id, hand.model, source, feed, None));
    }
}
