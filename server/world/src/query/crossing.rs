//! Where a segment goes through the surface of any shape, without gaps between triangles.

use nalgebra::{Point3, Vector3};

use crate::polyhedron::Polyhedron;

/// Crossings closer than this, as a fraction of the segment, are one place (an edge or a vertex).
pub(super) const SAME_PLACE: f64 = 1e-12;

/// One passage through a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    /// Fraction of the segment, 0 to 1.
    pub(super) fraction: f64,
    pub(super) triangle: u32,
    pub(super) face: u32,
    /// Into the solid; otherwise out of it.
    pub(super) enters: bool,
}

/// A segment prepared for the watertight test of Woop, Benthin & Wald 2013 ("Watertight Ray/Triangle
/// Intersection"): space is sheared so that the segment runs along an axis; a point on a shared side or corner
/// hits each of its triangles.
pub(super) struct Passage {
    from: Point3<f64>,
    along: Vector3<f64>,
    axes: [usize; 3],
    shear: [f64; 3],
}

impl Passage {
    /// `None` for a segment without length.
    pub(super) fn new(from: &Point3<f64>, to: &Point3<f64>) -> Option<Self> {
        let along = to - from;
        let z = along.iamax();
        if along[z] == 0.0 {
            return None;
        }
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if along[z] < 0.0 {
            // Keeps the sense in which triangles run round.
            (x, y) = (y, x);
        }
        let shear = [along[x] / along[z], along[y] / along[z], 1.0 / along[z]];
        Some(Self {
            from: *from,
            along,
            axes: [x, y, z],
            shear,
        })
    }

    /// Fraction of the segment, and whether it goes against the triangle's normal.
    fn crosses(&self, corners: &[Point3<f64>; 3]) -> Option<(f64, bool)> {
        let [x, y, z] = self.axes;
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = corners.map(|p| {
            let p = p - self.from;
            [
                p[x] - self.shear[0] * p[z],
                p[y] - self.shear[1] * p[z],
                self.shear[2] * p[z],
            ]
        });
        let (u, v, w) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let fraction = (u * az + v * bz + w * cz) / det;
        (0.0..=1.0)
            .contains(&fraction)
            .then_some((fraction, det > 0.0))
    }

    /// The first crossing after the given one in the order of fraction, then triangle.
    pub(super) fn next(&self, shape: &Polyhedron, after: Option<&Crossing>) -> Option<Crossing> {
        let mut first: Option<Crossing> = None;
        let is_before =
            |f: f64, t: u32, c: &Crossing| f < c.fraction || (f == c.fraction && t < c.triangle);
        shape
            .triangle_tree()
            .on_segment(&self.from, &self.along, 0.0, |triangle| {
                let Some((fraction, enters)) = self.crosses(&shape.triangle_corners(triangle))
                else {
                    return;
                };
                let is_past = after
                    .is_none_or(|c| !is_before(fraction, triangle, c) && triangle != c.triangle);
                if is_past
                    && first
                        .as_ref()
                        .is_none_or(|c| is_before(fraction, triangle, c))
                {
                    let face = shape.triangles()[triangle as usize].face;
                    first = Some(Crossing {
                        fraction,
                        triangle,
                        face,
                        enters,
                    });
                }
            });
        first
    }
}
