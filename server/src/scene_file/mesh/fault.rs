//! Why a mesh file is refused.

use tsukamu_world::polyhedron::fault::ShapeFault;
use tsukamu_world::polyhedron::tolerances::{MAX_FACES, MAX_VERTICES};

use super::MESH_BYTES_MAX;

/// A mesh file that is no solid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}: {problem}")]
pub struct MeshFault {
    /// The file.
    pub file: String,
    /// What is wrong with it, and where.
    #[source]
    pub problem: MeshProblem,
}

/// What is wrong with a mesh file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshProblem {
    /// It cannot be read.
    #[error("cannot be read: {why}")]
    Unreadable {
        /// What the system says.
        why: String,
    },
    /// It has too many bytes.
    #[error("has {bytes} bytes; a mesh may have {MESH_BYTES_MAX}")]
    TooLarge {
        /// Bytes of the file.
        bytes: u64,
    },
    /// Its name ends in nothing that we read.
    #[error("its name ends in {extension:?}; meshes are .obj, .stl, .gltf or .glb")]
    UnknownFormat {
        /// The ending.
        extension: String,
    },
    /// It does not follow its format.
    #[error("{place}: {fault}")]
    Syntax {
        /// Where: a line, a triangle, a part of the document.
        place: String,
        /// What is wrong there.
        fault: String,
    },
    /// It holds more faces than a shape may have.
    #[error("has more than {MAX_FACES} faces")]
    TooManyFaces,
    /// It holds more vertices than a shape may have.
    #[error("has more than {MAX_VERTICES} vertices")]
    TooManyVertices,
    /// Its faces close no solid.
    #[error(
        "{0} (faces and vertices are counted from 0 in the file's order, corners at one place joined)"
    )]
    Shape(ShapeFault),
}

impl MeshProblem {
    /// A fault of syntax.
    pub(super) fn syntax(place: impl Into<String>, fault: impl Into<String>) -> Self {
        Self::Syntax {
            place: place.into(),
            fault: fault.into(),
        }
    }
}
