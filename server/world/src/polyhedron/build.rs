//! From an author's polygons to a [`Polyhedron`].

use nalgebra::{Point3, Vector3};

use super::aabb::Aabb;
use super::fault::ShapeFault;
use super::mesh::Mesh;
use super::normals::SignNormals;
use super::outline::{Outline, outline};
use super::pairs::FacePairs;
use super::tolerances::{
    BOX_PADDING, CENTRED, COPLANAR_DISTANCE, DEGENERATE_VOLUME, LINE_THROUGH_CENTRE,
};
use super::tree::Tree;
use super::{Edge, Face, Polyhedron, Triangle, check, mass, merge};

/// Vertices times faces up to which convexity is also checked point by point (a star can fool its edges).
const MAX_CONVEXITY_CHECKS: usize = 4_000_000;

/// Rounds after which the centre of gravity is in the origin to the last bit, wherever the author put it.
const MAX_ROUNDS: usize = 4;

/// See [`Polyhedron::from_faces`].
///
/// The solid is made once more from its own points and triangles, until that changes nothing: so whoever has these,
/// a recording for one, makes the same solid from them to the last bit.
pub(super) fn from_faces(
    vertices: &[Point3<f64>],
    faces: &[Vec<u32>],
) -> Result<Polyhedron, ShapeFault> {
    let mut solid = once(vertices, faces)?;
    let centroid = solid.centroid;
    for _ in 0..MAX_ROUNDS {
        let triangles: Vec<Vec<u32>> = solid
            .triangles
            .iter()
            .map(|t| t.vertices.to_vec())
            .collect();
        solid = once(&solid.points, &triangles)?;
        if solid.centroid == Point3::origin() {
            break;
        }
    }
    Ok(Polyhedron { centroid, ..solid })
}

/// One round of [`from_faces`].
fn once(vertices: &[Point3<f64>], faces: &[Vec<u32>]) -> Result<Polyhedron, ShapeFault> {
    let size = check::size(vertices, faces)?;
    check::no_degenerate_face(vertices, faces, size)?;
    check::one_closed_surface(faces)?;
    let mut mesh = Mesh::new(vertices.to_vec(), faces, size);
    mesh.no_pinched_vertex()?;

    let aabb = Aabb::of(faces.iter().flatten().map(|&i| vertices[i as usize]));
    let near = nalgebra::center(&aabb.lo, &aabb.hi);
    let (volume, centroid) = mass::volume_and_centroid(&mesh.points, &mesh.triangles, &near);
    if volume.abs() <= DEGENERATE_VOLUME * size * size * size {
        return Err(ShapeFault::ZeroVolume { volume });
    }
    if volume < 0.0 {
        return Err(ShapeFault::InsideOut { volume });
    }
    let is_centred = centroid.coords.norm() <= CENTRED * size;
    let centroid = if is_centred {
        Point3::origin()
    } else {
        centroid
    };
    mesh.points
        .iter_mut()
        .for_each(|p| *p = Point3::from(*p - centroid));

    let (face_of, n_faces) = merge::faces_of_triangles(&mesh, size);
    let face_of = sort_by_face(&mut mesh, &face_of);
    let mut outline = outline(&mesh, &face_of, n_faces);
    let n_vertices = put_corners_first(&mut mesh, &mut outline);
    Ok(assemble(
        mesh,
        &face_of,
        outline,
        &Measures {
            size,
            volume,
            centroid,
            n_vertices,
        },
    ))
}

struct Measures {
    size: f64,
    volume: f64,
    centroid: Point3<f64>,
    n_vertices: usize,
}

/// Puts the triangles of one face next to each other (patches lose their meaning); gives the new `face_of`.
fn sort_by_face(mesh: &mut Mesh, face_of: &[u32]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..face_of.len() as u32).collect();
    order.sort_by_key(|&t| face_of[t as usize]);
    let mut place = vec![0_u32; order.len()];
    for (new, &old) in (0_u32..).zip(&order) {
        place[old as usize] = new;
    }
    let old_side = |side: u32| 3 * order[side as usize / 3] + side % 3;
    let new_side = |side: u32| 3 * place[side as usize / 3] + side % 3;
    let twins = (0..mesh.twins.len() as u32)
        .map(|s| new_side(mesh.twins[old_side(s) as usize]))
        .collect();
    let triangles = order.iter().map(|&t| mesh.triangles[t as usize]).collect();
    let sorted = order.iter().map(|&t| face_of[t as usize]).collect();
    mesh.twins = twins;
    mesh.triangles = triangles;
    sorted
}

/// Renumbers the points: corners first, then what lies inside faces and edges; unused ones go. Both in given order.
fn put_corners_first(mesh: &mut Mesh, outline: &mut Outline) -> usize {
    let mut used = vec![false; mesh.points.len()];
    mesh.triangles
        .iter()
        .flatten()
        .for_each(|&v| used[v as usize] = true);
    let is_corner = |v: &u32| outline.is_corner[*v as usize];
    let corners: Vec<u32> = (0..mesh.points.len() as u32).filter(is_corner).collect();
    let rest = (0..mesh.points.len() as u32).filter(|v| !is_corner(v) && used[*v as usize]);
    let order: Vec<u32> = corners.iter().copied().chain(rest).collect();
    let mut place = vec![u32::MAX; mesh.points.len()];
    for (new, &old) in (0_u32..).zip(&order) {
        place[old as usize] = new;
    }
    let renumber = |v: &mut u32| *v = place[*v as usize];
    mesh.triangles.iter_mut().flatten().for_each(renumber);
    outline
        .loops
        .iter_mut()
        .flatten()
        .flatten()
        .for_each(renumber);
    outline
        .edges
        .iter_mut()
        .flat_map(|(ends, _)| ends)
        .for_each(renumber);
    mesh.points = order.iter().map(|&v| mesh.points[v as usize]).collect();
    corners.len()
}

