//! Volume, centre of gravity and inertia of a closed triangle mesh at uniform density.
//!
//! Sums over the tetrahedra that the triangles span with the origin: the volume integrals of Mirtich 1996 and
//! Eberly 2002 ("Polyhedral Mass Properties (Revisited)") in their symmetric form,
//! `∫ x xᵀ dV = det(a, b, c) / 120 · ((a+b+c)(a+b+c)ᵀ + a aᵀ + b bᵀ + c cᵀ)`.

use nalgebra::{Matrix3, Point3, Vector3};

/// Signed volume (cubic metres; negative if inside out) and centroid (NaN if the volume is 0) of the mesh.
/// `near` is a point near the mesh: taken as origin, it keeps the sums small.
pub(super) fn volume_and_centroid(
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    near: &Point3<f64>,
) -> (f64, Point3<f64>) {
    let (mut six_volumes, mut moment) = (0.0, Vector3::zeros());
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| points[i as usize] - near);
        let det = a.dot(&b.cross(&c));
        six_volumes += det;
        moment += (a + b + c) * det;
    }
    (six_volumes / 6.0, near + moment / (4.0 * six_volumes))
}

/// Inertia tensor about the origin for density 1 kg/m3, in kg m2 (that is m5).
pub(super) fn inertia(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Matrix3<f64> {
    let mut moments = Matrix3::zeros();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| points[i as usize].coords);
        let (det, sum) = (a.dot(&b.cross(&c)), a + b + c);
        let squares =
            sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose();
        moments += squares * (det / 120.0);
    }
    Matrix3::identity() * moments.trace() - moments
}
