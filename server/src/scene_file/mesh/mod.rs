//! Meshes from files: OBJ, STL and glTF become solids, or are refused with file, fault and place.

pub mod fault;

mod gltf;
mod gltf_buffers;
mod obj;
mod stl;

#[cfg(test)]
mod tests;

use std::io::Read;
use std::path::Path;

use nalgebra::Point3;
use tsukamu_world::polyhedron::Polyhedron;
use tsukamu_world::polyhedron::tolerances::{MAX_FACES, MAX_VERTICES};
use tsukamu_world::polyhedron::weld::weld;

use fault::{MeshFault, MeshProblem};

/// Largest mesh file, in bytes; it is looked at before a byte is parsed.
pub const MESH_BYTES_MAX: u64 = 64 << 20;
/// Distance under which two corners are one vertex, as a share of the mesh's size. Files hold f32 or six digits.
const WELD_SHARE: f64 = 1.0e-6;

/// Corners and faces of a file, in its own unit. Faces run counter-clockwise seen from outside.
#[derive(Debug, Default)]
struct Soup {
    vertices: Vec<Point3<f64>>,
    faces: Vec<Vec<u32>>,
}

/// The solid in this file, `scale` metres per unit of the file.
///
/// # Errors
/// When the file cannot be read, is too large, is no mesh, or its mesh is no closed solid.
pub fn load(path: &Path, scale: f64) -> Result<Polyhedron, MeshFault> {
    let refuse = |problem| MeshFault {
        file: path.display().to_string(),
        problem,
    };
    let bytes = read_bounded(path).map_err(refuse)?;
    let extension = path
        .extension()
        .and_then(|end| end.to_str())
        .unwrap_or_default()
        .to_ascii_lowercase();
    let soup = match extension.as_str() {
        "obj" => obj::parse(&bytes),
        "stl" => stl::parse(&bytes),
        "gltf" | "glb" => gltf::parse(&bytes, path.parent().unwrap_or_else(|| Path::new(""))),
        _ => Err(MeshProblem::UnknownFormat { extension }),
    };
    soup.and_then(|soup| solid(&soup, scale)).map_err(refuse)
}

/// The whole file, unless it is larger than a mesh may be. A pipe or a device is none: reading it may never end.
fn read_bounded(path: &Path) -> Result<Vec<u8>, MeshProblem> {
    let unreadable = |source: std::io::Error| MeshProblem::Unreadable {
        why: source.to_string(),
    };
    let about = std::fs::metadata(path).map_err(unreadable)?;
    if !about.is_file() {
        return Err(MeshProblem::Unreadable {
            why: "it is no file".to_owned(),
        });
    }
    let mut bytes = Vec::new();
    // It may have grown since.
    let file = std::fs::File::open(path).map_err(unreadable)?;
    file.take(MESH_BYTES_MAX + 1)
        .read_to_end(&mut bytes)
        .map_err(unreadable)?;
    if bytes.len() as u64 > MESH_BYTES_MAX {
        let bytes = about.len().max(bytes.len() as u64);
        return Err(MeshProblem::TooLarge { bytes });
    }
    Ok(bytes)
}

/// Joins corners at one place, scales, and checks that the faces close a solid.
fn solid(soup: &Soup, scale: f64) -> Result<Polyhedron, MeshProblem> {
    let (vertices, stands_for) = weld(&soup.vertices, WELD_SHARE * diagonal(&soup.vertices));
    let vertices: Vec<Point3<f64>> = vertices.iter().map(|p| p * scale).collect();
    let faces: Vec<Vec<u32>> = soup
        .faces
        .iter()
        .map(|face| renamed(face, &stands_for))
        .collect();
    Polyhedron::from_faces(&vertices, &faces).map_err(MeshProblem::Shape)
}

/// Indices that do not exist are kept as they are: [`Polyhedron::from_faces`] names them.
fn renamed(face: &[u32], stands_for: &[u32]) -> Vec<u32> {
    face.iter()
        .map(|&corner| stands_for.get(corner as usize).copied().unwrap_or(corner))
        .collect()
}

/// Diagonal of the bounding box; 0 where it is not finite (then the shape is refused for that).
fn diagonal(vertices: &[Point3<f64>]) -> f64 {
    let Some(first) = vertices.first() else {
        return 0.0;
    };
    let (lo, hi) = vertices
        .iter()
        .fold((*first, *first), |(lo, hi), p| (lo.inf(p), hi.sup(p)));
    let diagonal = (hi - lo).norm();
    if diagonal.is_finite() { diagonal } else { 0.0 }
}

impl Soup {
    /// Appends a triangle with corners of its own.
    fn push_triangle(&mut self, corners: [Point3<f64>; 3]) -> Result<(), MeshProblem> {
        let first = self.vertices.len() as u32;
        self.vertices.extend(corners);
        self.faces.push(vec![first, first + 1, first + 2]);
        self.within_limits()
    }

    /// Refuses early what [`Polyhedron::from_faces`] would refuse late. Unwelded triangles have three corners each.
    const fn within_limits(&self) -> Result<(), MeshProblem> {
        if self.faces.len() > MAX_FACES {
            return Err(MeshProblem::TooManyFaces);
        }
        if self.vertices.len() > 3 * MAX_VERTICES {
            return Err(MeshProblem::TooManyVertices);
        }
        Ok(())
    }
}
