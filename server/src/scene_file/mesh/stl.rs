//! STL, text and binary. It names every triangle's corners anew; they are joined afterwards.

use std::io::Cursor;

use nalgebra::Point3;

use super::Soup;
use super::fault::MeshProblem;

pub(super) fn parse(bytes: &[u8]) -> Result<Soup, MeshProblem> {
    let mut cursor = Cursor::new(bytes);
    let triangles = stl_io::create_stl_reader(&mut cursor)
        .map_err(|fault| MeshProblem::syntax("at the start", fault.to_string()))?;
    let mut soup = Soup::default();
    for (index, triangle) in triangles.enumerate() {
        let triangle = triangle
            .map_err(|fault| MeshProblem::syntax(format!("triangle {index}"), fault.to_string()))?;
        soup.push_triangle(
            triangle
                .vertices
                .map(|corner| Point3::from(corner.0.map(f64::from))),
        )?;
    }
    Ok(soup)
}
