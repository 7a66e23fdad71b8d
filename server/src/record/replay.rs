//! Steps a world through a recording again.

use std::collections::BTreeMap;
use std::io::Read;

use tsukamu_proto::v1;
use tsukamu_proto::v1::world_command::Kind;
use tsukamu_world::state::HandId;
use tsukamu_world::{StepInput, World};

use super::beginning::{BeginningFault, world_at};
use super::reader::{Ending, RecordingReader};
use crate::convert::fault::Fault;
use crate::convert::input::step_input_from;
use crate::recorder_handle::RecordItem;

/// Why a recording cannot be stepped through any further.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum ReplayFault {
    /// A step input or digest comes before any scene.
    #[error("the recording begins without a scene")]
    NoScene,
    /// An epoch cannot begin as recorded.
    #[error("epoch {epoch} cannot begin: {fault}")]
    Beginning {
        /// The epoch.
        epoch: u64,
        /// What is wrong with it.
        fault: BeginningFault,
    },
    /// A recorded step input cannot be one.
    #[error("the input of epoch {epoch}, tick {tick} cannot be read: {fault}")]
    Input {
        /// The epoch.
        epoch: u64,
        /// The tick.
        tick: u64,
        /// What is wrong with it.
        fault: Fault,
    },
    /// Inputs are missing: the recording began late, or its disk was too slow.
    #[error(
        "epoch {epoch}: the inputs after tick {last} are missing, the next is that of epoch {next_epoch}, tick {next}"
    )]
    Gap {
        /// The epoch.
        epoch: u64,
        /// The last tick that is there.
        last: u64,
        /// Epoch of the next item.
        next_epoch: u64,
        /// Tick of the next item.
        next: u64,
    },
}

/// What the replay came to.
#[derive(Debug)]
pub enum Moment {
    /// A new world stands where its recording begins: at its start, or in mid-session.
    Epoch,
    /// The world was stepped with this input.
    Stepped {
        /// What entered.
        input: StepInput,
        /// The same as it was recorded, with names.
        message: v1::StepInput,
    },
    /// The recording says what the digest is now.
    Digest {
        /// The recorded digest.
        recorded: u64,
    },
}

/// A recording under replay.
#[derive(Debug)]
pub struct Replay<R> {
    reader: RecordingReader<R>,
    world: Option<World>,
    epoch: u64,
    hand_names: BTreeMap<HandId, String>,
}

impl<R: Read> Replay<R> {
    /// A replay at the start of the recording.
    pub const fn new(reader: RecordingReader<R>) -> Self {
        Self {
            reader,
            world: None,
            epoch: 0,
            hand_names: BTreeMap::new(),
        }
    }

    /// The next moment; `None` at the end of the recording.
    ///
    /// # Errors
    /// When what comes next cannot be carried out.
    pub fn next_moment(&mut self) -> Result<Option<Moment>, ReplayFault> {
        while let Some(record) = self.reader.next() {
            match record.item {
                RecordItem::Scene(scene) => return self.begin(&scene).map(Some),
                RecordItem::Input(message) => return self.step(message).map(Some),
                RecordItem::Digest(digest) => {
                    self.expect_tick(digest.epoch, digest.tick, 0)?;
                    return Ok(Some(Moment::Digest {
                        recorded: digest.digest,
                    }));
                }
                RecordItem::Event(_)
                | RecordItem::Frame(_)
                | RecordItem::Raw(_)
                | RecordItem::Sample(_) => {}
            }
        }
        Ok(None)
    }

    /// The world as it stands; `None` before the first epoch.
    pub const fn world(&self) -> Option<&World> {
        self.world.as_ref()
    }

    /// The epoch that is played.
    pub const fn epoch(&self) -> u64 {
        self.epoch
    }

    /// The name of a hand, as recorded when it entered or the recording began.
    pub fn hand_name(&self, hand: HandId) -> String {
        self.hand_names
            .get(&hand)
            .cloned()
            .unwrap_or_else(|| format!("hand {}", hand.0))
    }

    /// Hands that have been in this epoch's world, and their names.
    pub const fn hand_names(&self) -> &BTreeMap<HandId, String> {
        &self.hand_names
    }

    /// How the recording ended; `None` before its end.
    pub const fn ending(&self) -> Option<&Ending> {
        self.reader.ending()
    }

    /// Bytes read so far.
    pub fn n_read(&self) -> u64 {
        self.reader.n_read()
    }

    fn begin(&mut self, record: &v1::SceneRecord) -> Result<Moment, ReplayFault> {
        let epoch = record.epoch;
        let world = world_at(record).map_err(|fault| ReplayFault::Beginning { epoch, fault })?;
        self.world = Some(world);
        self.epoch = epoch;
        let hands = record.scene.iter().flat_map(|scene| &scene.hands);
        self.hand_names = hands
            .map(|hand| (HandId(hand.id), hand.name.clone()))
            .collect();
        Ok(Moment::Epoch)
    }

    fn step(&mut self, message: v1::StepInput) -> Result<Moment, ReplayFault> {
        let (epoch, tick) = (message.epoch, message.tick);
        self.expect_tick(epoch, tick, 1)?;
        for command in &message.commands {
            if let Some(Kind::AddHand(added)) = &command.kind {
                self.hand_names
                    .insert(HandId(added.hand), added.name.clone());
            }
        }
        let input =
            step_input_from(&message).map_err(|fault| ReplayFault::Input { epoch, tick, fault })?;
        self.world
            .as_mut()
            .ok_or(ReplayFault::NoScene)?
            .step(&input);
        Ok(Moment::Stepped { input, message })
    }

    /// Checks that an item belongs to this epoch, `ahead` ticks after the world's.
    fn expect_tick(&self, epoch: u64, tick: u64, ahead: u64) -> Result<(), ReplayFault> {
        let last = self
            .world
            .as_ref()
            .ok_or(ReplayFault::NoScene)?
            .state()
            .tick;
        if epoch == self.epoch && tick == last + ahead {
            return Ok(());
        }
        Err(ReplayFault::Gap {
            epoch: self.epoch,
            last,
            next_epoch: epoch,
            next: tick,
        })
    }
}
