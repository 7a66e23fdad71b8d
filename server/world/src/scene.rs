//! What a run starts from: objects, surroundings, step length. All validation happens in [`scene::Scene::validate`].

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};
use thiserror::Error;

use crate::polyhedron::Polyhedron;

/// Slowest step rate, in steps per second.
pub const RATE_HZ_MIN: f64 = 1.0;
/// Fastest step rate, in steps per second.
pub const RATE_HZ_MAX: f64 = 4000.0;
/// Most objects of a scene. A bound, so that no client can grow the world without end.
pub const OBJECTS_MAX: usize = 100_000;
/// Farthest coordinate, in metres: beyond it positions lose their micrometres.
pub const COORDINATE_MAX_M: f64 = 1.0e4;
/// Strongest gravity along an axis, in m/s²: 100 times that of the earth.
pub const GRAVITY_MAX: f64 = 1.0e3;
/// Longest throw window, in seconds.
pub const THROW_WINDOW_MAX_S: f64 = 0.5;

/// How a touched object moves: one closed set, one stage of the step each.
///
/// `hybrid` and `physics` will stand here, behind the same [`World::step`](crate::World::step).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Model {
    /// Funahashi et al. 1998, to the letter.
    #[default]
    Paper,
}

impl Model {
    /// Every model that is built.
    pub const ALL: [Self; 1] = [Self::Paper];

    /// The name in files, on the command line and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
        }
    }

    /// The model of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|model| model.name() == name)
    }
}

/// Everything that a run starts from.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The scene's name, for people.
    pub name: String,
    /// How touched objects move.
    pub model: Model,
    /// Steps per second, 1 to 4000. The step length is its inverse.
    pub rate_hz: f64,
    /// Gravity in m/s², world space (y up), each number within 1000; it must not point upward.
    pub gravity: Vector3<f64>,
    /// Height of the floor's plane, in metres.
    pub floor_height: f64,
    /// Grasp angle in radians, for objects that name none: least angle between two contact normals that
    /// makes a grasp. π/2 in the paper.
    pub grasp_angle: f64,
    /// Window in seconds over which the throw velocity is taken; 0 is one step, as in the paper.
    pub throw_window_s: f64,
    /// Seconds without a valid sample after which a hand is lost and lets go.
    pub tracking_grace_s: f64,
    /// The objects. Their index is the slot of their [`ObjectId`](crate::state::ObjectId).
    pub objects: Vec<ObjectSpec>,
    /// Targets to throw at.
    pub targets: Vec<Target>,
}

/// One rigid object.
#[derive(Clone, Debug)]
pub struct ObjectSpec {
    /// Its name, unique in the scene.
    pub name: String,
    /// Its solid; the origin of its space is its centre of gravity.
    pub shape: Arc<Polyhedron>,
    /// `world_from_object` at the start: where the centre of gravity is, and the rotation about it.
    pub pose: Isometry3<f64>,
    /// Its own grasp angle in radians; `None` takes the scene's.
    pub grasp_angle: Option<f64>,
    /// Density in kg/m³. `paper` knows no masses: it is there for models that do.
    pub density: f64,
    /// Colour for viewers: red, green, blue, 0 to 1.
    pub colour: [f32; 3],
}

/// A disc to throw at: hit when an object's centre of gravity passes through it.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Its name.
    pub name: String,
    /// Centre in metres, world space.
    pub centre: Point3<f64>,
    /// Unit normal, toward the thrower.
    pub normal: Vector3<f64>,
    /// Radius in metres.
    pub radius: f64,
}

