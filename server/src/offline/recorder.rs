//! Records an offline run: the same file that the daemon writes, but nothing is ever dropped.

use std::time::{SystemTime, UNIX_EPOCH};

use bytes::Bytes;
use prost::Message;
use tsukamu_proto::v1;
use tsukamu_world::{StepInput, World};

use super::hands::RunHand;
use super::names::NameBook;
use crate::convert::event::{Names, event};
use crate::convert::input::step_input;
use crate::convert::scene::{NamedHand, scene};
use crate::record::RecordFault;
use crate::record::writer::{Finished, RecordingFile};
use crate::recorder_handle::{Record, RecordItem};

/// The one epoch of an offline run.
const EPOCH: u64 = 1;
/// World time between digests, in seconds.
const DIGEST_INTERVAL_S: f64 = 1.0;

/// Writes one run.
#[derive(Debug)]
pub(super) struct RunRecorder {
    file: RecordingFile,
    hands: Vec<NamedHand>,
    start_ns: u64,
    n_events: u64,
    digest_ticks: u64,
    last_digest: u64,
}

impl RunRecorder {
    /// Begins with the world at its start.
    pub(super) fn begin(
        file: RecordingFile,
        world: &World,
        source_text: &str,
        hands: &[RunHand],
    ) -> Result<Self, RecordFault> {
        let start = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0, |since| since.as_nanos());
        let mut recorder = Self {
            file,
            hands: hands.iter().map(named).collect(),
            start_ns: u64::try_from(start).unwrap_or(u64::MAX),
            n_events: 0,
            digest_ticks: (world.scene().rate_hz * DIGEST_INTERVAL_S).ceil() as u64,
            last_digest: 0,
        };
        let message = v1::SceneRecord {
            epoch: EPOCH,
            scene: Some(scene(world.scene())),
            source_text: source_text.to_owned(),
            ..v1::SceneRecord::default()
        };
        recorder.put(0.0, RecordItem::Scene(Box::new(message)))?;
        Ok(recorder)
    }

    /// Writes the step that the world has just done.
    pub(super) fn step(
        &mut self,
        input: &StepInput,
        world: &World,
        names: &NameBook,
    ) -> Result<(), RecordFault> {
        let frame = world.frame();
        let (tick, time_s) = (frame.tick, frame.time_s);
        let message = step_input(EPOCH, tick, input, |hand| names.hand(hand));
        self.put(time_s, RecordItem::Input(message))?;
        for happened in &frame.events {
            self.n_events += 1;
            let object = happened
                .object
                .map_or_else(String::new, |id| names.object(id));
            let references = Names {
                hands: &self.hands,
                targets: &world.scene().targets,
            };
            let stamp = v1::Stamp {
                epoch: EPOCH,
                tick,
                world_time_s: time_s,
                wall_ns: self.wall_ns(time_s),
            };
            let message = v1::Event {
                stamp: Some(stamp),
                sequence: self.n_events,
                ..event(happened, &object, references)
            };
            self.put(
                time_s,
                RecordItem::Event(Bytes::from(message.encode_to_vec())),
            )?;
        }
        if tick.is_multiple_of(self.digest_ticks) {
            self.digest(world)?;
        }
        Ok(())
    }

    /// Writes the last digest and the end of the file.
    pub(super) fn finish(mut self, world: &World) -> Result<Finished, RecordFault> {
        if self.last_digest != world.state().tick {
            self.digest(world)?;
        }
        self.file.finish(0)
    }

    fn digest(&mut self, world: &World) -> Result<(), RecordFault> {
        let tick = world.state().tick;
        self.last_digest = tick;
        let message = v1::Digest {
            epoch: EPOCH,
            tick,
            digest: world.digest(),
        };
        self.put(world.frame().time_s, RecordItem::Digest(message))
    }

    fn put(&mut self, time_s: f64, item: RecordItem) -> Result<(), RecordFault> {
        self.file.write(&Record {
            wall_ns: self.wall_ns(time_s),
            item,
        })
    }

    /// When the step would have been done, had the run been in real time from its start on.
    fn wall_ns(&self, time_s: f64) -> u64 {
        self.start_ns
            .saturating_add((time_s * 1.0e9).round() as u64)
    }
}

fn named(hand: &RunHand) -> NamedHand {
    NamedHand {
        id: hand.id,
        name: hand.name.clone(),
        model: hand.model.clone(),
    }
}