fn assemble(mesh: Mesh, face_of: &[u32], outline: Outline, measures: &Measures) -> Polyhedron {
    let faces = faces(&mesh, face_of, outline.loops);
    let edges: Vec<Edge> = outline
        .edges
        .iter()
        .map(|&(ends, beside)| edge(&mesh.points, &faces, ends, beside, measures.size))
        .collect();
    let boxes = |groups: &mut dyn Iterator<Item = Aabb>| -> Vec<Aabb> {
        groups
            .map(|b| b.grown(BOX_PADDING * measures.size))
            .collect()
    };
    let point = |v: u32| mesh.points[v as usize];
    let triangle_tree = Tree::new(&boxes(
        &mut mesh.triangles.iter().map(|t| Aabb::of(t.map(point))),
    ));
    let edge_tree = Tree::new(&boxes(
        &mut edges.iter().map(|e| Aabb::of(e.vertices.map(point))),
    ));
    let corners = &mesh.points[..measures.n_vertices];
    Polyhedron {
        is_convex: is_convex(corners, &faces, &edges, measures.size),
        volume: measures.volume,
        centroid: measures.centroid,
        inertia: mass::inertia(&mesh.points, &mesh.triangles),
        bounding_radius: corners
            .iter()
            .map(|p| p.coords.norm_squared())
            .fold(0.0, f64::max)
            .sqrt(),
        aabb: Aabb::of(corners.iter().copied()),
        normals: SignNormals::new(&mesh, &faces, face_of),
        pairs: FacePairs::new(&edges, faces.len()),
        planes: faces
            .iter()
            .map(|f| [f.normal.x, f.normal.y, f.normal.z, f.offset])
            .collect(),
        triangles: mesh
            .triangles
            .iter()
            .zip(face_of)
            .map(|(&vertices, &face)| Triangle { vertices, face })
            .collect(),
        n_vertices: measures.n_vertices,
        points: mesh.points,
        faces,
        edges,
        triangle_tree,
        edge_tree,
    }
}

fn faces(mesh: &Mesh, face_of: &[u32], loops: Vec<Vec<Vec<u32>>>) -> Vec<Face> {
    let mut first = 0;
    let mut faces = Vec::with_capacity(loops.len());
    for (loops, run) in loops.into_iter().zip(face_of.chunk_by(|a, b| a == b)) {
        let triangles = first..first + run.len() as u32;
        first = triangles.end;
        let members = &mesh.triangles[triangles.start as usize..triangles.end as usize];
        let normal = members
            .iter()
            .fold(Vector3::zeros(), |n, t| n + check::newell(&mesh.points, t))
            .normalize();
        let height = |&v: &u32| normal.dot(&mesh.points[v as usize].coords);
        let n_corners: usize = loops.iter().map(Vec::len).sum();
        let offset = loops.iter().flatten().map(height).sum::<f64>() / n_corners as f64;
        faces.push(Face {
            normal,
            offset,
            loops,
            triangles,
        });
    }
    faces
}

fn edge(
    points: &[Point3<f64>],
    faces: &[Face],
    vertices: [u32; 2],
    beside: [u32; 2],
    size: f64,
) -> Edge {
    let [from, to] = vertices.map(|v| points[v as usize]);
    let [n0, n1] = beside.map(|f| faces[f as usize].normal);
    let length = (to - from).norm();
    let direction = (to - from) / length;
    let foot = from.coords - direction * direction.dot(&from.coords);
    let pseudo_normal = foot
        .try_normalize(LINE_THROUGH_CENTRE * size)
        .or_else(|| (n0 + n1).try_normalize(f64::MIN_POSITIVE))
        .unwrap_or(n0);
    Edge {
        vertices,
        faces: beside,
        direction,
        length,
        pseudo_normal,
        is_convex: n0.cross(&n1).dot(&direction) > 0.0,
    }
}

fn is_convex(corners: &[Point3<f64>], faces: &[Face], edges: &[Edge], size: f64) -> bool {
    // A closed surface without reflex edges, pinches or handles is convex unless it passes through itself.
    let euler = corners.len() as i64 - edges.len() as i64 + faces.len() as i64;
    let simple =
        euler == 2 && faces.iter().all(|f| f.loops.len() == 1) && edges.iter().all(|e| e.is_convex);
    let slack = 2.0 * COPLANAR_DISTANCE * size;
    let behind = |f: &Face| {
        corners
            .iter()
            .all(|p| f.normal.dot(&p.coords) - f.offset <= slack)
    };
    simple && (corners.len() * faces.len() > MAX_CONVEXITY_CHECKS || faces.iter().all(behind))
}
