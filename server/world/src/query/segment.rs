//! A segment and the edges it cuts off.

use nalgebra::{Point3, Vector3};

use super::clip::clip;
use super::crossing::{Passage, SAME_PLACE};
use super::{NO_FACE, is_few_planes};
use crate::polyhedron::Polyhedron;

/// An edge whose two faces a segment cuts with the solid between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeCut {
    /// The edge.
    pub edge: u32,
    /// The edge's point nearest to the segment, in the shape's space.
    pub on_edge: Point3<f64>,
    /// Where the segment is nearest to it, as a fraction from `a` to `b`.
    pub on_segment: f64,
}

/// Appends the edges cut by the segment from `a` to `b`: it enters the solid by one of the edge's faces and leaves it
/// next by the other. A segment that ends inside the solid cuts no edge there; nor does one that enters and leaves by
/// faces without a common edge. Of several edges that two faces share, the nearest counts.
pub fn segment_cuts(shape: &Polyhedron, a: &Point3<f64>, b: &Point3<f64>, out: &mut Vec<EdgeCut>) {
    if is_few_planes(shape) {
        let Some(inside) = clip(shape.planes(), a, b, 0.0) else {
            return;
        };
        if inside.enter_face != NO_FACE && inside.leave_face != NO_FACE {
            let edge = shape.pairs().edge(inside.enter_face, inside.leave_face);
            out.extend(edge.map(|edge| cut(shape, edge, a, b).0));
        }
        return;
    }
    if !shape.aabb().meets_segment(a, &(b - a), 0.0) {
        return;
    }
    let Some(passage) = Passage::new(a, b) else {
        return;
    };
    let mut entered_by = None;
    let mut next = passage.next(shape, None);
    while let Some(crossing) = next {
        if crossing.enters {
            entered_by = Some((crossing.face, crossing.fraction));
        } else if let Some((face, _)) = entered_by
            .take()
            .filter(|&(_, since)| crossing.fraction > since + SAME_PLACE)
        {
            out.extend(nearest_shared_edge(shape, face, crossing.face, a, b));
        }
        next = passage.next(shape, Some(&crossing));
    }
}

fn nearest_shared_edge(
    shape: &Polyhedron,
    f: u32,
    g: u32,
    a: &Point3<f64>,
    b: &Point3<f64>,
) -> Option<EdgeCut> {
    let mut best: Option<(EdgeCut, f64)> = None;
    for edge in shape.pairs().edges(f, g) {
        let (found, distance) = cut(shape, edge, a, b);
        if best.is_none_or(|(_, least)| distance < least) {
            best = Some((found, distance));
        }
    }
    best.map(|(found, _)| found)
}

/// The cut and the squared distance between edge and segment.
#[inline]
fn cut(shape: &Polyhedron, edge: u32, a: &Point3<f64>, b: &Point3<f64>) -> (EdgeCut, f64) {
    let [from, to] = shape.edge_ends(edge);
    let (along_edge, along_segment) = (to - from, b - a);
    let (s, t) = closest(&from, &along_edge, a, &along_segment);
    let on_edge = from + along_edge * s;
    let distance_squared = (a + along_segment * t - on_edge).norm_squared();
    (
        EdgeCut {
            edge,
            on_edge,
            on_segment: t,
        },
        distance_squared,
    )
}

/// Fractions of the closest points of the segments `p + s u` and `q + t v`, both of some length (Ericson 2005,
/// §5.1.9). Of parallel ones, the start of the first.
#[inline]
fn closest(p: &Point3<f64>, u: &Vector3<f64>, q: &Point3<f64>, v: &Vector3<f64>) -> (f64, f64) {
    let r = p - q;
    let (a, e, f) = (u.norm_squared(), v.norm_squared(), v.dot(&r));
    let (b, c) = (u.dot(v), u.dot(&r));
    let determinant = a * e - b * b;
    let s = if determinant > 0.0 {
        ((b * f - c * e) / determinant).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let t = (b * s + f) / e;
    if t < 0.0 {
        return ((-c / a).clamp(0.0, 1.0), 0.0);
    }
    if t > 1.0 {
        return (((b - c) / a).clamp(0.0, 1.0), 1.0);
    }
    (s, t)
}
