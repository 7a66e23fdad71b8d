//! Two solids of which one is not convex.
//!
//! Solids interpenetrate where an edge of one runs through the inside of the other. The place where an edge of one
//! lies deepest in the other gives a push: to the surface point nearest to it. The second solid is pushed, asked
//! again, and so on until it is out; the sum of the pushes is the answer. In a notch it is pushed out of the floor
//! and out of the wall, and the sum is the way out of both:
//!
//! ```text
//!     |##|        |##|  +-
//!     |#+|--      |##|  |         sum of pushes: up out of the floor, right out of the wall
//!     |#+|##  ->  |##|  +-
//!     |#####      |#####
//! ```
//!
//! Solids whose edges only run along each other's faces (two bars of one thickness that cross at one height) share
//! a part with no edge inside; its middle is then found from the edges' parts on both surfaces.

use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use super::crossing::Passage;
use super::is_few_planes;
use super::overlap::Overlap;
use super::point::{PointDistance, is_deeper, signed_distance};
use super::segment_depth::deepest_on_segment;
use crate::polyhedron::Polyhedron;
use crate::polyhedron::tolerances::TOUCH_M;

/// Pushes after which the sum so far is the answer: a body in a corner needs three.
const MAX_PUSHES: usize = 8;
/// Places per edge that are asked for the middle of a part without edges inside.
const PLACES_PER_EDGE: u32 = 8;

/// See [`super::overlap::overlap`].
pub(super) fn overlap(
    a: &Polyhedron,
    b: &Polyhedron,
    a_from_b: &Isometry3<f64>,
) -> Option<Overlap> {
    let Some(first) = deepest(a, b, a_from_b) else {
        return middle(a, b, a_from_b);
    };
    let mut sum = first.normal * first.depth;
    for _ in 1..MAX_PUSHES {
        let pose = Translation3::from(sum) * a_from_b;
        let Some(push) = deepest(a, b, &pose) else {
            break;
        };
        sum += push.normal * push.depth;
    }
    let depth = sum.norm();
    // Pushes that cancel (a body in a slot too narrow for it) leave the first.
    Some(if depth > TOUCH_M {
        Overlap {
            depth,
            normal: sum / depth,
        }
    } else {
        first
    })
}

/// The push out of the deepest place of an edge of one in the other.
fn deepest(a: &Polyhedron, b: &Polyhedron, a_from_b: &Isometry3<f64>) -> Option<Overlap> {
    let b_from_a = a_from_b.inverse();
    let of_b = deepest_edge(a, b, a_from_b);
    let of_a = deepest_edge(b, a, &b_from_a).map(|o| Overlap {
        normal: -(a_from_b * o.normal),
        ..o
    });
    match (of_b, of_a) {
        (Some(x), Some(y)) => Some(if y.depth > x.depth { y } else { x }),
        (x, y) => x.or(y),
    }
}

/// The deepest place in `a` of an edge of `b`, if deeper than touching.
fn deepest_edge(a: &Polyhedron, b: &Polyhedron, a_from_b: &Isometry3<f64>) -> Option<Overlap> {
    let room = a.aabb().grown(-TOUCH_M);
    let mut best: Option<Overlap> = None;
    for edge in b.edges() {
        let [from, to] = edge.vertices.map(|v| a_from_b * b.points()[v as usize]);
        if !room.meets_segment(&from, &(to - from), 0.0) {
            continue;
        }
        if !is_few_planes(a) && !goes_inside(a, &from, &to) {
            continue;
        }
        let floor = best.map_or(TOUCH_M, |o| o.depth);
        let found = deepest_on_segment(a, &from, &to, floor);
        if found.depth > floor {
            best = Some(Overlap {
                depth: found.depth,
                normal: found.way_out / found.depth,
            });
        }
    }
    best
}

/// Whether the segment has a place deeper than touching: its ends, and between any two neighbouring crossings of the
/// surface the middle, are asked. Much quicker than the depth for edges that run along a face.
fn goes_inside(shape: &Polyhedron, from: &Point3<f64>, to: &Point3<f64>) -> bool {
    let is_deep = |fraction: f64| is_deeper(shape, &(from + (to - from) * fraction), TOUCH_M);
    if is_deep(0.0) || is_deep(1.0) {
        return true;
    }
    let Some(passage) = Passage::new(from, to) else {
        return false;
    };
    let mut since = 0.0;
    let mut next = passage.next(shape, None);
    while let Some(crossing) = next {
        if crossing.fraction > since && is_deep(0.5 * (since + crossing.fraction)) {
            return true;
        }
        since = crossing.fraction;
        next = passage.next(shape, Some(&crossing));
    }
    is_deep(0.5 * (since + 1.0))
}

/// The overlap at the middle of all edge places of each that are in or on the other.
fn middle(a: &Polyhedron, b: &Polyhedron, a_from_b: &Isometry3<f64>) -> Option<Overlap> {
    let b_from_a = a_from_b.inverse();
    let (mut sum, mut n) = places_on(a, b, a_from_b);
    let of_a = places_on(b, a, &b_from_a);
    sum += a_from_b.rotation * of_a.0 + a_from_b.translation.vector * of_a.1;
    n += of_a.1;
    if n == 0.0 {
        return None;
    }
    let place = Point3::from(sum / n);
    let (in_a, in_b) = (
        signed_distance(a, &place),
        signed_distance(b, &(b_from_a * place)),
    );
    let is_in = |found: &PointDistance| found.distance < -TOUCH_M;
    let normal = a.faces()[in_a.face as usize].normal;
    (is_in(&in_a) && is_in(&in_b)).then_some(Overlap {
        depth: -in_a.distance - in_b.distance,
        normal,
    })
}

/// Sum and number of the places on edges of `b` that are in or on `a`, in a's space.
fn places_on(a: &Polyhedron, b: &Polyhedron, a_from_b: &Isometry3<f64>) -> (Vector3<f64>, f64) {
    let room = a.aabb().grown(TOUCH_M);
    let (mut sum, mut n) = (Vector3::zeros(), 0.0);
    for edge in b.edges() {
        let [from, to] = edge.vertices.map(|v| a_from_b * b.points()[v as usize]);
        for k in 0..=PLACES_PER_EDGE {
            let place = from + (to - from) * (f64::from(k) / f64::from(PLACES_PER_EDGE));
            if room.distance_squared(&place) == 0.0
                && signed_distance(a, &place).distance <= TOUCH_M
            {
                sum += place.coords;
                n += 1.0;
            }
        }
    }
    (sum, n)
}
