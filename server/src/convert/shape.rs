//! Polyhedra.

use nalgebra::Point3;
use tsukamu_proto::v1;
use tsukamu_world::polyhedron::Polyhedron;
use tsukamu_world::polyhedron::fault::ShapeFault;
use tsukamu_world::polyhedron::tolerances::{MAX_TRIANGLES, MAX_VERTICES};

use super::fault::Fault;

/// A polyhedron as a message. Its triangles alone rebuild it to the last bit.
pub fn shape(polyhedron: &Polyhedron) -> v1::Shape {
    let mut faces = Vec::new();
    for face in polyhedron.faces() {
        faces.push(face.loops.len() as u32);
        for corners in &face.loops {
            faces.push(corners.len() as u32);
            faces.extend_from_slice(corners);
        }
    }
    v1::Shape {
        vertices: polyhedron
            .points()
            .iter()
            .flat_map(|p| [p.x, p.y, p.z])
            .collect(),
        faces,
        triangles: polyhedron
            .triangles()
            .iter()
            .flat_map(|t| t.vertices)
            .collect(),
        triangle_faces: polyhedron.triangles().iter().map(|t| t.face).collect(),
        edges: polyhedron.edges().iter().flat_map(|e| e.vertices).collect(),
    }
}

/// The polyhedron of that message: from its triangles where it has some, else from its faces.
///
/// # Errors
/// When a list does not fit, or the surface is no solid; `object` names it.
pub fn polyhedron_from(message: &v1::Shape, object: &str) -> Result<Polyhedron, Fault> {
    if !message.vertices.len().is_multiple_of(3) {
        return Err(length(
            "shape.vertices",
            message.vertices.len(),
            "three per vertex",
        ));
    }
    let refused = |fault| Fault::Shape {
        object: object.to_owned(),
        fault,
    };
    let n_vertices = message.vertices.len() / 3;
    if n_vertices > MAX_VERTICES {
        return Err(refused(ShapeFault::TooManyVertices {
            count: n_vertices,
            limit: MAX_VERTICES,
        }));
    }
    let vertices: Vec<Point3<f64>> = message
        .vertices
        .chunks_exact(3)
        .map(|p| Point3::new(p[0], p[1], p[2]))
        .collect();
    let faces = if message.triangles.is_empty() {
        polygons(&message.faces)?
    } else {
        triangles(&message.triangles)?
    };
    Polyhedron::from_faces(&vertices, &faces).map_err(refused)
}

fn triangles(indices: &[u32]) -> Result<Vec<Vec<u32>>, Fault> {
    if !indices.len().is_multiple_of(3) || indices.len() > 3 * MAX_TRIANGLES {
        return Err(length(
            "shape.triangles",
            indices.len(),
            "three per triangle, and not too many",
        ));
    }
    Ok(indices.chunks_exact(3).map(<[u32]>::to_vec).collect())
}

/// Faces with one loop each.
fn polygons(mut numbers: &[u32]) -> Result<Vec<Vec<u32>>, Fault> {
    let mut faces = Vec::new();
    while let Some((&n_loops, rest)) = numbers.split_first() {
        if n_loops != 1 {
            return Err(Fault::Holes(faces.len()));
        }
        let (&n_corners, rest) = rest.split_first().ok_or(Fault::FacesCut)?;
        let (corners, rest) = rest
            .split_at_checked(n_corners as usize)
            .ok_or(Fault::FacesCut)?;
        faces.push(corners.to_vec());
        numbers = rest;
    }
    Ok(faces)
}

const fn length(field: &'static str, found: usize, expected: &'static str) -> Fault {
    Fault::Length {
        field,
        found,
        expected,
    }
}
