//! One measurement: a world of so many objects of which so many are held, stepped on one core.

use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Point3, Vector3};
use nix::time::{ClockId, clock_gettime};
use tsukamu_world::World;
use tsukamu_world::input::StepInput;
use tsukamu_world::polyhedron::fault::ShapeFault;
use tsukamu_world::polyhedron::{Polyhedron, shapes};
use tsukamu_world::scene::{ObjectSpec, Scene};
use tsukamu_world::state::ContactState;

use super::hands::{Script, object_place, script};

/// Steps per second of world time. It decides how far the hands move in a step, not how fast steps are made.
const RATE_HZ: f64 = 1000.0;
/// Edge of the cubes, metres.
const CUBE_M: f64 = 0.05;
/// Half axis of the ellipsoids (spheres of 32 faces), metres.
const ELLIPSOID_M: f64 = 0.03;
/// Distance between the centres of resting objects, metres.
const SPACING_M: f64 = 0.1;
/// Where the field of resting objects begins, metres from the hands along -z.
const FIELD_START_M: f64 = 0.3;

/// The shapes of the 1998 measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CostShape {
    /// 6 faces, 12 edges.
    Cube,
    /// 32 faces, 56 edges.
    Ellipsoid,
}

impl CostShape {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Cube, Self::Ellipsoid];

    /// The name in the report.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cube => "cube",
            Self::Ellipsoid => "ellipsoid",
        }
    }

    fn solid(self) -> Result<Polyhedron, ShapeFault> {
        match self {
            Self::Cube => shapes::cuboid(&Vector3::repeat(CUBE_M)),
            Self::Ellipsoid => shapes::ellipsoid(&Vector3::repeat(ELLIPSOID_M)),
        }
    }
}

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Load {
    /// Shape of every object.
    pub shape: CostShape,
    /// Objects in the world, the held ones among them.
    pub objects: usize,
    /// Objects held, each by a hand of its own; 0 to 2. Both hands are there in any case.
    pub held: usize,
}

/// How long it is measured.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Repeats, of which the median counts.
    pub n_repeats: usize,
    /// Least time of one repeat.
    pub repeat: Duration,
}

/// What a measurement found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Median over the repeats, steps per second of one core.
    pub steps_per_s: f64,
    /// Slowest repeat.
    pub slowest: f64,
    /// Fastest repeat.
    pub fastest: f64,
    /// Whether as many objects as wanted were held, and no others, in every step measured.
    pub holds: bool,
}

/// A world at the start of the load, and what its hands do.
///
/// # Errors
/// When a primitive or the scene is refused: a mistake of this file's constants.
pub fn prepare(load: Load) -> anyhow::Result<(World, Script)> {
    let shape = Arc::new(load.shape.solid()?);
    let height = -shape
        .vertices()
        .iter()
        .map(|vertex| vertex.y)
        .fold(0.0, f64::min);
    let place = |index: usize| match index.checked_sub(load.held) {
        None => object_place(index, height),
        Some(resting) => field_place(resting, load.objects - load.held, height),
    };
    let object = |index: usize| ObjectSpec {
        name: format!("object {index}"),
        shape: Arc::clone(&shape),
        pose: Isometry3::from(place(index).coords),
        grasp_angle: None,
        density: 500.0,
        colour: [0.5; 3],
    };
    let objects = (0..load.objects).map(object).collect();
    let mut world = World::new(Scene {
        rate_hz: RATE_HZ,
        objects,
        ..Scene::default()
    })?;
    let script = script(RATE_HZ, height);
    for input in &script.approach {
        world.step(input);
    }
    Ok((world, script))
}

/// Measures a load.
///
/// # Errors
/// As [`prepare`], or when the system has no clock of a thread's own time.
pub fn measure(load: Load, effort: Effort) -> anyhow::Result<Measured> {
    let (mut world, script) = prepare(load)?;
    let mut holds = true;
    // The first round is not timed: it fills the caches.
    holds &= round(&mut world, &script.round, load.held);
    let mut rates: Vec<f64> = (0..effort.n_repeats.max(1))
        .map(|_| {
            let (start, start_on_core) = (Instant::now(), core_time()?);
            let mut n_steps = 0;
            while n_steps == 0 || start.elapsed() < effort.repeat {
                holds &= round(&mut world, &script.round, load.held);
                n_steps += script.round.len();
            }
            Ok(n_steps as f64 / (core_time()? - start_on_core).as_secs_f64())
        })
        .collect::<Result<_, nix::Error>>()?;
    rates.sort_by(f64::total_cmp);
    let [slowest, median, fastest] =
        [0, rates.len() / 2, rates.len() - 1].map(|index| rates[index]);
    Ok(Measured {
        steps_per_s: median,
        slowest,
        fastest,
        holds,
    })
}

/// Time that this thread has had a core to itself: other programs on the machine take none of it.
fn core_time() -> Result<Duration, nix::Error> {
    clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).map(Duration::from)
}

/// Steps through a round; whether nothing was grasped or let go in it, and the right number is held at its end.
fn round(world: &mut World, inputs: &[StepInput], held: usize) -> bool {
    let mut steady = true;
    for input in inputs {
        let frame = world.step(input);
        steady &= frame
            .events
            .iter()
            .all(|event| !matches!(event.kind.name(), "grasped" | "released"));
    }
    steady && n_held(world) == held
}

/// Objects that are grasped now.
pub fn n_held(world: &World) -> usize {
    world
        .objects()
        .filter(|(_, body)| body.contact == ContactState::Grasped)
        .count()
}

/// The place of a resting object in a square field in front of the hands.
fn field_place(index: usize, count: usize, height: f64) -> Point3<f64> {
    let side = (count as f64).sqrt().ceil().max(1.0) as usize;
    let (row, column) = (index / side, index % side);
    let x = (column as f64 - (side - 1) as f64 / 2.0) * SPACING_M;
    Point3::new(x, height, -FIELD_START_M - row as f64 * SPACING_M)
}
