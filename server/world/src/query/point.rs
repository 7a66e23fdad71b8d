//! A point and a shape: how deep it lies, and where its path goes in.

use nalgebra::Point3;

use super::clip::{clip, height};
use super::crossing::{Crossing, Passage, SAME_PLACE};
use super::nearest::{nearest, nearest_of_visible};
use super::{NO_FACE, ball, is_few_planes};
use crate::polyhedron::Polyhedron;
use crate::polyhedron::tolerances::ON_SURFACE_M;

/// How far a point is from a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointDistance {
    /// Distance from the surface in metres; negative inside.
    pub distance: f64,
    /// The face of the nearest surface point: inside, the face of least penetration depth.
    pub face: u32,
    /// The nearest surface point, in the shape's space.
    pub on_surface: Point3<f64>,
}

/// Where a path enters a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointEntry {
    /// The face that the path crosses.
    pub face: u32,
    /// Fraction of the path, 0 to 1.
    pub fraction: f64,
    /// The surface point touched, in the shape's space (with a radius: where the ball touches).
    pub point: Point3<f64>,
}

/// Signed distance of `p` from the shape. Exact for convex and other shapes; where several faces are equally near,
/// the lowest (up to rounding) is named.
pub fn signed_distance(shape: &Polyhedron, p: &Point3<f64>) -> PointDistance {
    if is_few_planes(shape) {
        let (distance, face) = highest_plane(shape.planes(), p);
        if distance <= 0.0 {
            let normal = shape.faces()[face as usize].normal;
            return PointDistance {
                distance,
                face,
                on_surface: p - normal * distance,
            };
        }
        let found = nearest_of_visible(shape, p);
        let face = shape.triangles()[found.triangle as usize].face;
        return PointDistance {
            distance: found.distance_squared.sqrt(),
            face,
            on_surface: found.point,
        };
    }
    let found = nearest(shape, p);
    let face = shape.triangles()[found.triangle as usize].face;
    let is_inside = (p - found.point).dot(&found.sign_normal(shape)) < 0.0;
    let distance = found.distance_squared.sqrt();
    PointDistance {
        distance: if is_inside { -distance } else { distance },
        face,
        on_surface: found.point,
    }
}

/// Whether `p` lies deeper than `depth` metres (0 or more) inside the shape; quicker than the distance where the
/// answer is no.
#[inline]
pub fn is_deeper(shape: &Polyhedron, p: &Point3<f64>, depth: f64) -> bool {
    if is_few_planes(shape) {
        return shape.planes().iter().all(|plane| height(plane, p) < -depth);
    }
    shape.aabb().distance_squared(p) == 0.0 && signed_distance(shape, p).distance < -depth
}

/// The first place where the straight path enters the solid, or the solid grown by `radius` metres (0 or more).
///
/// `None` if the path starts inside (deeper than [`ON_SURFACE_M`]) or never enters. A path that starts on the surface
/// and goes in enters at 0; one that ends on the surface or only touches an edge or vertex has not entered. A path
/// that enters and leaves again is found; one through an edge or vertex enters by one of its faces.
pub fn sweep_point(
    shape: &Polyhedron,
    from: &Point3<f64>,
    to: &Point3<f64>,
    radius: f64,
) -> Option<PointEntry> {
    if radius > 0.0 {
        return ball::sweep(shape, from, to, radius);
    }
    if is_few_planes(shape) {
        let inside = clip(shape.planes(), from, to, ON_SURFACE_M)?;
        let (face, fraction) = (inside.enter_face, inside.enter);
        return (face != NO_FACE).then(|| PointEntry {
            face,
            fraction,
            point: from + (to - from) * fraction,
        });
    }
    sweep_through_triangles(shape, from, to)
}

/// The greatest height over a plane, and the lowest face that has it.
#[inline]
fn highest_plane(planes: &[[f64; 4]], p: &Point3<f64>) -> (f64, u32) {
    let mut best = (f64::NEG_INFINITY, NO_FACE);
    for (face, plane) in (0_u32..).zip(planes) {
        let h = height(plane, p);
        if h > best.0 {
            best = (h, face);
        }
    }
    best
}

fn sweep_through_triangles(
    shape: &Polyhedron,
    from: &Point3<f64>,
    to: &Point3<f64>,
) -> Option<PointEntry> {
    let along = to - from;
    if !shape
        .aabb()
        .grown(ON_SURFACE_M)
        .meets_segment(from, &along, 0.0)
    {
        return None;
    }
    let passage = Passage::new(from, to)?;
    let mut next = passage.next(shape, None);
    let start = signed_distance(shape, from);
    if start.distance < -ON_SURFACE_M {
        return None;
    }
    let at = |fraction: f64| from + along * fraction;
    let is_inside = |fraction: f64| signed_distance(shape, &at(fraction)).distance < 0.0;
    let entry = |face: u32, fraction: f64| {
        Some(PointEntry {
            face,
            fraction,
            point: at(fraction),
        })
    };
    let middle =
        |since: f64, next: Option<Crossing>| 0.5 * (since + next.map_or(1.0, |c| c.fraction));
    if start.distance <= ON_SURFACE_M {
        let later = skip_place(shape, &passage, next, 0.0).1;
        let goes_in = shape.faces()[start.face as usize].normal.dot(&along) < 0.0;
        if goes_in && is_inside(middle(0.0, later)) {
            return entry(start.face, 0.0);
        }
    }
    while let Some(first) = next {
        let (place, later) = skip_place(shape, &passage, next, first.fraction);
        next = later;
        // Where the path goes through an edge with one face toward it and one away, only what follows can tell.
        if place.enters
            && first.fraction < 1.0
            && (!place.leaves || is_inside(middle(first.fraction, later)))
        {
            return entry(place.face, first.fraction);
        }
    }
    None
}

/// All crossings at one place of the path.
struct Place {
    enters: bool,
    leaves: bool,
    /// Lowest face entered.
    face: u32,
}

/// Gathers the crossings from `next` on that lie at `fraction`, and gives the first one past them.
fn skip_place(
    shape: &Polyhedron,
    passage: &Passage,
    mut next: Option<Crossing>,
    fraction: f64,
) -> (Place, Option<Crossing>) {
    let mut place = Place {
        enters: false,
        leaves: false,
        face: NO_FACE,
    };
    while let Some(c) = next.filter(|c| c.fraction <= fraction + SAME_PLACE) {
        if c.enters {
            place.enters = true;
            place.face = place.face.min(c.face);
        } else {
            place.leaves = true;
        }
        next = passage.next(shape, Some(&c));
    }
    (place, next)
}
