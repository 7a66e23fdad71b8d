//! Objects and the floor (Funahashi et al. 1998, §4.2; readings in model §7).
//!
//! ```text
//!            G ●                      Gm = P(t−Δt) − P(t−2Δt) + g Δt²
//!             / \  Gm = T + R         T along CG is dropped: it would slide or bounce
//!            /   v                    R turns the object about C
//!   ────────C─────────G′────          G′ is G projected onto the floor along Gm
//! ```

use nalgebra::{Isometry3, Point2, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use super::support::{Stance, convex_hull, stance, stance_over_side};
use crate::motion::inertia::unit;
use crate::motion::push::split;
use crate::polyhedron::Polyhedron;

/// Vertices within this height over the floor are on it, in metres. Rounding of poses is a thousand times smaller;
/// a larger value would flatten real tilts.
const ON_FLOOR_M: f64 = 1.0e-7;
/// A vertex nearer to the axis than this, in metres, cannot stop a turn about it.
const ON_AXIS_M: f64 = 1.0e-5;
/// Shortest R that turns anything, in metres: below it the object is balanced.
const BALANCED_M: f64 = 1.0e-13;
/// Least share of the way down in a direction that projects onto the floor.
const DOWNWARD: f64 = 1.0e-9;

/// What the floor does to one object in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// `world_from_object` after it.
    pub pose: Isometry3<f64>,
    /// What became of it.
    pub outcome: Outcome,
}

/// What becomes of an object at the floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It stands: G′ is inside the support polygon.
    Stable,
    /// Neither stable nor able to turn: balanced on a vertex or an edge, or wedged.
    Balanced,
    /// It topples.
    Toppling {
        /// 1, 2 or 3 (model §7).
        case: u8,
        /// Whether a further vertex came to the floor and stopped it.
        struck: bool,
    },
}

/// Memory that the floor uses again for every object.
#[derive(Clone, Debug, Default)]
pub struct FloorScratch {
    contacts: Vec<Point2<f64>>,
    hull: Vec<Point2<f64>>,
}

/// Height of the lowest vertex, in metres.
pub fn lowest(shape: &Polyhedron, world_from_object: &Isometry3<f64>) -> f64 {
    let up = world_from_object.rotation.inverse() * Vector3::y();
    let low = shape
        .vertices()
        .iter()
        .map(|v| up.dot(&v.coords))
        .fold(f64::INFINITY, f64::min);
    low + world_from_object.translation.vector.y
}

/// The pose moved up until its deepest vertex lies on the floor, if that was below it.
pub fn lifted(
    shape: &Polyhedron,
    world_from_object: &Isometry3<f64>,
    floor: f64,
) -> Isometry3<f64> {
    let depth = floor - lowest(shape, world_from_object);
    if depth > 0.0 {
        Translation3::new(0.0, depth, 0.0) * world_from_object
    } else {
        *world_from_object
    }
}

/// Whether an object in that pose is on the floor.
pub fn is_on(shape: &Polyhedron, world_from_object: &Isometry3<f64>, floor: f64) -> bool {
    lowest(shape, world_from_object) <= floor + ON_FLOOR_M
}

/// One step of an object that is on the floor: it stands, or topples by `gm`, the displacement that (3) predicts for
/// its centre of gravity in this step, in metres. `gravity` gives the direction of a projection where `gm` has none.
pub fn settle(
    shape: &Polyhedron,
    world_from_object: &Isometry3<f64>,
    gm: &Vector3<f64>,
    gravity: &Vector3<f64>,
    floor: f64,
    scratch: &mut FloorScratch,
) -> Settled {
    scratch.contacts.clear();
    for vertex in shape.vertices() {
        let vertex = world_from_object * vertex;
        if vertex.y <= floor + ON_FLOOR_M {
            scratch.contacts.push(Point2::new(vertex.x, vertex.z));
        }
    }
    convex_hull(&mut scratch.contacts, &mut scratch.hull);
    let g = Point3::from(world_from_object.translation.vector);
    let projected = project(&g, gm, gravity, floor);
    let first = stance(&scratch.contacts, &projected);
    let turned = turn_over(shape, world_from_object, gm, &first, floor);
    if turned.outcome != Outcome::Balanced || scratch.contacts.len() < 3 {
        return turned;
    }
    // Wedged over the two nearest corners: over the side that faces G′ it can turn.
    turn_over(
        shape,
        world_from_object,
        gm,
        &stance_over_side(&scratch.contacts, &projected),
        floor,
    )
}

