//! Normals that tell inside from outside at every feature of the triangle mesh.
//!
//! Baerentzen & Aanaes 2005, "Signed distance computation using the angle weighted pseudonormal": the sign of the
//! distance is that of the vector from the nearest surface point against the normal of the feature it lies on:
//! the triangle's own, the sum of both at a side, the sum weighted by the angles at a corner.

use nalgebra::{Point3, Vector3};

use super::Face;
use super::mesh::Mesh;

/// The normals, by triangle, by side (three per triangle) and by point. Sides and points are not of unit length.
#[derive(Clone, Debug)]
pub(crate) struct SignNormals {
    pub(crate) triangles: Vec<Vector3<f64>>,
    pub(crate) sides: Vec<[Vector3<f64>; 3]>,
    pub(crate) points: Vec<Vector3<f64>>,
}

impl SignNormals {
    pub(super) fn new(mesh: &Mesh, faces: &[Face], face_of: &[u32]) -> Self {
        let corners = |t: usize| mesh.triangles[t].map(|v| mesh.points[v as usize]);
        let own = |t: usize| {
            let [a, b, c] = corners(t);
            let flat = faces[face_of[t] as usize].normal;
            (b - a)
                .cross(&(c - a))
                .try_normalize(f64::MIN_POSITIVE)
                .unwrap_or(flat)
        };
        let triangles: Vec<Vector3<f64>> = (0..mesh.triangles.len()).map(own).collect();
        let side =
            |t: usize, k: usize| triangles[t] + triangles[mesh.twins[3 * t + k] as usize / 3];
        let sides = (0..triangles.len())
            .map(|t| [side(t, 0), side(t, 1), side(t, 2)])
            .collect();
        let mut points = vec![Vector3::zeros(); mesh.points.len()];
        for (t, ids) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = corners(t);
            for (id, angle) in
                ids.iter()
                    .zip([angle(&a, &b, &c), angle(&b, &c, &a), angle(&c, &a, &b)])
            {
                points[*id as usize] += triangles[t] * angle;
            }
        }
        Self {
            triangles,
            sides,
            points,
        }
    }
}

/// Angle at `o` between the directions to `p` and `q`, in radians.
fn angle(o: &Point3<f64>, p: &Point3<f64>, q: &Point3<f64>) -> f64 {
    let (u, v) = (p - o, q - o);
    libm::atan2(u.cross(&v).norm(), u.dot(&v))
}