/// What is wrong with a scene.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SceneFault {
    /// The step rate is out of bounds.
    #[error("rate_hz is {0}: it must be from {RATE_HZ_MIN} to {RATE_HZ_MAX} steps per second")]
    Rate(f64),
    /// Gravity is too strong, not finite, or points upward.
    #[error(
        "gravity is {0:?}: it must be within {GRAVITY_MAX} m/s², and its y must not be above 0"
    )]
    Gravity([f64; 3]),
    /// The floor is not at a finite height.
    #[error("floor_height is {0}: it must be within {COORDINATE_MAX_M} m")]
    Floor(f64),
    /// A grasp angle is out of bounds.
    #[error("{}grasp angle is {degrees}°: it must be above 0° and at most 180°", object_prefix(.object.as_ref()))]
    GraspAngle {
        /// The object, or `None` for the scene's own.
        object: Option<String>,
        /// The angle, in degrees.
        degrees: f64,
    },
    /// The throw window is out of bounds.
    #[error("throw_window_s is {0}: it must be from 0 to {THROW_WINDOW_MAX_S} s")]
    ThrowWindow(f64),
    /// The grace time is out of bounds.
    #[error("tracking_grace_s is {0}: it must be from 0 to 60 s")]
    Grace(f64),
    /// Two objects carry one name, or a name is empty.
    #[error("object name {0:?}: names must be there and be unique")]
    Name(String),
    /// An object's pose is not finite or too far away.
    #[error(
        "object {object:?}: its position {position:?} must be finite and within {COORDINATE_MAX_M} m"
    )]
    Pose {
        /// The object.
        object: String,
        /// Its centre of gravity, in metres.
        position: [f64; 3],
    },
    /// An object starts below the floor.
    #[error(
        "object {object:?}: it reaches {depth_m:.4} m below the floor; raise its position by as much"
    )]
    BelowFloor {
        /// The object.
        object: String,
        /// How far its deepest vertex is below the floor, in metres.
        depth_m: f64,
    },
    /// A density that is not above zero.
    #[error("object {object:?}: density {density} kg/m³ must be above 0")]
    Density {
        /// The object.
        object: String,
        /// The density.
        density: f64,
    },
    /// A target that cannot be hit.
    #[error("target {0:?}: centre and normal must be finite, the radius above 0")]
    Target(String),
    /// Too many objects.
    #[error("{0} objects: at most {OBJECTS_MAX}")]
    TooMany(usize),
}

fn object_prefix(object: Option<&String>) -> String {
    object.map_or_else(String::new, |name| format!("object {name:?}: "))
}

/// Share of a step that a time in seconds may be off a whole step by rounding: 0.29 s are 29 steps at 100 Hz.
const STEP_ROUNDING: f64 = 1.0e-6;
/// How far an object may start below the floor, in metres: what rounding of a position in a file costs.
const START_DEPTH_M: f64 = 1.0e-6;

impl Default for Scene {
    /// An empty desk: floor at 0, 240 steps per second, 9.81 m/s², grasp angle 90°.
    fn default() -> Self {
        Self {
            name: "empty".to_owned(),
            model: Model::Paper,
            rate_hz: 240.0,
            gravity: Vector3::new(0.0, -9.81, 0.0),
            floor_height: 0.0,
            grasp_angle: std::f64::consts::FRAC_PI_2,
            throw_window_s: 0.0,
            tracking_grace_s: 0.25,
            objects: Vec::new(),
            targets: Vec::new(),
        }
    }
}

