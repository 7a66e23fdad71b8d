//! Fig. 12 of the paper: how hands touch each object over time.
//!
//! The paper finds a grasp preceded by one or two of its frames of pushing, and deliberate pushing to be mostly one
//! point of the index finger.

use std::fmt;
use std::io::Read;

use serde::Serialize;
use tsukamu_world::World;
use tsukamu_world::state::ContactState;

/// The picture.
pub mod chart;

use super::play::play;
use super::table::{Lean, NONE, Table};
use crate::record::reader::RecordingReader;
use crate::record::replay::{Moment, Replay, ReplayFault};

/// The paper's real-time mark, frames per second, in which pushing before a grasp is counted.
pub const PAPER_RATE_HZ: f64 = 12.0;

/// How hands touch objects over time.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Transitions {
    /// What was watched: a scene's name or a recording's.
    pub title: String,
    /// World time watched, seconds; of several epochs, one after the other.
    pub duration_s: f64,
    /// The objects, in the order in which they came in.
    pub objects: Vec<ObjectStates>,
}

/// How hands touch one object over time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ObjectStates {
    /// Its name. Objects of one name in several epochs share a row.
    pub name: String,
    /// Its states without gaps while it was there, in order.
    pub spans: Vec<Span>,
}

/// A state and how long it lasted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Span {
    /// The state.
    #[serde(serialize_with = "name_of")]
    pub state: ContactState,
    /// Its beginning, seconds.
    pub from_s: f64,
    /// Its end, seconds.
    pub until_s: f64,
}

/// Why a recording cannot be watched to its end.
#[derive(Debug, thiserror::Error)]
pub enum TransitionsFault {
    /// It cannot be stepped through.
    #[error(transparent)]
    Replay(#[from] ReplayFault),
    /// It has no step.
    #[error("there is no step in it")]
    Empty,
}

fn name_of<S: serde::Serializer>(state: &ContactState, out: S) -> Result<S::Ok, S::Error> {
    out.serialize_str(state.name())
}

/// Watches a scene with its own hands. `rate_hz` takes the place of the scene's step rate.
///
/// # Errors
/// When the scene or its hands cannot be had.
pub fn of_scene(name_or_file: &str, rate_hz: Option<f64>) -> anyhow::Result<Transitions> {
    let mut transitions = Transitions {
        title: name_or_file.to_owned(),
        ..Transitions::default()
    };
    play(name_or_file, rate_hz, |world| transitions.watch(world, 0.0))?;
    Ok(transitions)
}

/// Watches a recording by stepping through it again. `progress` is told the bytes read.
///
/// # Errors
/// When it cannot be stepped through, or has no step.
pub fn of_recording<R: Read>(
    title: &str,
    reader: RecordingReader<R>,
    mut progress: impl FnMut(u64),
) -> Result<Transitions, TransitionsFault> {
    let mut transitions = Transitions {
        title: title.to_owned(),
        ..Transitions::default()
    };
    let mut replay = Replay::new(reader);
    let mut epoch_start_s = 0.0;
    while let Some(moment) = replay.next_moment()? {
        match moment {
            Moment::Epoch => epoch_start_s = transitions.duration_s,
            Moment::Stepped { .. } => {
                if let Some(world) = replay.world() {
                    transitions.watch(world, epoch_start_s);
                }
                progress(replay.n_read());
            }
            Moment::Digest { .. } => {}
        }
    }
    if transitions.duration_s == 0.0 {
        return Err(TransitionsFault::Empty);
    }
    Ok(transitions)
}

impl Transitions {
    /// Takes in the world after a step; its time counts from `start_s`.
    pub fn watch(&mut self, world: &World, start_s: f64) {
        let until_s = start_s + world.frame().time_s;
        let from_s = until_s - world.scene().step_length_s();
        self.duration_s = until_s;
        for (_, body) in world.objects() {
            let name = &body.spec.name;
            let index = self.objects.iter().position(|object| object.name == *name);
            let index = index.unwrap_or_else(|| {
                self.objects.push(ObjectStates {
                    name: name.clone(),
                    spans: Vec::new(),
                });
                self.objects.len() - 1
            });
            self.objects[index].add(body.contact, from_s, until_s);
        }
    }
}

impl ObjectStates {
    fn add(&mut self, state: ContactState, from_s: f64, until_s: f64) {
        match self.spans.last_mut() {
            // Half a step: rounding of tick times.
            Some(last)
                if last.state == state && from_s - last.until_s < 0.5 * (until_s - from_s) =>
            {
                last.until_s = until_s;
            }
            _ => self.spans.push(Span {
                state,
                from_s,
                until_s,
            }),
        }
    }

    /// Whether a hand ever touched it.
    pub fn is_touched(&self) -> bool {
        self.spans
            .iter()
            .any(|span| span.state != ContactState::Free)
    }

    /// Seconds in a state, all spans together.
    pub fn time_in_s(&self, state: ContactState) -> f64 {
        let own = self.spans.iter().filter(|span| span.state == state);
        own.map(|span| span.until_s - span.from_s)
            .fold(0.0, |sum, length_s| sum + length_s)
    }

    /// Seconds of pushing right before each grasp that begins after the object was free.
    pub fn pushes_before_grasps_s(&self) -> Vec<f64> {
        let mut pushes = Vec::new();
        let mut pushed_s = 0.0;
        let mut was_grasped = false;
        for span in &self.spans {
            match span.state {
                ContactState::Free => (pushed_s, was_grasped) = (0.0, false),
                ContactState::Grasped => {
                    if !was_grasped {
                        pushes.push(pushed_s);
                    }
                    was_grasped = true;
                }
                ContactState::PushedAtOne | ContactState::PushedAtSeveral => {
                    pushed_s += span.until_s - span.from_s
                }
            }
        }
        pushes
    }
}

impl fmt::Display for Transitions {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let right = Lean::Right;
        let mut table = Table::new(&[
            ("object", Lean::Left),
            ("free s", right),
            ("push-1 s", right),
            ("push-n s", right),
            ("grasped s", right),
            ("grasps", right),
            ("pushed before each, ms", Lean::Left),
            ("in frames of 1/12 s", Lean::Left),
        ]);
        for object in &self.objects {
            let seconds = |state| format!("{:.2}", object.time_in_s(state));
            let pushes = object.pushes_before_grasps_s();
            let list = |scale: f64, decimals: usize| {
                let words: Vec<String> = pushes
                    .iter()
                    .map(|push| format!("{:.decimals$}", push * scale))
                    .collect();
                if words.is_empty() {
                    NONE.to_owned()
                } else {
                    words.join(" ")
                }
            };
            table.add(vec![
                object.name.clone(),
                seconds(ContactState::Free),
                seconds(ContactState::PushedAtOne),
                seconds(ContactState::PushedAtSeveral),
                seconds(ContactState::Grasped),
                pushes.len().to_string(),
                list(1000.0, 0),
                list(PAPER_RATE_HZ, 1),
            ]);
        }
        writeln!(
            out,
            "{}: {:.2} s of world time",
            self.title, self.duration_s
        )?;
        write!(out, "{table}")
    }
}

#[cfg(test)]
mod tests;
