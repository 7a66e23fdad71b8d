//! Synthetic hands: computed motions of the paper's operations (Funahashi et al. 1998, §5.2), planned on the scene that
//! they act in. Smooth, seeded, left or right, adult.
//!
//! A plan is made once from where the objects are; the hand does not watch what becomes of them.

mod channel;
mod hand;
mod operations;
mod poses;
mod posture;
mod script;
mod spec;
mod thing;
mod throw;
mod variation;

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};
use thiserror::Error;
use tsukamu_world::hand::joint::Side;
use tsukamu_world::polyhedron::Polyhedron;
use tsukamu_world::scene::{Scene, Target};

pub use hand::SyntheticHand;
pub use spec::{PARAMETERS, Spec, SpecFault};

use script::Script;
use thing::Thing;

/// What a synthetic hand does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Name {
    /// Operation 1: free manipulation.
    Free,
    /// Operation 2: a grasp without the thumb.
    NoThumb,
    /// Operation 3: a flick with a fingertip.
    Flick,
    /// Operation 4: grasp and throw.
    GraspThrow,
    /// Operation 5: stacking.
    Stack,
    /// Experiment 2: throwing at a target.
    TargetGame,
    /// All together.
    Demo,
    /// The poses of a glove's calibration.
    Poses,
}

impl Name {
    /// The name after `synthetic:`.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::NoThumb => "no-thumb",
            Self::Flick => "flick",
            Self::GraspThrow => "grasp-throw",
            Self::Stack => "stack",
            Self::TargetGame => "target-game",
            Self::Demo => "demo",
            Self::Poses => "poses",
        }
    }
}

/// One synthetic hand as it is listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Known {
    /// Its name.
    pub name: Name,
    /// What it does, in one line.
    pub about: &'static str,
}

/// All synthetic hands, in the order in which they are listed.
pub const fn names() -> &'static [Known] {
    const KNOWN: [Known; 8] = [
        Known {
            name: Name::Free,
            about: "grasps an object, carries it round, sets it down and pushes it with a fingertip",
        },
        Known {
            name: Name::NoThumb,
            about: "holds an object between index and middle finger, the thumb away",
        },
        Known {
            name: Name::Flick,
            about: "flicks an object away with the index finger",
        },
        Known {
            name: Name::GraspThrow,
            about: "grasps an object and throws it",
        },
        Known {
            name: Name::Stack,
            about: "stacks three objects",
        },
        Known {
            name: Name::TargetGame,
            about: "throws an object through a target",
        },
        Known {
            name: Name::Demo,
            about: "moves, stacks and throws objects, again and again",
        },
        Known {
            name: Name::Poses,
            about: "holds the poses of a glove's calibration: flat, fist, thumb across, spread",
        },
    ];
    &KNOWN
}

/// What a plan needs to know of a scene.
#[derive(Clone, Debug)]
pub struct SceneInfo {
    /// The objects.
    pub objects: Vec<ObjectInfo>,
    /// Height of the floor's plane, metres.
    pub floor_height: f64,
    /// In m/s², world space.
    pub gravity: Vector3<f64>,
    /// Targets to throw at.
    pub targets: Vec<Target>,
}

/// What a plan needs to know of an object.
#[derive(Clone, Debug)]
pub struct ObjectInfo {
    /// Its name.
    pub name: String,
    /// Its solid.
    pub shape: Arc<Polyhedron>,
    /// `world_from_object`.
    pub pose: Isometry3<f64>,
}

impl From<&Scene> for SceneInfo {
    fn from(scene: &Scene) -> Self {
        let objects = scene.objects.iter().map(|object| ObjectInfo {
            name: object.name.clone(),
            shape: Arc::clone(&object.shape),
            pose: object.pose,
        });
        Self {
            objects: objects.collect(),
            floor_height: scene.floor_height,
            gravity: scene.gravity,
            targets: scene.targets.clone(),
        }
    }
}

/// Why a motion cannot be planned.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum PlanFault {
    /// The hand's name or a parameter of it.
    #[error(transparent)]
    Spec(#[from] SpecFault),
    /// No object of the name asked for.
    #[error("{hand}: the scene has no object {object:?}; it has {known}")]
    NoSuchObject {
        /// The motion.
        hand: &'static str,
        /// What was asked for.
        object: String,
        /// The scene's objects.
        known: String,
    },
    /// The object asked for is not one that the hand can take as the motion needs it.
    #[error("{hand}: object {object:?} {reason}")]
    Unfit {
        /// The motion.
        hand: &'static str,
        /// The object.
        object: String,
        /// What is the matter.
        reason: &'static str,
    },
    /// Too few objects that fit.
    #[error("{hand}: it needs {wanted} and the scene has {found}")]
    TooFew {
        /// The motion.
        hand: &'static str,
        /// What it needs.
        wanted: &'static str,
        /// How many of them there are.
        found: usize,
    },
    /// A target is needed.
    #[error("{0}: the scene has no [[target]] to throw at")]
    NoTarget(&'static str),
}

/// Plans the motion that a text such as `synthetic:grasp-throw?object=cube&seed=3` names.
///
/// # Errors
/// When the text names none, or the scene does not have what the motion needs.
pub fn build(spec: &str, scene: &SceneInfo) -> Result<SyntheticHand, PlanFault> {
    plan(&Spec::parse(spec)?, scene)
}

/// Plans a motion.
///
/// # Errors
/// When the scene does not have what the motion needs.
pub fn plan(spec: &Spec, scene: &SceneInfo) -> Result<SyntheticHand, PlanFault> {
    let mirror = spec.side == Side::Left;
    let thing = |object: &ObjectInfo| {
        Thing::new(
            object.name.clone(),
            Arc::clone(&object.shape),
            object.pose,
            mirror,
        )
    };
    let things = scene.objects.iter().map(thing).collect();
    let script = Script::new(spec, things, scene.floor_height);
    match spec.name {
        Name::Free => operations::free(script, spec),
        Name::NoThumb => operations::no_thumb(script, spec),
        Name::Flick => operations::flick(script, spec),
        Name::GraspThrow => operations::grasp_throw(script, spec),
        Name::Stack => operations::stack(script, spec),
        Name::TargetGame => operations::target_game(script, spec, scene),
        Name::Demo => operations::demo(script, spec),
        Name::Poses => Ok(poses::poses(script, spec)),
    }
}
