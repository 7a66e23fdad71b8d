//! Wavefront OBJ. Polygons are kept: a face of the file is a face of the object.

use std::collections::HashMap;

use nalgebra::Point3;
use tobj::{LoadOptions, Mesh};

use super::Soup;
use super::fault::MeshProblem;

pub(super) fn parse(bytes: &[u8]) -> Result<Soup, MeshProblem> {
    let options = LoadOptions {
        triangulate: false,
        single_index: false,
        ..LoadOptions::default()
    };
    let mut rest = bytes;
    // Materials are looks, not geometry: whatever library is named, none is opened.
    let parsed = tobj::load_obj_buf(&mut rest, &options, |_| Ok((Vec::new(), HashMap::new())));
    let (models, _) = parsed.map_err(|fault| {
        let read = &bytes[..bytes.len() - rest.len()];
        let line = read.iter().filter(|byte| **byte == b'\n').count();
        MeshProblem::syntax(
            format!("at or before line {}", line.max(1)),
            fault.to_string(),
        )
    })?;
    let mut soup = Soup::default();
    for model in &models {
        append(&model.mesh, &mut soup)?;
    }
    Ok(soup)
}

/// Appends one object or group of the file; its corners are its own until they are welded.
fn append(mesh: &Mesh, soup: &mut Soup) -> Result<(), MeshProblem> {
    let first = soup.vertices.len() as u32;
    soup.vertices.extend(
        mesh.positions
            .chunks_exact(3)
            .map(|p| Point3::new(p[0], p[1], p[2])),
    );
    soup.within_limits()?;
    let triangles = vec![
        3;
        if mesh.face_arities.is_empty() {
            mesh.indices.len() / 3
        } else {
            0
        }
    ];
    let mut indices = mesh.indices.as_slice();
    for arity in triangles.iter().chain(&mesh.face_arities) {
        let Some((face, others)) = indices.split_at_checked(*arity as usize) else {
            return Err(MeshProblem::syntax(
                format!("face {}", soup.faces.len()),
                "it ends too early",
            ));
        };
        indices = others;
        // Lone points and lines of the file bound nothing.
        if face.len() > 2 {
            soup.faces.push(
                face.iter()
                    .map(|&corner| corner.saturating_add(first))
                    .collect(),
            );
        }
        soup.within_limits()?;
    }
    Ok(())
}
