//! The world with everything that enters and leaves it; no clock of its own.

use std::sync::Arc;
use std::sync::mpsc::Receiver;

use tsukamu_proto::v1;
use tsukamu_world::input::Command;
use tsukamu_world::state::{HandId, ObjectId};
use tsukamu_world::step::HandTouch;
use tsukamu_world::{StepInput, World};

use crate::broadcast::inbox::{Content, Inbox};
use crate::clock::Clock;
use crate::convert::scene::{NamedHand, surroundings};
use crate::input::intake::{Driver, StepTime};
use crate::input::serial::RawTap;
use crate::input::sources::{Arrived, Sources};
use crate::metrics::Metrics;
use crate::recorder_handle::RecorderHandle;
use crate::settings::Mode;
use crate::status::StatusBoard;

use super::request::{Plan, Played, Reply, Stepped};

/// Where everything goes.
#[derive(Clone, Debug)]
pub struct Outlets {
    /// To the publisher.
    pub inbox: Arc<Inbox>,
    /// The list of sources.
    pub sources: Sources,
    /// Counters.
    pub metrics: Arc<Metrics>,
    /// The daemon at a glance.
    pub status: Arc<StatusBoard>,
    /// Where the ports' threads look for a recording.
    pub raw_tap: RawTap,
    /// The time.
    pub clock: Clock,
}

/// Someone who waits for the next step.
#[derive(Debug)]
pub(super) enum Waiting {
    /// For a command.
    Command(Reply<v1::Stamp>),
    /// For an object, by name.
    Object(String, Reply<(v1::Stamp, ObjectId)>),
}

/// The world with everything that enters and leaves it.
#[derive(Debug)]
pub struct Engine {
    pub(super) outlets: Outlets,
    pub(super) world: World,
    pub(super) stamp: v1::Stamp,
    /// Grows with every step of every epoch.
    pub(super) serial: u64,
    pub(super) content: Arc<Content>,
    /// Hands in the world, by id.
    pub(super) hands: Vec<NamedHand>,
    /// Hands and what drives them, in the order in which they came.
    pub(super) drivers: Vec<Driver>,
    pub(super) next_hand: u32,
    /// After how many ticks scene and hands begin again.
    pub(super) period_ticks: Option<u64>,
    /// The epoch's start, for recordings.
    pub(super) record: v1::SceneRecord,
    pub(super) playback: Option<Receiver<Played>>,
    /// What a recording calls its hands.
    pub(super) played_names: Vec<(HandId, String)>,
    pub(super) input: StepInput,
    /// Commands for the next step.
    pub(super) pending: Vec<Command>,
    pub(super) waiting: Vec<Waiting>,
    pub(super) recorder: Option<RecorderHandle>,
    /// Whether steps come by themselves.
    pub(super) is_running: bool,
    /// Kept for their memory.
    pub(super) arrived: Vec<Arrived>,
    pub(super) touches: Vec<HandTouch>,
    pub(super) changed_content: bool,
}

impl Engine {
    /// A world at the start of its first epoch.
    pub fn new(outlets: Outlets, plan: Plan) -> Self {
        let content = Content {
            epoch: 0,
            version: 0,
            surroundings: surroundings(plan.world.scene()),
            grasp_angle: plan.world.scene().grasp_angle,
            targets: Vec::new(),
            objects: Vec::new(),
            hands: Vec::new(),
        };
        let mut engine = Self {
            outlets,
            // `load` below puts the plan's world here; an empty one is cheap.
            world: (*plan.world).clone(),
            stamp: v1::Stamp::default(),
            serial: 0,
            content: Arc::new(content),
            hands: Vec::new(),
            drivers: Vec::new(),
            next_hand: 0,
            period_ticks: None,
            record: v1::SceneRecord::default(),
            playback: None,
            played_names: Vec::new(),
            input: StepInput::default(),
            pending: Vec::new(),
            waiting: Vec::new(),
            recorder: None,
            is_running: false,
            arrived: Vec::new(),
            touches: Vec::new(),
            changed_content: false,
        };
        engine.load(plan);
        engine
    }

