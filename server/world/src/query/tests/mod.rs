//! Queries by values and by laws.

mod laws;
mod values;

use nalgebra::{Point3, Vector3};

use crate::polyhedron::Polyhedron;
use crate::polyhedron::shapes::{cuboid, ellipsoid, l_shape, prism, pyramid};
use crate::polyhedron::tests::frame;

/// Shapes of all kinds, about 0.1 to 4 m large.
fn shapes() -> Vec<Polyhedron> {
    vec![
        cuboid(&Vector3::new(1.0, 1.5, 2.0)).unwrap(),
        pyramid(2.0, 1.0, 1.5).unwrap(),
        ellipsoid(&Vector3::new(1.0, 0.7, 1.2)).unwrap(),
        prism(5, 1.0, 1.0).unwrap(),
        // Convex, but too many faces for the plane walk.
        prism(150, 1.0, 1.0).unwrap(),
        l_shape(2.0, 1.5, 1.0, 0.5).unwrap(),
        frame(),
    ]
}

/// Whether the point is inside, by the sum of solid angles (van Oosterom & Strackee 1983): nothing in common with the
/// code under test.
fn is_inside(shape: &Polyhedron, p: &Point3<f64>) -> bool {
    let angle = |t: u32| {
        let [a, b, c] = shape.triangle_corners(t).map(|v| v - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * libm::atan2(a.dot(&b.cross(&c)), below)
    };
    (0..shape.triangles().len() as u32).map(angle).sum::<f64>() > 2.0 * core::f64::consts::PI
}
