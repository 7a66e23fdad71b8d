//! The surface point nearest to a point.

use nalgebra::{Point3, Vector3};

use crate::polyhedron::Polyhedron;

/// The part of a triangle a point lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Its inside.
    Inside,
    /// The side from this corner to the next.
    Side(usize),
    /// This corner.
    Corner(usize),
}

/// The nearest surface point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub(super) point: Point3<f64>,
    pub(super) distance_squared: f64,
    pub(super) triangle: u32,
    pub(super) part: Part,
}

impl Nearest {
    const NOTHING: Self = Self {
        point: Point3::new(0.0, 0.0, 0.0),
        distance_squared: f64::INFINITY,
        triangle: 0,
        part: Part::Inside,
    };

    /// The nearer of this and the triangle's nearest point; at equal distance the lower triangle.
    #[inline]
    fn or_triangle(self, shape: &Polyhedron, triangle: u32, p: &Point3<f64>) -> Self {
        let (point, part) = on_triangle(p, &shape.triangle_corners(triangle));
        let distance_squared = (p - point).norm_squared();
        let is_nearer = distance_squared < self.distance_squared
            || (distance_squared == self.distance_squared && triangle < self.triangle);
        if is_nearer {
            Self {
                point,
                distance_squared,
                triangle,
                part,
            }
        } else {
            self
        }
    }

    /// The normal (of any length) that tells inside from outside at this point.
    pub(super) fn sign_normal(&self, shape: &Polyhedron) -> Vector3<f64> {
        let (normals, t) = (shape.normals(), self.triangle as usize);
        match self.part {
            Part::Inside => normals.triangles[t],
            Part::Side(k) => normals.sides[t][k],
            Part::Corner(k) => normals.points[shape.triangles()[t].vertices[k] as usize],
        }
    }
}

/// The nearest point of the whole surface.
pub(super) fn nearest(shape: &Polyhedron, p: &Point3<f64>) -> Nearest {
    let mut best = Nearest::NOTHING;
    shape.triangle_tree().nearest(p, |triangle, _| {
        best = best.or_triangle(shape, triangle, p);
        best.distance_squared
    });
    best
}

/// The nearest surface point of a convex shape of few planes, for a point outside it: it lies on a face that the
/// point is in front of.
pub(super) fn nearest_of_visible(shape: &Polyhedron, p: &Point3<f64>) -> Nearest {
    let mut best = Nearest::NOTHING;
    for (plane, face) in shape.planes().iter().zip(shape.faces()) {
        if super::clip::height(plane, p) > 0.0 {
            best = face
                .triangles
                .clone()
                .fold(best, |best, t| best.or_triangle(shape, t, p));
        }
    }
    best
}

/// The point of a triangle nearest to `p` (Ericson 2005, §5.1.5). A triangle without area is its sides.
pub(super) fn on_triangle(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> (Point3<f64>, Part) {
    let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
    let (ab, ac) = (b - a, c - a);
    let (ap, bp, cp) = (p - a, p - b, p - c);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, Part::Corner(0));
    }
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, Part::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * share(d1, d1 - d3), Part::Side(0));
    }
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, Part::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * share(d2, d2 - d6), Part::Side(2));
    }
    let va = d3 * d6 - d5 * d4;
    let (e4, e5) = (d4 - d3, d5 - d6);
    if va <= 0.0 && e4 >= 0.0 && e5 >= 0.0 {
        return (b + (c - b) * share(e4, e4 + e5), Part::Side(1));
    }
    let whole = va + vb + vc;
    (
        a + ab * share(vb, whole) + ac * share(vc, whole),
        Part::Inside,
    )
}
