//! From a hand's spec to its motion.

use std::path::Path;

use tsukamu_motion::hand_csv;
use tsukamu_motion::mistake::ImportError;
use tsukamu_motion::synthetic::{PlanFault, SceneInfo, SyntheticHand, plan};
use tsukamu_motion::track::{HandTrack, Outside, TrackHand};
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::sample::HandSample;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::scene::Scene;
use tsukamu_world::state::HandId;

use crate::scene_file::hands::HandSourceSpec;

/// Largest file of hand motion, in bytes; it is looked at before a byte is parsed.
const FILE_BYTES_MAX: u64 = 1 << 30;

/// Why a hand's motion cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum HandFault {
    /// The file cannot be read.
    #[error("{file}: {source}")]
    Unreadable {
        /// The file.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is too large.
    #[error("{file}: has {bytes} bytes; a file of hand motion may have {FILE_BYTES_MAX}")]
    TooLarge {
        /// The file.
        file: String,
        /// Its size.
        bytes: u64,
    },
    /// The file is no hand CSV.
    #[error("{}", .mistakes.to_string().lines().map(|line| format!("{file}: {line}")).collect::<Vec<_>>().join("\n"))]
    Mistakes {
        /// The file.
        file: String,
        /// What is wrong in it.
        mistakes: ImportError,
    },
    /// A computed hand does not find what it needs in the scene.
    #[error(transparent)]
    Plan(#[from] PlanFault),
}

/// The motion of one hand over world time.
#[derive(Clone, Debug)]
pub enum Motion {
    /// Samples at given times.
    Track(TrackHand),
    /// A closed form in time.
    Synthetic(Box<SyntheticHand>),
}

/// One hand of a run: its motion and how it enters the world.
#[derive(Clone, Debug)]
pub struct RunHand {
    /// Its id in the world.
    pub id: HandId,
    /// Its name in events and recordings: its spec, with the side where one file holds both.
    pub name: String,
    /// Its shape.
    pub model: HandModel,
    /// Its motion, in world time.
    pub motion: Motion,
}

impl Motion {
    /// Left or right.
    pub fn side(&self) -> Side {
        match self {
            Self::Track(track) => track.side,
            Self::Synthetic(hand) => hand.side(),
        }
    }

    /// The hand at a world time, in seconds; `None` where it is not tracked. `outside` says what a track answers
    /// beyond its ends; a computed hand stays where it is.
    pub fn sample_at(&self, time_s: f64, outside: Outside) -> Option<HandSample> {
        match self {
            Self::Track(track) => track.sample_at(time_s, outside),
            Self::Synthetic(hand) => Some(hand.sample_at(time_s)),
        }
    }

    /// World time at which it is over, in seconds.
    pub fn end_s(&self) -> f64 {
        match self {
            Self::Track(track) => track.times_s.last().copied().unwrap_or(0.0),
            Self::Synthetic(hand) => hand.duration_s(),
        }
    }
}

/// The motions of one spec: two where a file holds both hands. Their times are world times: a sample at 0.5 s is
/// applied half a second after the start.
///
/// # Errors
/// When the file or the computed hand cannot be had.
pub fn resolve_hand(spec: &HandSourceSpec, scene: &Scene) -> Result<Vec<Motion>, HandFault> {
    match spec {
        HandSourceSpec::Csv(path) => Ok(read_csv(path)?
            .hands
            .into_iter()
            .map(Motion::Track)
            .collect()),
        HandSourceSpec::Synthetic { spec, .. } => {
            let hand = plan(spec, &SceneInfo::from(scene))?;
            Ok(vec![Motion::Synthetic(Box::new(hand))])
        }
    }
}

/// The hands of several specs, with ids from 0 in this order and names of their own.
///
/// # Errors
/// Every hand that cannot be had.
pub fn resolve_all(
    specs: &[HandSourceSpec],
    scene: &Scene,
) -> Result<Vec<RunHand>, Vec<HandFault>> {
    let mut hands: Vec<RunHand> = Vec::new();
    let mut faults = Vec::new();
    for spec in specs {
        let motions = match resolve_hand(spec, scene) {
            Ok(motions) => motions,
            Err(fault) => {
                faults.push(fault);
                continue;
            }
        };
        let is_pair = motions.len() > 1;
        for motion in motions {
            let side = motion.side();
            let name = if is_pair {
                format!("{spec}:{}", side.name())
            } else {
                spec.to_string()
            };
            let (id, name) = (HandId(hands.len() as u32), unused(name, &hands));
            hands.push(RunHand {
                id,
                name,
                model: HandModel::adult(side),
                motion,
            });
        }
    }
    if faults.is_empty() {
        Ok(hands)
    } else {
        Err(faults)
    }
}

impl RunHand {
    /// Its sample at a world time, in seconds; `None` where it is not tracked.
    pub fn sample_at(&self, time_s: f64) -> Option<HandSample> {
        self.motion.sample_at(time_s, Outside::NoSample)
    }

    /// World time of its last sample, in seconds.
    pub fn end_s(&self) -> f64 {
        self.motion.end_s()
    }
}

/// That name, numbered where another hand carries it.
fn unused(name: String, hands: &[RunHand]) -> String {
    let n_before = hands.iter().filter(|hand| hand.name == name).count();
    if n_before == 0 {
        name
    } else {
        unused(format!("{name}#{}", n_before + 1), hands)
    }
}

fn read_csv(path: &Path) -> Result<HandTrack, HandFault> {
    let file = path.display().to_string();
    let unreadable = |source| HandFault::Unreadable {
        file: file.clone(),
        source,
    };
    let about = std::fs::metadata(path).map_err(unreadable)?;
    // A pipe or a device: reading it may never end.
    if !about.is_file() {
        return Err(unreadable(std::io::Error::other("it is no file")));
    }
    let bytes = about.len();
    if bytes > FILE_BYTES_MAX {
        return Err(HandFault::TooLarge { file, bytes });
    }
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    hand_csv::read(&text).map_err(|mistakes| HandFault::Mistakes { file, mistakes })
}
