//! New epochs: another scene, the same one recorded from its start, a recording to be played.

use std::sync::Arc;

use tsukamu_motion::track::Outside;
use tsukamu_proto::v1;
use tsukamu_world::World;

use crate::input::intake::{Driver, Feed};
use crate::offline::hands::RunHand;
use crate::recorder_handle::{RecordItem, RecorderHandle};

use super::engine::{Engine, Waiting};
use super::request::{Plan, Refusal};

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

    /// Begins a new epoch of the same scene, and records it.
    ///
    /// # Errors
    /// When something is being recorded already.
    pub(super) fn record(
        &mut self,
        recorder: RecorderHandle,
        name: String,
    ) -> Result<v1::Stamp, Refusal> {
        if self.recorder.is_some() {
            return Err(Refusal::Recording(self.outlets.status.now().recording));
        }
        if self.playback.is_some() {
            return Err(Refusal::Playing);
        }
        // Where a model was chosen since, the scene goes on with it; the world has checked everything else before.
        let Ok(world) = World::new(self.world.scene().clone()) else {
            return Err(Refusal::Object(
                "the scene cannot be started again".to_owned(),
            ));
        };
        self.world = world;
        self.record.scene = Some(crate::convert::scene::scene(self.world.scene()));
        self.outlets
            .inbox
            .post(|batch| batch.recorder = Some(Some(recorder.clone())));
        self.outlets
            .raw_tap
            .set(recorder.options().raw.then(|| recorder.clone()));
        self.recorder = Some(recorder);
        self.outlets.status.update(|status| status.recording = name);
        self.begin();
        Ok(self.stamp)
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
        self.outlets.inbox.post(|batch| batch.recorder = Some(None));
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
        self.hands.clear();
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
            status.n_hands = 0;
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
