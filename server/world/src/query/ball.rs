//! A moving ball against a shape: the first touch with a face, an edge or a vertex, in closed form
//! (Ericson 2005, §5.5.6: the path of the centre against each triangle grown by the radius).

use nalgebra::{Point3, Vector3};

use super::clip::height;
use super::is_few_planes;
use super::point::{PointEntry, signed_distance};
use crate::polyhedron::Polyhedron;
use crate::polyhedron::tolerances::ON_SURFACE_M;

/// See [`super::point::sweep_point`]; `radius` is positive, so the grown solid has round edges.
pub(super) fn sweep(
    shape: &Polyhedron,
    from: &Point3<f64>,
    to: &Point3<f64>,
    radius: f64,
) -> Option<PointEntry> {
    let along = to - from;
    let stays_before =
        |plane: &[f64; 4]| height(plane, from) >= radius && height(plane, to) >= radius;
    if !shape.aabb().meets_segment(from, &along, radius)
        || (is_few_planes(shape) && shape.planes().iter().any(stays_before))
    {
        return None;
    }
    let start = signed_distance(shape, from);
    if start.distance < radius - ON_SURFACE_M {
        return None;
    }
    if start.distance <= radius && (from - start.on_surface).dot(&along) < 0.0 {
        return Some(PointEntry {
            face: start.face,
            fraction: 0.0,
            point: start.on_surface,
        });
    }
    let mut best: Option<(Touch, u32)> = None;
    shape
        .triangle_tree()
        .on_segment(from, &along, radius, |triangle| {
            let normal = &shape.normals().triangles[triangle as usize];
            let Some(touch) = touch_triangle(
                from,
                &along,
                radius,
                &shape.triangle_corners(triangle),
                normal,
            ) else {
                return;
            };
            let key = (touch.fraction, triangle);
            if best.as_ref().is_none_or(|(b, t)| key < (b.fraction, *t)) {
                best = Some((touch, triangle));
            }
        });
    let (touch, triangle) = best?;
    let face = shape.triangles()[triangle as usize].face;
    Some(PointEntry {
        face,
        fraction: touch.fraction,
        point: touch.point,
    })
}

#[derive(Clone, Copy)]
struct Touch {
    fraction: f64,
    point: Point3<f64>,
}

fn touch_triangle(
    from: &Point3<f64>,
    along: &Vector3<f64>,
    radius: f64,
    corners: &[Point3<f64>; 3],
    normal: &Vector3<f64>,
) -> Option<Touch> {
    if let Some(touch) = touch_face(from, along, radius, corners, normal) {
        return Some(touch);
    }
    let mut best: Option<Touch> = None;
    for k in 0..3 {
        let (a, b) = (&corners[k], &corners[(k + 1) % 3]);
        for touch in [
            touch_side(from, along, radius, a, b),
            touch_corner(from, along, radius, a),
        ] {
            best = match (best, touch) {
                (Some(old), Some(new)) if old.fraction <= new.fraction => Some(old),
                (old, new) => new.or(old),
            };
        }
    }
    best
}

fn touch_face(
    from: &Point3<f64>,
    along: &Vector3<f64>,
    radius: f64,
    corners: &[Point3<f64>; 3],
    normal: &Vector3<f64>,
) -> Option<Touch> {
    let (start, speed) = (normal.dot(&(from - corners[0])), normal.dot(along));
    if start < radius || speed >= 0.0 {
        return None;
    }
    let fraction = (radius - start) / speed;
    if fraction >= 1.0 {
        return None;
    }
    let point = from + along * fraction - normal * radius;
    let is_left_of = |k: usize| {
        (corners[(k + 1) % 3] - corners[k])
            .cross(&(point - corners[k]))
            .dot(normal)
            >= 0.0
    };
    (0..3).all(is_left_of).then_some(Touch { fraction, point })
}

fn touch_side(
    from: &Point3<f64>,
    along: &Vector3<f64>,
    radius: f64,
    a: &Point3<f64>,
    b: &Point3<f64>,
) -> Option<Touch> {
    let direction = (b - a).try_normalize(f64::MIN_POSITIVE)?;
    let start = from - a;
    let across = |v: &Vector3<f64>| v - direction * direction.dot(v);
    let fraction = first_within(&across(&start), &across(along), radius)?;
    let on_side = direction.dot(&(start + along * fraction));
    (0.0..=(b - a).dot(&direction))
        .contains(&on_side)
        .then(|| Touch {
            fraction,
            point: a + direction * on_side,
        })
}

fn touch_corner(
    from: &Point3<f64>,
    along: &Vector3<f64>,
    radius: f64,
    corner: &Point3<f64>,
) -> Option<Touch> {
    let fraction = first_within(&(from - corner), along, radius)?;
    Some(Touch {
        fraction,
        point: *corner,
    })
}

/// The fraction, below 1, at which `start + fraction · along` comes within `radius` of the origin from outside.
fn first_within(start: &Vector3<f64>, along: &Vector3<f64>, radius: f64) -> Option<f64> {
    let (a, b, c) = (
        along.norm_squared(),
        start.dot(along),
        start.norm_squared() - radius * radius,
    );
    let discriminant = b * b - a * c;
    if c < 0.0 || b >= 0.0 || discriminant <= 0.0 {
        return None;
    }
    // c / (-b + root) is the smaller root without cancellation.
    let fraction = c / (discriminant.sqrt() - b);
    (fraction < 1.0).then_some(fraction)
}
