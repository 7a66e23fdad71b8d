//! From a loaded scene to what an epoch begins with.

use thiserror::Error;
use tsukamu_proto::v1;
use tsukamu_world::World;
use tsukamu_world::step::SceneFaults;

use crate::convert::scene::scene;
use crate::offline::hands::{HandFault, resolve_all};
use crate::scene_file::LoadedScene;
use crate::scene_file::hands::HandSourceSpec;
use crate::ticker::request::Plan;

/// Why an epoch cannot begin.
#[derive(Debug, Error)]
pub enum PlanFault {
    /// The scene cannot be run.
    #[error(transparent)]
    Scene(#[from] SceneFaults),
    /// Hands cannot be had.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Hands(Vec<HandFault>),
}

/// Which hands drive a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cast<'a> {
    /// Its own; with them it may begin again when they are through.
    Default {
        /// Whether it does.
        repeats: bool,
    },
    /// These.
    Named(&'a [HandSourceSpec]),
    /// None but those of devices and clients.
    Nobody,
}

/// What an epoch of this scene begins with. Reads files of hand motion: not for async code.
///
/// # Errors
/// When the scene cannot be run or a hand cannot be had.
pub fn plan(loaded: &LoadedScene, cast: Cast<'_>) -> Result<Plan, PlanFault> {
    let (specs, repeats) = match cast {
        Cast::Default { repeats } => (loaded.default_hands.as_slice(), repeats),
        Cast::Named(specs) => (specs, false),
        Cast::Nobody => (&[][..], false),
    };
    let hands = resolve_all(specs, &loaded.scene).map_err(PlanFault::Hands)?;
    let record = v1::SceneRecord {
        epoch: 0,
        scene: Some(scene(&loaded.scene)),
        source_text: loaded.source_text.clone(),
        ..v1::SceneRecord::default()
    };
    let world = Box::new(World::new(loaded.scene.clone())?);
    Ok(Plan {
        world,
        record,
        hands,
        repeats,
        playback: None,
    })
}