impl Scene {
    /// Every fault of the scene; empty when it can be run.
    pub fn validate(&self) -> Vec<SceneFault> {
        let mut faults = Vec::new();
        if !(RATE_HZ_MIN..=RATE_HZ_MAX).contains(&self.rate_hz) {
            faults.push(SceneFault::Rate(self.rate_hz));
        }
        if !self.gravity.iter().all(|x| x.abs() <= GRAVITY_MAX) || self.gravity.y > 0.0 {
            faults.push(SceneFault::Gravity(self.gravity.into()));
        }
        if !within_reach(self.floor_height) {
            faults.push(SceneFault::Floor(self.floor_height));
        }
        if !is_grasp_angle(self.grasp_angle) {
            faults.push(SceneFault::GraspAngle {
                object: None,
                degrees: self.grasp_angle.to_degrees(),
            });
        }
        if !(0.0..=THROW_WINDOW_MAX_S).contains(&self.throw_window_s) {
            faults.push(SceneFault::ThrowWindow(self.throw_window_s));
        }
        if !(0.0..=60.0).contains(&self.tracking_grace_s) {
            faults.push(SceneFault::Grace(self.tracking_grace_s));
        }
        if self.objects.len() > OBJECTS_MAX {
            faults.push(SceneFault::TooMany(self.objects.len()));
        }
        let mut names: Vec<&str> = self
            .objects
            .iter()
            .map(|object| object.name.as_str())
            .collect();
        names.sort_unstable();
        for pair in names.windows(2).filter(|pair| pair[0] == pair[1]) {
            faults.push(SceneFault::Name(pair[0].to_owned()));
        }
        for object in &self.objects {
            object.validate(self.floor_height, &mut faults);
        }
        for target in &self.targets {
            let finite = target
                .centre
                .iter()
                .chain(target.normal.iter())
                .all(|x| x.is_finite());
            if !finite
                || (target.normal.norm() - 1.0).abs() > 1.0e-6
                || target.radius.is_nan()
                || target.radius <= 0.0
            {
                faults.push(SceneFault::Target(target.name.clone()));
            }
        }
        faults
    }

    /// Positions that a touched object keeps: as many as the throw window has steps, plus one.
    pub fn track_length(&self) -> usize {
        (self.throw_window_s * self.rate_hz - STEP_ROUNDING).ceil() as usize + 1
    }

    /// Steps without a sample after which a hand is not lost yet: whole ones within the grace time.
    pub fn grace_steps(&self) -> u64 {
        (self.tracking_grace_s * self.rate_hz + STEP_ROUNDING).floor() as u64
    }

    /// Grasp angle of an object in this scene, radians: its own, or else the scene's.
    pub fn grasp_angle_of(&self, object: &ObjectSpec) -> f64 {
        object.grasp_angle.unwrap_or(self.grasp_angle)
    }

    /// Seconds per step.
    pub fn step_length_s(&self) -> f64 {
        1.0 / self.rate_hz
    }
}

impl ObjectSpec {
    /// Appends every fault of this object in a scene with that floor.
    pub fn validate(&self, floor_height: f64, faults: &mut Vec<SceneFault>) {
        if self.name.is_empty() {
            faults.push(SceneFault::Name(self.name.clone()));
        }
        if let Some(angle) = self.grasp_angle
            && !is_grasp_angle(angle)
        {
            faults.push(SceneFault::GraspAngle {
                object: Some(self.name.clone()),
                degrees: angle.to_degrees(),
            });
        }
        if !(self.density > 0.0 && self.density.is_finite()) {
            faults.push(SceneFault::Density {
                object: self.name.clone(),
                density: self.density,
            });
        }
        let position = self.pose.translation.vector;
        let rotation_ok = (self.pose.rotation.norm() - 1.0).abs() < 1.0e-6;
        if !position.iter().all(|x| within_reach(*x)) || !rotation_ok {
            faults.push(SceneFault::Pose {
                object: self.name.clone(),
                position: position.into(),
            });
            return;
        }
        let lowest = self
            .shape
            .vertices()
            .iter()
            .map(|v| (self.pose * v).y)
            .fold(f64::INFINITY, f64::min);
        if lowest < floor_height - START_DEPTH_M {
            faults.push(SceneFault::BelowFloor {
                object: self.name.clone(),
                depth_m: floor_height - lowest,
            });
        }
    }
}

fn within_reach(coordinate: f64) -> bool {
    coordinate.abs() <= COORDINATE_MAX_M
}

fn is_grasp_angle(angle: f64) -> bool {
    angle > 0.0 && angle <= std::f64::consts::PI
}
