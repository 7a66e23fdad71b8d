//! Coplanar neighbours become one face.

use super::mesh::Mesh;
use super::tolerances::{COPLANAR_DISTANCE, COPLANAR_SINE};

const NONE: u32 = u32::MAX;

/// Per triangle: its face. Faces are numbered by the first patch in them, so in the author's order.
///
/// Regions grow from the largest patches and every member is held against the plane of the first one, so that a
/// gentle curve does not drift into one face. `size` is the shape's, in metres.
pub(super) fn faces_of_triangles(mesh: &Mesh, size: f64) -> (Vec<u32>, usize) {
    let mut seeds: Vec<u32> = (0..mesh.patches.len() as u32).collect();
    let area = |p: u32| mesh.patches[p as usize].area;
    seeds.sort_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));
    let mut region_of = vec![NONE; mesh.patches.len()];
    let mut waiting = Vec::new();
    for seed in seeds {
        if region_of[seed as usize] != NONE {
            continue;
        }
        region_of[seed as usize] = seed;
        waiting.push(seed);
        while let Some(patch) = waiting.pop() {
            for neighbour in neighbours(mesh, patch) {
                if region_of[neighbour as usize] == NONE
                    && lies_in_plane(mesh, neighbour, seed, size)
                {
                    region_of[neighbour as usize] = seed;
                    waiting.push(neighbour);
                }
            }
        }
    }
    let mut number = vec![NONE; mesh.patches.len()];
    let mut n_faces = 0;
    for &region in &region_of {
        if number[region as usize] == NONE {
            number[region as usize] = n_faces;
            n_faces += 1;
        }
    }
    let face = |&patch: &u32| number[region_of[patch as usize] as usize];
    (mesh.patch_of.iter().map(face).collect(), n_faces as usize)
}

fn neighbours(mesh: &Mesh, patch: u32) -> impl Iterator<Item = u32> + '_ {
    let triangles = mesh.patches[patch as usize].triangles.clone();
    let sides = 3 * triangles.start..3 * triangles.end;
    sides
        .map(|side| mesh.patch_of[mesh.twins[side as usize] as usize / 3])
        .filter(move |&p| p != patch)
}

fn lies_in_plane(mesh: &Mesh, patch: u32, seed: u32, size: f64) -> bool {
    let (patch, seed) = (&mesh.patches[patch as usize], &mesh.patches[seed as usize]);
    if patch.normal.dot(&seed.normal) <= 0.0
        || patch.normal.cross(&seed.normal).norm() > COPLANAR_SINE
    {
        return false;
    }
    let corners = |t: &std::ops::Range<u32>| {
        mesh.triangles[t.start as usize..t.end as usize]
            .iter()
            .flatten()
    };
    let height = |&v: &u32| seed.normal.dot(&mesh.points[v as usize].coords);
    let plane = corners(&seed.triangles).map(height).sum::<f64>()
        / f64::from(3 * seed.triangles.len() as u32);
    corners(&patch.triangles).all(|v| (height(v) - plane).abs() <= COPLANAR_DISTANCE * size)
}
