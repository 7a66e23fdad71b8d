//! Bounds and tolerances of shapes and of the questions asked of them, each with unit and reason.

/// Most author's vertices of one shape. Bounds what a mesh file can cost; above every mesh meant to be held.
pub const MAX_VERTICES: usize = 200_000;
/// Most author's faces of one shape, for the same reason.
pub const MAX_FACES: usize = 100_000;
/// Most corners of one author's polygon. Cutting off the ears of a non-convex polygon costs up to the cube of it.
pub const MAX_POLYGON_CORNERS: usize = 1024;
/// Most triangles of one shape after its polygons are cut.
pub const MAX_TRIANGLES: usize = 400_000;
/// Smallest diagonal of a shape's bounding box, metres. Below it the absolute tolerances below would lie.
pub const MIN_SIZE_M: f64 = 1e-4;
/// Largest coordinate and bounding box diagonal, metres. Above it a nanometre is lost in f64.
pub const MAX_SIZE_M: f64 = 1e5;

/// Distance of the centre of gravity from the origin that is rounding, as a share of the shape's size: such a shape
/// stays where it is. A larger value would leave shapes off their centre.
pub const CENTRED: f64 = 1e-13;
/// Thickness of a polygon under which it has no area, as a share of the shape's size (box diagonal).
pub const DEGENERATE_THICKNESS: f64 = 1e-9;
/// Volume under which a shape has none, as a share of the cube of its size. A 1 m needle of 2 um passes.
pub const DEGENERATE_VOLUME: f64 = 1e-12;
/// Distance of a vertex from a plane that still counts as in it, as a share of the shape's size.
/// Meshes in f32 or in text of six digits are off by 1e-6. Larger values merge gentle curves into one face.
pub const COPLANAR_DISTANCE: f64 = 2e-6;
/// Sine of the angle between two normals that still counts as one plane. Narrow triangles in f32 are off by 1e-3.
pub const COPLANAR_SINE: f64 = 2e-3;
/// Sine of the bend at which a chain of edge pieces between the same two faces is no longer one edge.
pub const COLLINEAR_SINE: f64 = 2e-3;
/// Distance of an edge's line from the centre of gravity under which it passes through it, share of the size.
pub const LINE_THROUGH_CENTRE: f64 = 1e-9;
/// Padding of the boxes of a tree, as a share of the shape's size: rounding must not hide a triangle.
pub const BOX_PADDING: f64 = 1e-9;

/// Faces up to which a convex shape is asked by its planes alone; above it the tree is quicker.
pub const MAX_PLANES_WALKED: usize = 128;
/// Faces up to which the planes that a sweep straddles fit one word.
pub const MAX_PLANES_MASKED: usize = 64;
/// Pairs of edges up to which two convex shapes are separated by axes; above it as two meshes.
pub const MAX_EDGE_PAIRS: usize = 40_000;

/// Depth, metres, up to which a path that starts inside still counts as starting on the surface. It bridges the
/// rounding of a pose between two steps; a larger value would report the same entry twice.
pub const ON_SURFACE_M: f64 = 1e-9;
/// Depth, metres, up to which two solids touch without interpenetrating: 0.1 um, far below any tracker, far above
/// rounding at room size.
pub const TOUCH_M: f64 = 1e-7;
/// Slack at both ends of a step, as a share of it, so that an edge crossed exactly between two steps is not lost.
pub const STEP_SLACK: f64 = 1e-9;
/// Sine of the angle between a segment and an edge below which they are parallel and cannot cross.
pub const PARALLEL_SINE: f64 = 1e-9;
/// How much less deep, in share and metres, an edge axis must be before it is taken instead of a face axis:
/// faces give steady answers.
pub const FACE_PREFERENCE: (f64, f64) = (0.98, 1e-6);
