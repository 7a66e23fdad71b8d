//! Recorded hands judged by the model: the share of runs in which the object is grasped and carried.
//!
//! *Pick runs* (`adroit_pick_policy`): a free object on the floor, where the run's object begins. A run counts as
//! **carried** when the object was lifted by more than [`pick::LIFT_MIN_M`](crate::experiment::recordings::pick::LIFT_MIN_M) and is held [`pick::HOLD_MARGIN_S`](crate::experiment::recordings::pick::HOLD_MARGIN_S) before
//! the end of the reference's hold (`t_grasp_end_s`, or the end of a run that is held to its end).
//!
//! *Door recordings* (`adroit_door_human`): a free bar of the lever's size, where the lever begins. There is nothing
//! to carry the bar before it is grasped, so these scenes have no gravity. A recording counts as **grasped** when the bar was
//! held for [`door::HOLD_MIN_S`](crate::experiment::recordings::door::HOLD_MIN_S) in one piece, and as **carried** when it went along for [`door::CARRY_MIN_M`](crate::experiment::recordings::door::CARRY_MIN_M).

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;
use tsukamu_motion::import::adroit::AdroitPoints;

/// Where the recordings are.
pub mod data;
/// One door recording.
pub mod door;
/// One pick run.
pub mod pick;

/// A recorded hand against one object.
mod replay;
/// The tables.
mod report;

use self::data::DataFault;
use self::door::DoorRun;
use self::pick::PickRun;

/// Radius of the hand's finger capsules in these sets, metres (`scene.json`: 7 to 13 mm).
pub const FINGER_RADIUS_M: f64 = 0.010;
/// Steps per second unless told otherwise.
pub const RATE_HZ: f64 = 240.0;

/// Which set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetName {
    /// `adroit_pick_policy`.
    Pick,
    /// `adroit_door_human`.
    Door,
}

/// How a set is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Play {
    /// The set.
    pub set: SetName,
    /// Where the fingers were, or where they were asked to be.
    pub points: AdroitPoints,
    /// Radius of the judgement points, metres.
    pub point_radius_m: f64,
    /// Steps per second.
    pub rate_hz: f64,
    /// What pushing does to the object before it is grasped first.
    pub stands: Stands,
}

/// What pushing does to an object before it is grasped first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stands {
    /// What the model says.
    Free,
    /// Nothing: it stands where it began, as a lever on its hinge nearly does, and is free from the first grasp on.
    UntilGrasped,
}

/// What is to be played.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordingsOptions {
    /// The folder that holds the sets' folders; `None` looks for `shared/data` beside and above the working directory.
    pub data: Option<PathBuf>,
    /// The sets, each played in each way.
    pub plays: Vec<Play>,
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
pub struct RecordingsReport {
    /// One per play.
    pub sets: Vec<SetReport>,
}

/// What came of one play.
#[derive(Clone, Debug, Serialize)]
pub struct SetReport {
    /// `pick` or `door`.
    pub set: &'static str,
    /// `reached` or `commanded`.
    pub points: &'static str,
    /// Radius of the judgement points, metres.
    pub point_radius_m: f64,
    /// Steps per second.
    pub rate_hz: f64,
    /// Whether the object stood still until it was grasped first.
    pub stands_until_grasped: bool,
    /// Runs played.
    pub n_runs: usize,
    /// Runs in which the object was grasped.
    pub n_grasped: usize,
    /// Runs in which it was carried as well.
    pub n_carried: usize,
    /// `n_carried` over `n_runs`.
    pub carried_share: f64,
    /// Runs that the set's table names but that are not there.
    pub n_absent: usize,
    /// The runs.
    pub runs: Runs,
}

/// The runs of a set.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Runs {
    /// Of the pick runs.
    Pick(Vec<PickRun>),
    /// Of the door recordings.
    Door(Vec<DoorRun>),
}

/// Why the recordings cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum RecordingsFault {
    /// The files.
    #[error(transparent)]
    Data(#[from] DataFault),
    /// A scene is refused: the step rate or the radius is out of bounds.
    #[error("{demo}: {why}")]
    Scene {
        /// The run.
        demo: String,
        /// Why.
        why: String,
    },
}

impl SetName {
    /// The name on the command line and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pick => "pick",
            Self::Door => "door",
        }
    }

    /// The folder of its files.
    pub const fn folder(self) -> &'static str {
        match self {
            Self::Pick => "adroit_pick_policy",
            Self::Door => "adroit_door_human",
        }
    }
}

impl Play {
    /// Where the fingers were, with their thickness.
    pub const fn reached(set: SetName) -> Self {
        Self {
            set,
            points: AdroitPoints::Reached,
            point_radius_m: FINGER_RADIUS_M,
            rate_hz: RATE_HZ,
            stands: Stands::Free,
        }
    }

    /// Where the fingers were asked to be, as bare points.
    pub const fn commanded(set: SetName) -> Self {
        Self {
            set,
            points: AdroitPoints::Commanded,
            point_radius_m: 0.0,
            rate_hz: RATE_HZ,
            stands: Stands::Free,
        }
    }
}

/// The name of a choice of points on the command line and in reports.
pub const fn points_name(points: AdroitPoints) -> &'static str {
    match points {
        AdroitPoints::Reached => "reached",
        AdroitPoints::Commanded => "commanded",
    }
}

/// Plays every set in every way. `progress` is told each run that is done.
///
/// # Errors
/// When the files are absent or broken, or a scene is refused.
pub fn run(
    options: &RecordingsOptions,
    mut progress: impl FnMut(&str),
) -> Result<RecordingsReport, RecordingsFault> {
    let data = data::find(options.data.as_deref())?;
    let sets = options.plays.iter().map(|play| {
        let folder = data::set_folder(&data, play.set)?;
        match play.set {
            SetName::Pick => pick::play_all(&folder, play, &mut progress),
            SetName::Door => door::play_all(&folder, play, &mut progress),
        }
    });
    Ok(RecordingsReport {
        sets: sets.collect::<Result<_, _>>()?,
    })
}

impl fmt::Display for RecordingsReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, set) in self.sets.iter().enumerate() {
            if index > 0 {
                writeln!(out)?;
            }
            report::write(set, out)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
