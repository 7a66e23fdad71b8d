//! glTF 2.0, text and binary: every triangle of every mesh that the scene's nodes place.

use std::path::Path;

use gltf::accessor::{Accessor, DataType, Dimensions};
use gltf::mesh::Mode;
use gltf::{Document, Gltf};
use nalgebra::{Matrix4, Point3};

use super::fault::MeshProblem;
use super::gltf_buffers::buffers;
use super::{MESH_BYTES_MAX, Soup};

pub(super) fn parse(bytes: &[u8], folder: &Path) -> Result<Soup, MeshProblem> {
    let (document, blob) = document(bytes)?;
    let buffers = buffers(&document, blob.as_deref(), folder)?;
    let Some(scene) = document
        .default_scene()
        .or_else(|| document.scenes().next())
    else {
        return Err(MeshProblem::syntax("document", "it has no scene"));
    };
    let mut soup = Soup::default();
    let mut waiting: Vec<(gltf::Node<'_>, Matrix4<f64>)> = scene
        .nodes()
        .map(|node| (node, Matrix4::identity()))
        .collect();
    let mut n_visited = 0;
    while let Some((node, world_from_parent)) = waiting.pop() {
        n_visited += 1;
        if n_visited > document.nodes().len() {
            return Err(MeshProblem::syntax(
                format!("node {}", node.index()),
                "nodes form a ring or share a child",
            ));
        }
        let world_from_node = world_from_parent * matrix(&node);
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            let place = format!("node {}, primitive {}", node.index(), primitive.index());
            append(&primitive, &place, &world_from_node, &buffers, &mut soup)?;
        }
        waiting.extend(node.children().map(|child| (child, world_from_node)));
    }
    Ok(soup)
}

/// The checked document, and the binary part that a GLB carries.
fn document(bytes: &[u8]) -> Result<(Document, Option<Vec<u8>>), MeshProblem> {
    let fault = |fault: gltf::Error| MeshProblem::syntax("document", fault.to_string());
    let Gltf { document, blob } = Gltf::from_slice_without_validation(bytes).map_err(fault)?;
    let root = document.into_json();
    // The validation of `gltf-json` 1.4 looks up a primitive's positions before it has checked that they exist.
    let attributes = root
        .meshes
        .iter()
        .flat_map(|mesh| &mesh.primitives)
        .flat_map(|part| part.attributes.values());
    for accessor in attributes {
        if accessor.value() >= root.accessors.len() {
            let what = format!(
                "a mesh names accessor {}, which does not exist",
                accessor.value()
            );
            return Err(MeshProblem::syntax("document", what));
        }
    }
    Ok((Document::from_json(root).map_err(fault)?, blob))
}

/// `parent_from_node`.
fn matrix(node: &gltf::Node<'_>) -> Matrix4<f64> {
    let columns = node.transform().matrix();
    Matrix4::from_fn(|row, column| f64::from(columns[column][row]))
}

fn append(
    primitive: &gltf::Primitive<'_>,
    place: &str,
    world_from_node: &Matrix4<f64>,
    buffers: &[Vec<u8>],
    soup: &mut Soup,
) -> Result<(), MeshProblem> {
    if primitive.mode() != Mode::Triangles {
        return Err(MeshProblem::syntax(
            place,
            format!("it is made of {:?}, not of Triangles", primitive.mode()),
        ));
    }
    let Some(positions) = primitive.get(&gltf::Semantic::Positions) else {
        return Err(MeshProblem::syntax(place, "it has no positions"));
    };
    readable(&positions, place, Dimensions::Vec3, &[DataType::F32])?;
    let whole_numbers = [DataType::U8, DataType::U16, DataType::U32];
    if let Some(indices) = primitive.indices() {
        readable(&indices, place, Dimensions::Scalar, &whole_numbers)?;
    }
    let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
    let Some(points) = reader.read_positions() else {
        return Err(MeshProblem::syntax(
            place,
            "its positions lie outside their buffer",
        ));
    };
    let points: Vec<Point3<f64>> = points
        .map(|p| world_from_node.transform_point(&Point3::from(p.map(f64::from))))
        .collect();
    let corners: Vec<u32> = match (reader.read_indices(), primitive.indices()) {
        (Some(indices), _) => indices.into_u32().collect(),
        (None, None) => (0..points.len() as u32).collect(),
        (None, Some(_)) => {
            return Err(MeshProblem::syntax(
                place,
                "its indices lie outside their buffer",
            ));
        }
    };
    // A mirroring node turns every face inside out.
    let is_mirrored = world_from_node.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
    for (index, corner) in corners.chunks_exact(3).enumerate() {
        let at = |k: usize| points.get(corner[k] as usize).copied();
        let [Some(a), Some(b), Some(c)] = [at(0), at(1), at(2)] else {
            return Err(MeshProblem::syntax(
                format!("{place}, triangle {index}"),
                "it names a vertex that does not exist",
            ));
        };
        soup.push_triangle(if is_mirrored { [a, c, b] } else { [a, b, c] })?;
    }
    Ok(())
}

/// Whether an accessor has the type wanted and bounds that can be computed with; the reader below trusts them.
fn readable(
    accessor: &Accessor<'_>,
    place: &str,
    shape: Dimensions,
    types: &[DataType],
) -> Result<(), MeshProblem> {
    let fault = |what: &str| {
        Err(MeshProblem::syntax(
            format!("{place}, accessor {}", accessor.index()),
            what,
        ))
    };
    if accessor.dimensions() != shape || !types.contains(&accessor.data_type()) {
        return fault("it has another type than its use asks for");
    }
    let Some(view) = accessor.view().filter(|_| accessor.sparse().is_none()) else {
        return fault("sparse accessors are not supported");
    };
    let limit = MESH_BYTES_MAX as usize;
    let sizes = [
        accessor.count(),
        accessor.offset(),
        view.offset(),
        view.length(),
        view.stride().unwrap_or(0),
    ];
    if accessor.count() == 0 || sizes.iter().any(|size| *size > limit) {
        return fault("it is empty or too large");
    }
    Ok(())
}
