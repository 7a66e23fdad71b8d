//! The author's polygons as they come: every fault that can be named in the author's own indices.

use nalgebra::{Point3, Vector3};

use super::aabb::Aabb;
use super::fault::ShapeFault;
use super::tolerances::{
    DEGENERATE_THICKNESS, MAX_FACES, MAX_POLYGON_CORNERS, MAX_SIZE_M, MAX_TRIANGLES, MAX_VERTICES,
    MIN_SIZE_M,
};

/// Checks counts, numbers and indices; gives the size of the shape (diagonal of its box) in metres.
pub(super) fn size(vertices: &[Point3<f64>], faces: &[Vec<u32>]) -> Result<f64, ShapeFault> {
    counts(vertices, faces)?;
    if let Some(vertex) = vertices
        .iter()
        .position(|p| !p.coords.iter().all(|x| x.is_finite()))
    {
        return Err(ShapeFault::NotFinite {
            vertex: vertex as u32,
        });
    }
    for (face, ids) in faces.iter().enumerate() {
        if let Some(&index) = ids.iter().find(|&&i| i as usize >= vertices.len()) {
            return Err(ShapeFault::IndexOutOfRange {
                face: face as u32,
                index,
            });
        }
    }
    let aabb = Aabb::of(faces.iter().flatten().map(|&i| vertices[i as usize]));
    let largest = aabb.lo.coords.amax().max(aabb.hi.coords.amax());
    let size = (aabb.hi - aabb.lo).norm();
    let (min, max) = (MIN_SIZE_M, MAX_SIZE_M);
    if size < min || largest > max {
        return Err(ShapeFault::SizeOutOfRange {
            size: if largest > max { largest } else { size },
            min,
            max,
        });
    }
    Ok(size)
}

fn counts(vertices: &[Point3<f64>], faces: &[Vec<u32>]) -> Result<(), ShapeFault> {
    if faces.is_empty() {
        return Err(ShapeFault::Empty);
    }
    if vertices.len() > MAX_VERTICES {
        return Err(ShapeFault::TooManyVertices {
            count: vertices.len(),
            limit: MAX_VERTICES,
        });
    }
    if faces.len() > MAX_FACES {
        return Err(ShapeFault::TooManyFaces {
            count: faces.len(),
            limit: MAX_FACES,
        });
    }
    for (face, ids) in faces.iter().enumerate() {
        if ids.len() < 3 {
            return Err(ShapeFault::DegenerateFace { face: face as u32 });
        }
        if ids.len() > MAX_POLYGON_CORNERS {
            let (count, limit) = (ids.len(), MAX_POLYGON_CORNERS);
            return Err(ShapeFault::TooManyCorners {
                face: face as u32,
                count,
                limit,
            });
        }
    }
    let n_triangles: usize = faces.iter().map(|ids| ids.len() - 2).sum();
    if n_triangles > MAX_TRIANGLES {
        return Err(ShapeFault::TooManyFaces {
            count: n_triangles,
            limit: MAX_TRIANGLES,
        });
    }
    Ok(())
}

/// Twice the area of the polygon along its normal (Newell's sum), taken about its first corner.
pub(super) fn newell(points: &[Point3<f64>], ids: &[u32]) -> Vector3<f64> {
    let origin = points[ids[0] as usize];
    let corner = |i: u32| points[i as usize] - origin;
    ids.windows(2).fold(Vector3::zeros(), |sum, pair| {
        sum + corner(pair[0]).cross(&corner(pair[1]))
    })
}

/// Refuses polygons with a corner twice or without area.
pub(super) fn no_degenerate_face(
    points: &[Point3<f64>],
    faces: &[Vec<u32>],
    size: f64,
) -> Result<(), ShapeFault> {
    for (face, ids) in faces.iter().enumerate() {
        let mut sorted = ids.clone();
        sorted.sort_unstable();
        let longest = Aabb::of(ids.iter().map(|&i| points[i as usize]));
        let thin = DEGENERATE_THICKNESS * size * (longest.hi - longest.lo).norm();
        if sorted.windows(2).any(|pair| pair[0] == pair[1]) || newell(points, ids).norm() <= thin {
            return Err(ShapeFault::DegenerateFace { face: face as u32 });
        }
    }
    Ok(())
}

/// One side of one polygon.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// Lower and higher vertex.
    ends: [u32; 2],
    face: u32,
    /// Whether the polygon runs from the lower to the higher.
    forward: bool,
}

/// Refuses what is not one closed, consistently oriented surface.
pub(super) fn one_closed_surface(faces: &[Vec<u32>]) -> Result<(), ShapeFault> {
    let mut sides = Vec::with_capacity(faces.iter().map(Vec::len).sum());
    for (face, ids) in faces.iter().enumerate() {
        for (k, &from) in ids.iter().enumerate() {
            let to = ids[(k + 1) % ids.len()];
            sides.push(Side {
                ends: [from.min(to), from.max(to)],
                face: face as u32,
                forward: from < to,
            });
        }
    }
    sides.sort_unstable();
    let mut part_of: Vec<u32> = (0..faces.len() as u32).collect();
    for group in sides.chunk_by(|a, b| a.ends == b.ends) {
        let vertices = group[0].ends;
        match group {
            [only] => {
                return Err(ShapeFault::OpenEdge {
                    vertices,
                    face: only.face,
                });
            }
            [a, b] if a.forward == b.forward => {
                return Err(ShapeFault::InconsistentOrientation {
                    vertices,
                    faces: [a.face, b.face],
                });
            }
            [a, b] => join(&mut part_of, a.face, b.face),
            more => {
                return Err(ShapeFault::NonManifoldEdge {
                    vertices,
                    face: more[0].face,
                    n_faces: more.len(),
                });
            }
        }
    }
    let roots: Vec<u32> = (0..faces.len() as u32)
        .map(|f| root(&mut part_of, f))
        .collect();
    let n_parts = roots
        .iter()
        .enumerate()
        .filter(|&(f, &r)| f as u32 == r)
        .count();
    match roots.iter().position(|&r| r != roots[0]) {
        Some(face) => Err(ShapeFault::Disconnected {
            n_parts,
            face: face as u32,
        }),
        None => Ok(()),
    }
}

/// The lowest face of the part that `face` belongs to (union-find with halved paths).
fn root(part_of: &mut [u32], mut face: u32) -> u32 {
    while part_of[face as usize] != face {
        part_of[face as usize] = part_of[part_of[face as usize] as usize];
        face = part_of[face as usize];
    }
    face
}

fn join(part_of: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(part_of, a), root(part_of, b));
    part_of[a.max(b) as usize] = a.min(b);
}
