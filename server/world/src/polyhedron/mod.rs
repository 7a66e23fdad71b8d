//! Closed rigid polyhedra: what every object is made of (Funahashi et al. 1998, §3.1).
//!
//! ```text
//! author's polygons -> check -> mesh (triangles, neighbours) -> merge (coplanar -> faces) -> outline (loops, edges)
//!                                    \-> mass (G, volume, inertia)                             \-> build (all of it)
//! ```

pub mod aabb;
mod build;
mod check;
pub mod fault;
mod mass;
mod merge;
mod mesh;
pub(crate) mod normals;
mod outline;
pub(crate) mod pairs;
pub mod shapes;
pub mod tolerances;
pub(crate) mod tree;
mod triangulate;
pub mod weld;

#[cfg(test)]
pub(crate) mod tests;

use std::ops::Range;

use nalgebra::{Matrix3, Point3, Vector3};

use aabb::Aabb;
use fault::ShapeFault;
use normals::SignNormals;
use pairs::FacePairs;
use tree::Tree;

/// A closed, consistently oriented rigid polyhedron: convex or not, with or without handles, in one piece.
///
/// The origin of its space is its centre of gravity G at uniform density. Lengths in metres. It never changes.
/// That the surface does not pass through itself is the author's promise; it is not checked.
#[derive(Clone, Debug)]
pub struct Polyhedron {
    /// Vertices first, then the triangles' other corners, inside faces and edges.
    points: Vec<Point3<f64>>,
    n_vertices: usize,
    faces: Vec<Face>,
    /// Normal and offset of each face, side by side for the queries.
    planes: Vec<[f64; 4]>,
    edges: Vec<Edge>,
    triangles: Vec<Triangle>,
    normals: SignNormals,
    pairs: FacePairs,
    triangle_tree: Tree,
    edge_tree: Tree,
    is_convex: bool,
    volume: f64,
    centroid: Point3<f64>,
    inertia: Matrix3<f64>,
    bounding_radius: f64,
    aabb: Aabb,
}

/// One flat face: a polygon, perhaps with holes. Coplanar neighbours are one face.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Unit normal, out of the solid.
    pub normal: Vector3<f64>,
    /// Distance of the face's plane from G along the normal, in metres: `normal · x = offset`.
    pub offset: f64,
    /// Boundary loops of vertex ids, counter-clockwise seen from outside; those of holes clockwise.
    pub loops: Vec<Vec<u32>>,
    /// Its triangles.
    pub triangles: Range<u32>,
}

/// One straight edge between two faces that are not coplanar.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// From and to, in the sense in which the first face's boundary runs.
    pub vertices: [u32; 2],
    /// The faces on both sides, the lower id first.
    pub faces: [u32; 2],
    /// Unit direction from the first vertex to the second.
    pub direction: Vector3<f64>,
    /// In metres.
    pub length: f64,
    /// The paper's normal of an edge: unit vector from G to the foot of the perpendicular on the edge's line.
    /// If the line passes through G: the normalized mean of both faces' normals.
    pub pseudo_normal: Vector3<f64>,
    /// Whether the solid's angle here is less than 180 degrees; otherwise the edge is reflex.
    pub is_convex: bool,
}

/// One triangle of a face, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// Corners, as indices into [`Polyhedron::points`].
    pub vertices: [u32; 3],
    /// The face it is part of. Triangles are sorted by it.
    pub face: u32,
}

impl Polyhedron {
    /// The solid bounded by these polygons, in metres, each counter-clockwise seen from outside.
    ///
    /// Polygons may be triangles and need not be quite planar (a bent one is several faces). Unused vertices are
    /// dropped; vertices at one place are not joined (see [`weld::weld`]). G becomes the origin.
    ///
    /// # Errors
    /// The first [`ShapeFault`] found, with its place in the author's indices.
    pub fn from_faces(vertices: &[Point3<f64>], faces: &[Vec<u32>]) -> Result<Self, ShapeFault> {
        build::from_faces(vertices, faces)
    }

    /// The corners of the faces. Points inside a face or inside a straight edge are no vertices.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.points[..self.n_vertices]
    }

    /// The vertices, followed by the other corners of triangles.
    pub fn points(&self) -> &[Point3<f64>] {
        &self.points
    }

    /// The faces, in the author's order.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The faces' planes as `[normal x, y, z, offset]`.
    #[inline]
    pub fn planes(&self) -> &[[f64; 4]] {
        &self.planes
    }

    /// The edges.
    #[inline]
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The triangles, sorted by face.
    #[inline]
    pub fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// The ends of an edge.
    ///
    /// # Panics
    /// If there is no such edge.
    #[inline]
    pub fn edge_ends(&self, edge: u32) -> [Point3<f64>; 2] {
        self.edges[edge as usize]
            .vertices
            .map(|v| self.points[v as usize])
    }

    /// The corners of a triangle.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    pub fn triangle_corners(&self, triangle: u32) -> [Point3<f64>; 3] {
        self.triangles[triangle as usize]
            .vertices
            .map(|v| self.points[v as usize])
    }

    /// Whether the solid is convex.
    #[inline]
    pub fn is_convex(&self) -> bool {
        self.is_convex
    }

    /// Cubic metres.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Where G lies in the author's space. Author's coordinates minus this are the polyhedron's own.
    pub fn centroid(&self) -> Point3<f64> {
        self.centroid
    }

    /// Inertia tensor about G for a density of 1 kg/m3, in kg m2. Multiply by the density (mass / volume).
    pub fn unit_inertia(&self) -> &Matrix3<f64> {
        &self.inertia
    }

    /// Distance of the farthest vertex from G, in metres.
    #[inline]
    pub fn bounding_radius(&self) -> f64 {
        self.bounding_radius
    }

    /// The box around it in its own space.
    #[inline]
    pub fn aabb(&self) -> &Aabb {
        &self.aabb
    }

    pub(crate) fn normals(&self) -> &SignNormals {
        &self.normals
    }

    #[inline]
    pub(crate) fn pairs(&self) -> &FacePairs {
        &self.pairs
    }

    pub(crate) fn triangle_tree(&self) -> &Tree {
        &self.triangle_tree
    }

    pub(crate) fn edge_tree(&self) -> &Tree {
        &self.edge_tree
    }
}
