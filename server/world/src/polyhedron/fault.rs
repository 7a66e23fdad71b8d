//! Why a shape is refused, and where.

/// Why a mesh is no closed rigid solid. Vertices and faces are counted from 0 as their author wrote them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeFault {
    /// There is no face at all.
    #[error("the shape has no faces")]
    Empty,
    /// More vertices than allowed.
    #[error("{count} vertices are more than the {limit} allowed")]
    TooManyVertices {
        /// Vertices found.
        count: usize,
        /// Vertices allowed.
        limit: usize,
    },
    /// More faces than allowed.
    #[error("{count} faces are more than the {limit} allowed")]
    TooManyFaces {
        /// Faces (or triangles that they are cut into) found.
        count: usize,
        /// Faces allowed.
        limit: usize,
    },
    /// One polygon has more corners than allowed.
    #[error("face {face} has {count} corners, more than the {limit} allowed")]
    TooManyCorners {
        /// The face.
        face: u32,
        /// Its corners.
        count: usize,
        /// Corners allowed.
        limit: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// The vertex.
        vertex: u32,
    },
    /// The shape is too small or too large (or too far from its origin) to be computed with.
    #[error("the shape's size of {size} m is outside {min} to {max} m")]
    SizeOutOfRange {
        /// Diagonal of the bounding box, or the largest coordinate, in metres.
        size: f64,
        /// Smallest size allowed, in metres.
        min: f64,
        /// Largest size allowed, in metres.
        max: f64,
    },
    /// A measure of a primitive is not a positive finite number, or does not fit the others.
    #[error("{name} is {value}, but must be {bound}")]
    BadMeasure {
        /// Which measure.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        bound: &'static str,
    },
    /// A face names a vertex that does not exist.
    #[error("face {face} names vertex {index}, which does not exist")]
    IndexOutOfRange {
        /// The face.
        face: u32,
        /// The vertex it names.
        index: u32,
    },
    /// A face has fewer than three different corners, one corner twice, or no area.
    #[error("face {face} is degenerate: fewer than three corners, one twice, or no area")]
    DegenerateFace {
        /// The face.
        face: u32,
    },
    /// An edge belongs to one face only: the shape is not closed.
    #[error("the shape is open: the edge of vertices {} and {} belongs to face {face} only", vertices[0], vertices[1])]
    OpenEdge {
        /// The edge's vertices.
        vertices: [u32; 2],
        /// Its only face.
        face: u32,
    },
    /// Two neighbouring faces run round in opposite senses.
    #[error("faces {} and {} are oriented against each other at the edge of vertices {} and {}",
        faces[0], faces[1], vertices[0], vertices[1])]
    InconsistentOrientation {
        /// The edge's vertices.
        vertices: [u32; 2],
        /// Both faces.
        faces: [u32; 2],
    },
    /// An edge belongs to three faces or more.
    #[error("{n_faces} faces share the edge of vertices {} and {}; a solid's edge has two (the first is face {face})",
        vertices[0], vertices[1])]
    NonManifoldEdge {
        /// The edge's vertices.
        vertices: [u32; 2],
        /// The lowest of its faces.
        face: u32,
        /// How many faces share it.
        n_faces: usize,
    },
    /// Two parts of the surface meet in one vertex only.
    #[error("the surface is pinched at vertex {vertex}: parts of it meet there and nowhere else")]
    PinchedVertex {
        /// The vertex.
        vertex: u32,
    },
    /// The shape is several shapes (or has a cavity).
    #[error(
        "the shape is {n_parts} separate closed parts (face {face} begins the second); each must be an object of its own, and hollow solids are not supported"
    )]
    Disconnected {
        /// How many parts.
        n_parts: usize,
        /// The lowest face outside the first part.
        face: u32,
    },
    /// All faces are oriented inward.
    #[error("the shape is inside out: its volume is {volume} m3; turn every face round")]
    InsideOut {
        /// The signed volume, in cubic metres.
        volume: f64,
    },
    /// The shape encloses no volume.
    #[error("the shape encloses no volume ({volume} m3)")]
    ZeroVolume {
        /// The signed volume, in cubic metres.
        volume: f64,
    },
}
