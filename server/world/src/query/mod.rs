//! Questions about a polyhedron, all in its own space: lengths in metres, one question per file.
//!
//! Few-faced convex shapes are answered by their planes; all others by the tree over their triangles.

mod ball;
mod clip;
mod crossing;
mod nearest;
pub mod overlap;
mod overlap_convex;
mod overlap_mesh;
pub mod point;
pub mod segment;
pub mod segment_depth;
pub mod segment_sweep;

#[cfg(test)]
mod tests;

use crate::polyhedron::Polyhedron;
use crate::polyhedron::tolerances::MAX_PLANES_WALKED;

/// Stands for "no face" where a face id is expected.
const NO_FACE: u32 = u32::MAX;

/// Whether the shape is the intersection of few half-spaces.
#[inline]
fn is_few_planes(shape: &Polyhedron) -> bool {
    shape.is_convex() && shape.planes().len() <= MAX_PLANES_WALKED
}
