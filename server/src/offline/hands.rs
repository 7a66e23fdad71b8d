//! From a hand's spec to its motion.

use std::path::Path;

use tsukamu_motion::hand_csv;
use tsukamu_motion::mistake::ImportError;
use tsukamu_motion::track::{HandTrack, Outside, TrackFault, TrackHand};
use tsukamu_world::hand::sample::HandSample;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::state::HandId;

use crate::scene_file::LoadedScene;
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
    /// A computed hand cannot be made.
    #[error("{spec}: {why}")]
    Synthetic {
        /// The hand, as it was asked for.
        spec: String,
        /// Why.
        why: String,
    },
    /// A computed hand made no sound track.
    #[error("{spec}: {fault}")]
    Track {
        /// The hand, as it was asked for.
        spec: String,
        /// What is wrong with its track.
        fault: TrackFault,
    },
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
    pub motion: TrackHand,
}

/// The motion of one spec. Its times are world times: a sample at 0.5 s is applied half a second after the start.
///
/// # Errors
/// When the file or the computed hand cannot be had.
pub fn resolve_hand(spec: &HandSourceSpec, loaded: &LoadedScene) -> Result<HandTrack, HandFault> {
    match spec {
        HandSourceSpec::Csv(path) => read_csv(path),
        HandSourceSpec::Synthetic { name, params } => {
            let track = synthetic(name, params, loaded).map_err(|why| HandFault::Synthetic {
                spec: spec.to_string(),
                why,
            })?;
            track.validate().map_err(|fault| HandFault::Track {
                spec: spec.to_string(),
                fault,
            })?;
            Ok(track)
        }
    }
}

/// The hands of several specs, with ids from 0 in this order and names of their own.
///
/// # Errors
/// Every hand that cannot be had.
pub fn resolve_all(
    specs: &[HandSourceSpec],
    loaded: &LoadedScene,
) -> Result<Vec<RunHand>, Vec<HandFault>> {
    let mut hands: Vec<RunHand> = Vec::new();
    let mut faults = Vec::new();
    for spec in specs {
        match resolve_hand(spec, loaded) {
            Ok(track) => {
                let is_pair = track.hands.len() > 1;
                for motion in track.hands {
                    let name = if is_pair {
                        format!("{spec}:{}", motion.side.name())
                    } else {
                        spec.to_string()
                    };
                    let name = unused(name, &hands);
                    let model = HandModel::adult(motion.side);
                    hands.push(RunHand {
                        id: HandId(hands.len() as u32),
                        name,
                        model,
                        motion,
                    });
                }
            }
            Err(fault) => faults.push(fault),
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
        self.motion.times_s.last().copied().unwrap_or(0.0)
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
    let bytes = std::fs::metadata(path).map_err(unreadable)?.len();
    if bytes > FILE_BYTES_MAX {
        return Err(HandFault::TooLarge { file, bytes });
    }
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    hand_csv::read(&text).map_err(|mistakes| HandFault::Mistakes { file, mistakes })
}

/// A computed hand in this scene.
fn synthetic(
    name: &str,
    _params: &[(String, String)],
    _loaded: &LoadedScene,
) -> Result<HandTrack, String> {
    Err(format!("there is no synthetic hand {name:?} in this build"))
}
