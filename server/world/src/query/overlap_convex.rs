//! Two convex solids, by the separating axis theorem: some face normal, or some cross product of an edge of each,
//! separates them if anything does; the axis of least overlap is the shortest way out.

use nalgebra::{Isometry3, Vector3};

use super::overlap::Overlap;
use crate::polyhedron::tolerances::{FACE_PREFERENCE, TOUCH_M};
use crate::polyhedron::{Edge, Polyhedron};

/// Edges with a smaller squared sine between them add no axis that the faces have not.
const PARALLEL_SQUARED: f64 = 1e-12;

/// See [`super::overlap::overlap`].
pub(super) fn overlap(
    a: &Polyhedron,
    b: &Polyhedron,
    a_from_b: &Isometry3<f64>,
) -> Option<Overlap> {
    let b_from_a = a_from_b.inverse();
    let out_of_a = least_over_faces(a, b, a_from_b)?;
    let out_of_b = least_over_faces(b, a, &b_from_a)?;
    let faces = if out_of_a.depth <= out_of_b.depth {
        out_of_a
    } else {
        Overlap {
            depth: out_of_b.depth,
            normal: -(a_from_b * out_of_b.normal),
        }
    };
    let (share, less) = FACE_PREFERENCE;
    match least_over_edges(a, b, a_from_b) {
        Axis::Separates => None,
        Axis::Overlaps(edges) if edges.depth < faces.depth * share - less => Some(edges),
        _ => Some(faces),
    }
}

/// The face of `a` out of which `b` comes soonest; `None` if a face has all of `b` before it.
fn least_over_faces(a: &Polyhedron, b: &Polyhedron, a_from_b: &Isometry3<f64>) -> Option<Overlap> {
    let mut least = Overlap {
        depth: f64::INFINITY,
        normal: Vector3::zeros(),
    };
    let into_b = a_from_b.rotation.inverse().to_rotation_matrix();
    let offset = a_from_b.translation.vector;
    for face in a.faces() {
        let normal = into_b * face.normal;
        let lowest = b
            .vertices()
            .iter()
            .map(|p| normal.dot(&p.coords))
            .fold(f64::INFINITY, f64::min);
        let depth = face.offset - face.normal.dot(&offset) - lowest;
        if depth <= TOUCH_M {
            return None;
        }
        if depth < least.depth {
            least = Overlap {
                depth,
                normal: face.normal,
            };
        }
    }
    Some(least)
}

enum Axis {
    /// An axis has the solids apart.
    Separates,
    /// The axis of least overlap.
    Overlaps(Overlap),
    /// No pair of edges makes a face of the Minkowski difference.
    Nothing,
}

/// Only pairs of edges whose arcs cross on the Gauss map can be the nearest pair (Gregorius, GDC 2013, "The Separating
/// Axis Test between Convex Polyhedra"); for those the support points are the edges themselves.
fn least_over_edges(a: &Polyhedron, b: &Polyhedron, a_from_b: &Isometry3<f64>) -> Axis {
    let rotation = a_from_b.rotation.to_rotation_matrix();
    let normal = |shape: &Polyhedron, edge: &Edge, side: usize| {
        shape.faces()[edge.faces[side] as usize].normal
    };
    let mut least = Axis::Nothing;
    for edge_b in b.edges() {
        let direction_b = rotation * edge_b.direction;
        let (c, d) = (
            -(rotation * normal(b, edge_b, 0)),
            -(rotation * normal(b, edge_b, 1)),
        );
        let point_b = a_from_b * b.points()[edge_b.vertices[0] as usize];
        for edge_a in a.edges() {
            let (c_a, d_a) = (c.dot(&edge_a.direction), d.dot(&edge_a.direction));
            if c_a * d_a >= 0.0 {
                continue;
            }
            let a_b = normal(a, edge_a, 0).dot(&direction_b);
            let b_b = normal(a, edge_a, 1).dot(&direction_b);
            if a_b * b_b >= 0.0 || c_a * b_b <= 0.0 {
                continue;
            }
            let axis = edge_a.direction.cross(&direction_b);
            let square = axis.norm_squared();
            if square < PARALLEL_SQUARED {
                continue;
            }
            let point_a = a.points()[edge_a.vertices[0] as usize];
            let outward = axis
                / if axis.dot(&point_a.coords) < 0.0 {
                    -square.sqrt()
                } else {
                    square.sqrt()
                };
            let depth = outward.dot(&(point_a - point_b));
            if depth <= TOUCH_M {
                return Axis::Separates;
            }
            if !matches!(least, Axis::Overlaps(ref best) if best.depth <= depth) {
                least = Axis::Overlaps(Overlap {
                    depth,
                    normal: outward,
                });
            }
        }
    }
    least
}
