//! The triangles of a shape and who lies beside whom, before coplanar neighbours become faces.
//!
//! Side `3 t + k` is the side of triangle `t` from its corner `k` to the next; its twin is the same edge as the
//! neighbouring triangle sees it.

use nalgebra::{Point3, Vector3};

use super::check::newell;
use super::fault::ShapeFault;
use super::tolerances::COPLANAR_DISTANCE;
use super::triangulate::triangulate;

/// Triangles with their neighbours.
pub(super) struct Mesh {
    pub(super) points: Vec<Point3<f64>>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Per triangle: the patch it belongs to. A patch's triangles are consecutive.
    pub(super) patch_of: Vec<u32>,
    /// Per patch: a flat piece that is never divided, an author's planar polygon or one triangle of a bent one.
    pub(super) patches: Vec<Patch>,
    /// Per side: the same edge seen from the neighbour.
    pub(super) twins: Vec<u32>,
}

/// A flat piece of surface.
pub(super) struct Patch {
    /// Unit outward normal.
    pub(super) normal: Vector3<f64>,
    /// Square metres.
    pub(super) area: f64,
    /// Its triangles.
    pub(super) triangles: std::ops::Range<u32>,
}

/// The side that follows `side` in its triangle.
pub(super) const fn next(side: u32) -> u32 {
    if side % 3 == 2 { side - 2 } else { side + 1 }
}

impl Mesh {
    /// Cuts checked polygons (closed, consistent, not degenerate) into triangles. `size` is the shape's, in metres.
    pub(super) fn new(points: Vec<Point3<f64>>, faces: &[Vec<u32>], size: f64) -> Self {
        let mut mesh = Self {
            points,
            triangles: vec![],
            patch_of: vec![],
            patches: vec![],
            twins: vec![],
        };
        // Ends, then the polygon if the side is a cut inside it (cuts of two polygons may share their ends).
        let mut sides: Vec<([u32; 2], u32, u32)> = Vec::new();
        for (face, ids) in (0_u32..).zip(faces) {
            let first = mesh.triangles.len() as u32;
            let cuts = mesh.add_polygon(ids, size);
            let side = |t: u32, cut: &[usize; 3], k: usize| {
                let (i, j) = (cut[k], cut[(k + 1) % 3]);
                let owner = if (i + 1) % ids.len() == j {
                    u32::MAX
                } else {
                    face
                };
                (
                    [ids[i].min(ids[j]), ids[i].max(ids[j])],
                    owner,
                    3 * t + k as u32,
                )
            };
            sides.extend(
                (first..)
                    .zip(&cuts)
                    .flat_map(|(t, cut)| [0, 1, 2].map(|k| side(t, cut, k))),
            );
        }
        sides.sort_unstable();
        mesh.twins = vec![0; sides.len()];
        for pair in sides.chunks_exact(2) {
            mesh.twins[pair[0].2 as usize] = pair[1].2;
            mesh.twins[pair[1].2 as usize] = pair[0].2;
        }
        mesh
    }

    fn add_polygon(&mut self, ids: &[u32], size: f64) -> Vec<[usize; 3]> {
        let twice_area = newell(&self.points, ids);
        let normal = twice_area.normalize();
        let cuts = triangulate(&self.points, ids, &normal);
        let heights = ids
            .iter()
            .map(|&i| normal.dot(&self.points[i as usize].coords));
        let (lo, hi) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), h| {
            (lo.min(h), hi.max(h))
        });
        let first = self.triangles.len() as u32;
        self.triangles
            .extend(cuts.iter().map(|cut| cut.map(|i| ids[i])));
        let end = self.triangles.len() as u32;
        let planar = ids.len() == 3 || hi - lo <= COPLANAR_DISTANCE * size;
        if planar {
            let area = twice_area.norm() * 0.5;
            self.patch_of
                .resize(end as usize, self.patches.len() as u32);
            self.patches.push(Patch {
                normal,
                area,
                triangles: first..end,
            });
            return cuts;
        }
        for t in first..end {
            let twice_area = newell(&self.points, &self.triangles[t as usize]);
            let area = twice_area.norm() * 0.5;
            let normal = twice_area
                .try_normalize(f64::MIN_POSITIVE)
                .unwrap_or(normal);
            self.patch_of.push(self.patches.len() as u32);
            self.patches.push(Patch {
                normal,
                area,
                triangles: t..t + 1,
            });
        }
        cuts
    }

    /// Refuses a vertex in which two fans of triangles meet.
    pub(super) fn no_pinched_vertex(&self) -> Result<(), ShapeFault> {
        let mut n_corners = vec![0_u32; self.points.len()];
        let mut a_side = vec![u32::MAX; self.points.len()];
        for (side, &vertex) in (0_u32..).zip(self.triangles.iter().flatten()) {
            n_corners[vertex as usize] += 1;
            a_side[vertex as usize] = side;
        }
        for (vertex, (&n, &first)) in n_corners.iter().zip(&a_side).enumerate() {
            let (mut side, mut walked) = (first, 0);
            while n > 0 && walked <= n {
                // The twin of a side that leaves the vertex arrives at it; the next one leaves it again.
                side = next(self.twins[side as usize]);
                walked += 1;
                if side == first {
                    break;
                }
            }
            if walked != n {
                return Err(ShapeFault::PinchedVertex {
                    vertex: vertex as u32,
                });
            }
        }
        Ok(())
    }
}
