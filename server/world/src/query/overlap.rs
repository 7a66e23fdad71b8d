//! Two solids: do they interpenetrate, and which way out.

use nalgebra::{Isometry3, Vector3};

use super::{overlap_convex, overlap_mesh};
use crate::polyhedron::Polyhedron;
use crate::polyhedron::tolerances::{MAX_EDGE_PAIRS, TOUCH_M};

/// How two solids interpenetrate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// How far the second must move along `normal` to come out, in metres; more than [`TOUCH_M`].
    pub depth: f64,
    /// Unit direction, in the first shape's space, in which the second comes out soonest.
    pub normal: Vector3<f64>,
}

/// The overlap of `a` with `b`, whose pose in a's space is given; `None` if they are apart or touch no deeper than
/// [`TOUCH_M`].
///
/// Exact, and the shortest way out, for two convex solids. If one is not convex, the way out is the sum of pushes
/// out of the locally deepest places (see `overlap_mesh.rs`): right for bodies on or in the notch of others, an
/// estimate for bodies deep inside each other or through each other.
pub fn overlap(a: &Polyhedron, b: &Polyhedron, a_from_b: &Isometry3<f64>) -> Option<Overlap> {
    let reach = a.bounding_radius() + b.bounding_radius();
    let offset = &a_from_b.translation.vector;
    if offset.norm_squared() >= reach * reach
        || a.aabb().distance_squared(&(*offset).into()) >= square(b)
    {
        return None;
    }
    if a.is_convex() && b.is_convex() && a.edges().len() * b.edges().len() <= MAX_EDGE_PAIRS {
        return overlap_convex::overlap(a, b, a_from_b);
    }
    if !b.aabb().moved(a_from_b).grown(-TOUCH_M).meets(a.aabb()) {
        return None;
    }
    overlap_mesh::overlap(a, b, a_from_b)
}

fn square(shape: &Polyhedron) -> f64 {
    shape.bounding_radius() * shape.bounding_radius()
}
