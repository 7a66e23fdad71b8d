//! A moving segment and the edges it runs into.

use nalgebra::{Point3, Vector3};

use super::clip::height;
use crate::polyhedron::aabb::Aabb;
use crate::polyhedron::tolerances::{MAX_PLANES_MASKED, ON_SURFACE_M, PARALLEL_SINE, STEP_SLACK};
use crate::polyhedron::{Edge, Polyhedron};

/// An edge that a moving segment crosses into the solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeCross {
    /// The edge.
    pub edge: u32,
    /// Fraction of the step, 0 to 1.
    pub fraction: f64,
    /// Where on the edge, in the shape's space.
    pub on_edge: Point3<f64>,
    /// Where on the segment, as a fraction from its first end to its second.
    pub on_segment: f64,
}

/// Appends, by ascending edge, the convex edges that a segment crosses into the solid while its ends move straight
/// and evenly from `from` to `to`; each edge once, at its first crossing.
///
/// "Crosses into": at that moment the segment lies across the edge's wedge (neither both ways into it nor both ways
/// out), and its point at the edge moves inward along the common perpendicular of edge and segment. (That is the
/// sign of the velocity against the edge's normal, without the parts along edge and segment, which cross nothing.)
/// Reflex edges are left out: a segment reaches one only through a face. So are edges parallel to the segment at the
/// crossing.
pub fn sweep_segment(
    shape: &Polyhedron,
    from: [Point3<f64>; 2],
    to: [Point3<f64>; 2],
    out: &mut Vec<EdgeCross>,
) {
    let sweep = Sweep {
        from: from[0],
        span: from[1] - from[0],
        steps: [to[0] - from[0], to[1] - from[1]],
    };
    let corners = [from[0], from[1], to[0], to[1]];
    let around = Aabb::of(corners);
    if !around.meets(shape.aabb()) {
        return;
    }
    if shape.planes().len() <= MAX_PLANES_MASKED {
        let Some(straddled) = straddled_planes(shape, &corners) else {
            return;
        };
        for (id, edge) in (0_u32..).zip(shape.edges()) {
            let both = (1_u64 << edge.faces[0]) | (1_u64 << edge.faces[1]);
            if straddled & both == both {
                out.extend(sweep.crossing(shape, id, edge));
            }
        }
        return;
    }
    let first = out.len();
    shape.edge_tree().in_box(&around, |id| {
        out.extend(sweep.crossing(shape, id, &shape.edges()[id as usize]))
    });
    out[first..].sort_unstable_by_key(|c| c.edge);
}

/// The planes with some of the points on each side, as bits; `None` if one plane of a convex shape has all before it.
#[inline]
fn straddled_planes(shape: &Polyhedron, points: &[Point3<f64>; 4]) -> Option<u64> {
    let mut bits = 0_u64;
    for (face, plane) in shape.planes().iter().enumerate() {
        let [a, b, c, d] = points;
        let (from, to) = (height(plane, a), height(plane, b));
        let (from_now, to_now) = (height(plane, c), height(plane, d));
        let lo = from.min(to).min(from_now.min(to_now));
        let hi = from.max(to).max(from_now.max(to_now));
        if lo > ON_SURFACE_M {
            if shape.is_convex() {
                return None;
            }
        } else if hi >= -ON_SURFACE_M {
            bits |= 1 << face;
        }
    }
    Some(bits)
}

/// A segment whose ends move evenly over a step.
struct Sweep {
    /// First end at the start.
    from: Point3<f64>,
    /// From first to second end at the start.
    span: Vector3<f64>,
    /// How far each end moves.
    steps: [Vector3<f64>; 2],
}

impl Sweep {
    fn crossing(&self, shape: &Polyhedron, id: u32, edge: &Edge) -> Option<EdgeCross> {
        if !edge.is_convex {
            return None;
        }
        let start = shape.edge_ends(id)[0];
        let turn = self.steps[1] - self.steps[0];
        // Segment and edge are coplanar where det[span(t), direction, start - from(t)] = 0, with span and from linear.
        let (across, across_turn) = (
            self.span.cross(&edge.direction),
            turn.cross(&edge.direction),
        );
        let (gap, gap_change) = (start - self.from, -self.steps[0]);
        let constant = across.dot(&gap);
        let linear = across.dot(&gap_change) + across_turn.dot(&gap);
        let square = across_turn.dot(&gap_change);
        // Most segments move far less in a step than they are away from the edge.
        if constant.abs() > (linear.abs() + square.abs()) * (1.0 + 3.0 * STEP_SLACK) {
            return None;
        }
        roots(square, linear, constant)
            .into_iter()
            .filter(|t| (-STEP_SLACK..=1.0 + STEP_SLACK).contains(t))
            .find_map(|t| self.crossing_at(shape, (id, edge), &start, t.clamp(0.0, 1.0)))
    }

    fn crossing_at(
        &self,
        shape: &Polyhedron,
        (id, edge): (u32, &Edge),
        start: &Point3<f64>,
        fraction: f64,
    ) -> Option<EdgeCross> {
        let first = self.from + self.steps[0] * fraction;
        let span = self.span + (self.steps[1] - self.steps[0]) * fraction;
        let common = span.cross(&edge.direction);
        let (square, length_squared) = (common.norm_squared(), span.norm_squared());
        if square <= PARALLEL_SINE * PARALLEL_SINE * length_squared {
            return None;
        }
        let gap = start - first;
        let on_segment = gap.cross(&edge.direction).dot(&common) / square;
        let on_edge = gap.cross(&span).dot(&common) / square;
        let is_on_edge = (-ON_SURFACE_M..=edge.length + ON_SURFACE_M).contains(&on_edge);
        if !is_on_edge || !(-STEP_SLACK..=1.0 + STEP_SLACK).contains(&on_segment) {
            return None;
        }
        let [n0, n1] = edge.faces.map(|f| shape.faces()[f as usize].normal);
        // Out of one face and into the other: the segment lies across the wedge.
        if span.dot(&n0) * span.dot(&n1) > 0.0 {
            return None;
        }
        let outward = if common.dot(&(n0 + n1)) < 0.0 {
            -common
        } else {
            common
        };
        let velocity = self.steps[0] * (1.0 - on_segment) + self.steps[1] * on_segment;
        let on_edge = start + edge.direction * on_edge.clamp(0.0, edge.length);
        let on_segment = on_segment.clamp(0.0, 1.0);
        (velocity.dot(&outward) < 0.0).then_some(EdgeCross {
            edge: id,
            fraction,
            on_edge,
            on_segment,
        })
    }
}

/// The real roots of `a t² + b t + c`, ascending, where it changes sign; missing ones are not numbers. The larger root by
/// amount is computed first, the other from the product of both, so that no digits cancel.
fn roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant <= 0.0 {
        return [f64::NAN; 2];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let (large, small) = (q / a, c / q);
    if large < small {
        [large, small]
    } else {
        [small, large]
    }
}
