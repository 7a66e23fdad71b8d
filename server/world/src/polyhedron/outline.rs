//! The outlines of the faces, and the edges between them.

use nalgebra::Vector3;

use super::mesh::{Mesh, next};
use super::tolerances::COLLINEAR_SINE;

/// Corners and edges of the merged faces.
pub(super) struct Outline {
    /// Per point of the mesh: whether it is a vertex of the polyhedron (not inside a face or on a straight edge).
    pub(super) is_corner: Vec<bool>,
    /// Per face: its boundary loops as ids of corners, counter-clockwise seen from outside (holes clockwise).
    pub(super) loops: Vec<Vec<Vec<u32>>>,
    /// From corner to corner, in the sense of the first (lower) face, and both faces.
    pub(super) edges: Vec<([u32; 2], [u32; 2])>,
}

/// Follows the boundaries of the faces. `face_of` gives each triangle's face.
pub(super) fn outline(mesh: &Mesh, face_of: &[u32], n_faces: usize) -> Outline {
    let is_corner = corners(mesh, face_of);
    let mut found = Outline {
        is_corner,
        loops: vec![vec![]; n_faces],
        edges: vec![],
    };
    let mut seen = vec![false; mesh.twins.len()];
    // Triangles stand in the order of their faces, so edges come out in the order of their lower face.
    for side in 0..mesh.twins.len() as u32 {
        if seen[side as usize] || !is_sharp(mesh, face_of, side) {
            continue;
        }
        let boundary = follow(mesh, face_of, side);
        boundary.iter().for_each(|&s| seen[s as usize] = true);
        add_loop(mesh, face_of, &boundary, &mut found);
    }
    found
}

fn start_of(mesh: &Mesh, side: u32) -> u32 {
    mesh.triangles[side as usize / 3][side as usize % 3]
}

fn is_sharp(mesh: &Mesh, face_of: &[u32], side: u32) -> bool {
    face_of[side as usize / 3] != face_of[mesh.twins[side as usize] as usize / 3]
}

/// The boundary loop of a face that begins with `first`: at each end, turn through the face to its next sharp side.
fn follow(mesh: &Mesh, face_of: &[u32], first: u32) -> Vec<u32> {
    let mut boundary = vec![first];
    loop {
        let mut side = next(boundary[boundary.len() - 1]);
        while !is_sharp(mesh, face_of, side) {
            side = next(mesh.twins[side as usize]);
        }
        if side == first {
            return boundary;
        }
        boundary.push(side);
    }
}

fn corners(mesh: &Mesh, face_of: &[u32]) -> Vec<bool> {
    // Per point: how many sharp sides leave it, and the last two of them.
    let mut leaving = vec![(0_u32, [0_u32; 2]); mesh.points.len()];
    for side in (0..mesh.twins.len() as u32).filter(|&s| is_sharp(mesh, face_of, s)) {
        let (n, last) = &mut leaving[start_of(mesh, side) as usize];
        *n += 1;
        *last = [last[1], side];
    }
    let direction = |side: u32| -> Vector3<f64> {
        let [from, to] = [start_of(mesh, side), start_of(mesh, next(side))];
        (mesh.points[to as usize] - mesh.points[from as usize]).normalize()
    };
    let is_straight = |[a, b]: [u32; 2]| {
        let (a, b) = (direction(a), direction(b));
        a.dot(&b) < 0.0 && a.cross(&b).norm() <= COLLINEAR_SINE
    };
    leaving
        .iter()
        .map(|&(n, last)| n == 1 || n > 2 || (n == 2 && !is_straight(last)))
        .collect()
}

fn add_loop(mesh: &Mesh, face_of: &[u32], boundary: &[u32], found: &mut Outline) {
    let face = face_of[boundary[0] as usize / 3];
    let at_corner: Vec<usize> = (0..boundary.len())
        .filter(|&k| found.is_corner[start_of(mesh, boundary[k]) as usize])
        .collect();
    let ids: Vec<u32> = at_corner
        .iter()
        .map(|&k| start_of(mesh, boundary[k]))
        .collect();
    for (k, &place) in at_corner.iter().enumerate() {
        let other = face_of[mesh.twins[boundary[place] as usize] as usize / 3];
        if face < other {
            found
                .edges
                .push(([ids[k], ids[(k + 1) % ids.len()]], [face, other]));
        }
    }
    found.loops[face as usize].push(ids);
}
