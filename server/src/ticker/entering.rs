//! What enters the world in a step.

use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use tracing::{info, warn};
use tsukamu_world::input::Command;
use tsukamu_world::state::HandId;

use crate::convert::input::step_input_from;
use crate::convert::scene::NamedHand;
use crate::input::filter::HandFilter;
use crate::input::fusion::Fusion;
use crate::input::intake::{Driver, Feed};

use super::engine::Engine;
use super::request::{HANDS_MAX, NewDriver, NewHand, Played, Refusal};

/// How long a step waits for its recorded input. The reader is hundreds of steps ahead: only a stalled disk makes the
/// world wait, and then it must, since a playback is nothing without its inputs.
const PLAYBACK_WAIT: Duration = Duration::from_millis(100);

impl Engine {
    /// Gathers the input of the step that makes `tick`; false when a playback has none for it now.
    pub(super) fn fill_input(&mut self, tick: u64) -> bool {
        if self.playback.is_some() && !self.play(tick) {
            return false;
        }
        self.drop_finished_hands();
        if self.playback.is_none() {
            if self
                .period_ticks
                .is_some_and(|period| tick > 1 && (tick - 1).is_multiple_of(period))
            {
                self.input.commands.push(Command::Reset);
            }
            self.input.commands.append(&mut self.pending);
        }
        let time = self.step_time(tick);
        let is_live = self.playback.is_none();
        for driver in &mut self.drivers {
            let first = self.arrived.len();
            let input = driver.input(time, &mut self.arrived);
            if is_live {
                self.input.hands.push(input);
            }
            if let Some(recorder) = self
                .recorder
                .as_ref()
                .filter(|recorder| recorder.options().raw)
            {
                super::leaving::record_samples(
                    recorder,
                    driver,
                    &self.arrived[first..],
                    time,
                    &self.outlets.clock,
                );
            }
        }
        true
    }

    /// Takes the recorded input; false when it has not come yet, and when a new epoch came. At the recording's end the
    /// sources take over.
    fn play(&mut self, tick: u64) -> bool {
        let Some(playback) = &self.playback else {
            return true;
        };
        match playback.recv_timeout(PLAYBACK_WAIT) {
            Ok(Played::Epoch(world, record)) => {
                self.play_epoch(*world, *record);
                return false;
            }
            Ok(Played::Input(message)) if message.tick != tick => {
                warn!(
                    tick,
                    next = message.tick,
                    "the recording has a gap and cannot be played on"
                );
                self.end_playback();
            }
            Ok(Played::Input(message)) => match step_input_from(&message) {
                Ok(input) => {
                    self.name_played_hands(&message);
                    self.input = input;
                }
                Err(fault) => {
                    warn!(tick, %fault, "the recording cannot be played on");
                    self.end_playback();
                }
            },
            Err(RecvTimeoutError::Timeout) => return false,
            Err(RecvTimeoutError::Disconnected) => {
                info!(tick, "the recording has been played");
                self.end_playback();
            }
        }
        true
    }

    /// The recorded hands leave, and those of the sources enter.
    fn end_playback(&mut self) {
        self.playback = None;
        let recorded = self.hands.iter().map(|hand| Command::RemoveHand(hand.id));
        self.pending.extend(recorded);
        self.enter_drivers();
    }

    /// A recording says what its hands are called.
    fn name_played_hands(&mut self, message: &tsukamu_proto::v1::StepInput) {
        use tsukamu_proto::v1::world_command::Kind;
        for command in &message.commands {
            if let Some(Kind::AddHand(added)) = &command.kind {
                self.played_names.retain(|(id, _)| id.0 != added.hand);
                self.played_names
                    .push((HandId(added.hand), added.name.clone()));
            }
        }
    }

    /// Lets the hands of all drivers enter with the next step.
    pub(super) fn enter_drivers(&mut self) {
        let enter = |driver: &Driver| Command::AddHand {
            hand: driver.hand,
            model: Box::new(driver.model.clone()),
        };
        self.pending.extend(self.drivers.iter().map(enter));
    }

    /// Takes out the hands whose clients are gone; those that have not entered yet never do.
    fn drop_finished_hands(&mut self) {
        if !self.drivers.iter().any(Driver::is_over) {
            return;
        }
        for driver in self.drivers.extract_if(.., |driver| driver.is_over()) {
            self.outlets.sources.remove(&driver.source);
            let n_pending = self.pending.len();
            self.pending.retain(
                |command| !matches!(command, Command::AddHand { hand, .. } if *hand == driver.hand),
            );
            let is_in = self.playback.is_none() && self.pending.len() == n_pending;
            self.pending
                .extend(is_in.then_some(Command::RemoveHand(driver.hand)));
        }
    }

    /// A hand joins with the next step.
    ///
    /// # Errors
    /// When there are too many.
    pub(super) fn open_hand(&mut self, new: NewHand) -> Result<HandId, Refusal> {
        // While the world stands still, no step takes out those who have gone.
        self.drop_finished_hands();
        if self.drivers.len() >= HANDS_MAX {
            return Err(Refusal::TooManyHands);
        }
        let feed = match new.driver {
            NewDriver::Remote(answers) => Feed::Remote { answers },
            NewDriver::Device(settings) => Feed::Device(Box::new(Fusion::new(settings))),
        };
        let id = self.add_driver(|id| {
            Driver::new(
                id,
                new.model,
                new.source,
                feed,
                new.filter.map(HandFilter::new),
            )
        });
        if self.playback.is_none()
            && let Some(driver) = self.drivers.last()
        {
            self.pending.push(Command::AddHand {
                hand: id,
                model: Box::new(driver.model.clone()),
            });
        }
        Ok(id)
    }

    /// Adds a driver with an id that no hand of this daemon has had.
    pub(super) fn add_driver(&mut self, make: impl FnOnce(HandId) -> Driver) -> HandId {
        let id = HandId(self.next_hand);
        self.next_hand = self.next_hand.wrapping_add(1);
        self.drivers.push(make(id));
        id
    }

    /// Keeps the list of hands in step with what entered.
    pub(super) fn note_hands_of_input(&mut self) {
        for index in 0..self.input.commands.len() {
            match &self.input.commands[index] {
                Command::AddHand { hand, model } => {
                    let (id, model) = (*hand, (**model).clone());
                    let named = NamedHand {
                        id,
                        name: self.name_of_entering(id),
                        model,
                    };
                    self.hands.retain(|hand| hand.id != id);
                    let place = self.hands.partition_point(|hand| hand.id < id);
                    self.hands.insert(place, named);
                    self.changed_content = true;
                }
                Command::RemoveHand(id) => {
                    self.hands.retain(|hand| hand.id != *id);
                    self.changed_content = true;
                }
                Command::SetModel(_) => self.changed_content = true,
                _ => {}
            }
        }
    }

    fn name_of_entering(&self, id: HandId) -> String {
        let played = self
            .played_names
            .iter()
            .find(|(hand, _)| self.playback.is_some() && *hand == id);
        let driven = || {
            self.drivers
                .iter()
                .find(|driver| driver.hand == id)
                .map(|driver| driver.source.name.clone())
        };
        played
            .map(|(_, name)| name.clone())
            .or_else(driven)
            .unwrap_or_default()
    }
}