    /// Does one step; false when a playback's input has not come yet, or when it came to a new epoch instead.
    pub fn step(&mut self) -> bool {
        let tick = self.world.state().tick + 1;
        self.input.clear();
        self.arrived.clear();
        if !self.fill_input(tick) {
            return false;
        }
        let begin = self.now_ns();
        self.world.step(&self.input);
        let end = self.now_ns();
        self.outlets.metrics.note_step(end.saturating_sub(begin));
        self.serial += 1;
        self.set_stamp(end);
        self.note_hands_of_input();
        self.record_input();
        self.post_step(end);
        self.answer_drivers();
        self.answer_waiting();
        self.note_status();
        true
    }

    /// Monotonic time, nanoseconds.
    pub fn now_ns(&self) -> u64 {
        self.outlets.clock.monotonic_ns()
    }

    /// Steps per second.
    pub fn rate_hz(&self) -> f64 {
        self.world.scene().rate_hz
    }

    /// The last step.
    pub const fn stamp(&self) -> v1::Stamp {
        self.stamp
    }

    /// The last step, with the world's digest.
    pub fn stepped(&self) -> Stepped {
        Stepped {
            stamp: self.stamp,
            digest: self.world.digest(),
        }
    }

    /// Counts steps that were skipped.
    pub fn note_overruns(&self, n_skipped: u64) {
        if n_skipped > 0 {
            self.outlets.metrics.overruns.inc_by(n_skipped);
        }
    }

    /// Notes the measured step rate, steps per second.
    pub fn note_rate(&self, measured_rate_hz: f64) {
        self.outlets
            .status
            .update(|status| status.measured_rate_hz = measured_rate_hz);
    }

    /// Notes how time passes.
    pub fn set_mode(&mut self, mode: Mode) {
        self.is_running = mode == Mode::Realtime;
        self.outlets
            .status
            .update(|status| status.mode = mode.name());
    }

    /// Notes that the clock was stopped or started.
    pub fn set_paused(&mut self, is_paused: bool) {
        self.is_running = !is_paused;
        self.outlets.status.update(|status| {
            status.is_paused = is_paused;
            status.measured_rate_hz = 0.0;
        });
    }

    /// The end: what waits is refused, the recording is given its last digest, the publisher stops.
    pub fn finish(self) {
        if self.recorder.is_some() {
            self.record_digest();
        }
        self.outlets.raw_tap.set(None);
        self.outlets.inbox.post(|batch| {
            batch.set_recorder(None);
            batch.stopped = true;
        });
    }

    /// The times at which the step of a tick is made.
    pub(super) fn step_time(&self, tick: u64) -> StepTime {
        let in_period = self
            .period_ticks
            .map_or(tick, |period| (tick - 1) % period + 1);
        let track_s = in_period as f64 * self.world.scene().step_length_s();
        StepTime {
            tick,
            track_s,
            now_ns: self.now_ns(),
        }
    }

    /// Sets the stamp to the world's tick, done at a monotonic time in nanoseconds.
    pub(super) fn set_stamp(&mut self, done_ns: u64) {
        let tick = self.world.state().tick;
        self.stamp.tick = tick;
        self.stamp.world_time_s = tick as f64 * self.world.scene().step_length_s();
        self.stamp.wall_ns = self.outlets.clock.wall_of(done_ns);
    }

    /// The name of a hand, or empty.
    pub(super) fn hand_name(&self, id: HandId) -> String {
        let known = self.hands.iter().find(|hand| hand.id == id);
        known.map_or_else(String::new, |hand| hand.name.clone())
    }

    fn note_status(&self) {
        let (stamp, n_hands) = (self.stamp, self.hands.len() as u32);
        self.outlets.status.update(|status| {
            status.stamp = stamp;
            status.n_hands = n_hands;
        });
    }
}