/// G′: G projected onto the floor along `gm`, or along gravity where `gm` does not lead into the floor.
fn project(g: &Point3<f64>, gm: &Vector3<f64>, gravity: &Vector3<f64>, floor: f64) -> Point2<f64> {
    let leads_down = |direction: &Vector3<f64>| direction.y < -DOWNWARD * direction.norm();
    let direction = [gm, gravity]
        .into_iter()
        .find(|direction| leads_down(direction));
    let down = direction.map_or_else(|| -Vector3::y(), |direction| direction / -direction.y);
    let landing = g + down * (g.y - floor);
    Point2::new(landing.x, landing.z)
}

fn turn_over(
    shape: &Polyhedron,
    world_from_object: &Isometry3<f64>,
    gm: &Vector3<f64>,
    stance: &Stance,
    floor: f64,
) -> Settled {
    let g = Point3::from(world_from_object.translation.vector);
    let on_floor = |p: &Point2<f64>| Point3::new(p.x, floor, p.y);
    let (centre, push, case) = match stance {
        Stance::Stable => {
            return Settled {
                pose: *world_from_object,
                outcome: Outcome::Stable,
            };
        }
        Stance::OverVertex { vertex, case } => (on_floor(vertex), *gm, *case),
        Stance::OverEdge { ends, case } => {
            let axis = (on_floor(&ends[1]) - on_floor(&ends[0])).normalize();
            let start = on_floor(&ends[0]);
            let nearest = start + axis * (g - start).dot(&axis);
            (nearest, gm - axis * gm.dot(&axis), *case)
        }
    };
    let cg = g - centre;
    let across = split(&push, &cg).across;
    let Some(axis) =
        Unit::try_new(cg.cross(&across), f64::MIN_POSITIVE).filter(|_| across.norm() > BALANCED_M)
    else {
        return Settled {
            pose: *world_from_object,
            outcome: Outcome::Balanced,
        };
    };
    let wanted = libm::atan(across.norm() / cg.norm());
    let angle = free_angle(shape, world_from_object, &centre, &axis, wanted, floor);
    if angle <= 0.0 {
        return Settled {
            pose: *world_from_object,
            outcome: Outcome::Balanced,
        };
    }
    let rotation = UnitQuaternion::from_axis_angle(&axis, angle);
    let position = centre + rotation * cg;
    let pose = Isometry3::from_parts(
        Translation3::from(position),
        unit(rotation * world_from_object.rotation),
    );
    let outcome = Outcome::Toppling {
        case,
        struck: angle < wanted,
    };
    Settled {
        pose: lifted(shape, &pose, floor),
        outcome,
    }
}

/// The largest angle up to `wanted` by which the object can turn about the axis before a further vertex is on the floor.
fn free_angle(
    shape: &Polyhedron,
    world_from_object: &Isometry3<f64>,
    centre: &Point3<f64>,
    axis: &Unit<Vector3<f64>>,
    wanted: f64,
    floor: f64,
) -> f64 {
    let (sine, cosine) = (libm::sin(wanted), libm::cos(wanted));
    let mut angle = wanted;
    for vertex in shape.vertices() {
        // Height of the vertex over the floor at an angle: still + a cos + b sin.
        let arm = world_from_object * vertex - centre;
        let along = axis.into_inner() * arm.dot(axis);
        let out = arm - along;
        let (a, b) = (out.y, axis.cross(&out).y);
        let still = centre.y + along.y - floor;
        if still + a * cosine + b * sine >= 0.0 || out.norm() < ON_AXIS_M {
            continue;
        }
        if still + a <= ON_FLOOR_M {
            // On the floor already; it would go straight down.
            return 0.0;
        }
        let reach = libm::hypot(a, b);
        let first = libm::atan2(b, a) + libm::acos((-still / reach).clamp(-1.0, 1.0));
        let strikes = if first > std::f64::consts::PI {
            first - std::f64::consts::TAU
        } else {
            first
        };
        angle = angle.min(strikes.clamp(0.0, wanted));
    }
    angle
}
