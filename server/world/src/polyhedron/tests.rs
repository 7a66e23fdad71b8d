//! Shapes by values: counts, volumes, what is merged, what is refused.

use nalgebra::{Matrix3, Point3, Vector3};

use super::Polyhedron;
use super::fault::ShapeFault;
use super::shapes::{cuboid, ellipsoid, l_shape, prism, pyramid};
use super::weld::weld;

/// A square frame (one handle): outer width 4, inner 2, height 1, every face of several quads.
pub(crate) fn frame() -> Polyhedron {
    let ring = |half: f64, y: f64| {
        [[half, half], [half, -half], [-half, -half], [-half, half]].map(|[x, z]| [x, y, z])
    };
    let rings = [
        ring(2.0, 0.0),
        ring(2.0, 1.0),
        ring(1.0, 0.0),
        ring(1.0, 1.0),
    ];
    let vertices: Vec<Point3<f64>> = rings.into_iter().flatten().map(Point3::from).collect();
    let faces: Vec<Vec<u32>> = (0..4)
        .map(|k| (k, (k + 1) % 4))
        .flat_map(|(k, l)| {
            [
                vec![k, l, 4 + l, 4 + k],
                vec![8 + l, 8 + k, 12 + k, 12 + l],
                vec![4 + k, 4 + l, 12 + l, 12 + k],
                vec![l, k, 8 + k, 8 + l],
            ]
        })
        .collect();
    Polyhedron::from_faces(&vertices, &faces).unwrap()
}

fn check(shape: &Polyhedron, [vertices, edges, faces]: [usize; 3], volume: f64, is_convex: bool) {
    assert_eq!(
        [
            shape.vertices().len(),
            shape.edges().len(),
            shape.faces().len()
        ],
        [vertices, edges, faces]
    );
    assert!(
        (shape.volume() - volume).abs() <= 1e-12 * volume,
        "{} for {volume}",
        shape.volume()
    );
    assert_eq!(shape.is_convex(), is_convex);
    let holes: usize = shape.faces().iter().map(|f| f.loops.len() - 1).sum();
    let euler = vertices as i64 - edges as i64 + faces as i64 - holes as i64;
    assert!(euler == 2 || (!is_convex && euler == 0), "Euler: {euler}");
    for (face, of) in (0_u32..).zip(shape.faces()) {
        for &v in of.loops.iter().flatten() {
            assert!(
                (of.normal.dot(&shape.vertices()[v as usize].coords) - of.offset).abs() < 1e-12,
                "face {face}"
            );
        }
        assert!(
            shape.triangles()[of.triangles.start as usize..of.triangles.end as usize]
                .iter()
                .all(|t| t.face == face)
        );
    }
}

#[test]
fn primitives_have_their_parts_and_volume() {
    check(
        &cuboid(&Vector3::new(0.1, 0.2, 0.3)).unwrap(),
        [8, 12, 6],
        0.006,
        true,
    );
    check(&pyramid(0.2, 0.3, 0.5).unwrap(), [5, 8, 5], 0.01, true);
    check(
        &l_shape(0.3, 0.4, 0.5, 0.1).unwrap(),
        [12, 18, 8],
        0.5 * (0.03 + 0.03),
        false,
    );
    let hexagon = 1.5 * 3.0_f64.sqrt() * 0.01;
    check(
        &prism(6, 0.1, 0.7).unwrap(),
        [12, 18, 8],
        hexagon * 0.7,
        true,
    );
    check(&frame(), [16, 24, 10], 12.0, false);
    // Two frusta and two pyramids on regular octagons of circumradius 1 and sqrt(1/2), area 2 sqrt 2 r^2.
    let (area, h) = (8.0_f64.sqrt(), 0.5_f64.sqrt());
    let unit = 2.0 * area / 3.0 * (h * (1.0 + 0.5 + h) + (1.0 - h) * 0.5);
    check(
        &ellipsoid(&Vector3::new(0.3, 0.2, 0.1)).unwrap(),
        [26, 56, 32],
        unit * 0.006,
        true,
    );
}

#[test]
fn origin_is_the_centre_of_gravity_and_inertia_is_about_it() {
    let at = Vector3::new(3.0, -2.0, 1.0);
    let base = cuboid(&Vector3::new(1.0, 2.0, 3.0)).unwrap();
    let moved: Vec<Point3<f64>> = base.vertices().iter().map(|p| p + at).collect();
    let faces: Vec<Vec<u32>> = base.faces().iter().map(|f| f.loops[0].clone()).collect();
    let shape = Polyhedron::from_faces(&moved, &faces).unwrap();
    assert!((shape.centroid() - at).coords.norm() < 1e-14);
    let expected = Matrix3::from_diagonal(&Vector3::new(13.0, 10.0, 5.0)) * 0.5;
    assert!(
        (shape.unit_inertia() - expected).norm() < 1e-13,
        "{}",
        shape.unit_inertia()
    );
    // Pyramid: G a quarter of the height above the base.
    assert!(
        (pyramid(1.0, 1.0, 0.8).unwrap().centroid() - Point3::new(0.0, 0.2, 0.0)).norm() < 1e-15
    );
    // L of two 1 x 3 and 1 x 1 blocks: by areas.
    let l = l_shape(2.0, 3.0, 1.0, 1.0).unwrap();
    assert!(
        (l.centroid() - Point3::new(0.75, 1.25, 0.0)).norm() < 1e-15,
        "{}",
        l.centroid()
    );
}

#[test]
fn edges_know_their_faces_and_pseudo_normals() {
    let cube = cuboid(&Vector3::repeat(0.2)).unwrap();
    for edge in cube.edges() {
        let sum = edge
            .faces
            .iter()
            .map(|&f| cube.faces()[f as usize].normal)
            .sum::<Vector3<f64>>();
        assert!((edge.pseudo_normal - sum.normalize()).norm() < 1e-15);
        assert!(edge.is_convex && (edge.length - 0.2).abs() < 1e-16);
    }
    let l = l_shape(0.3, 0.3, 0.1, 0.1).unwrap();
    let reflex: Vec<_> = l.edges().iter().filter(|e| !e.is_convex).collect();
    assert_eq!(reflex.len(), 1);
    assert_eq!(reflex[0].direction.z.abs(), 1.0);
}

#[test]
fn an_edge_through_the_centre_takes_the_mean_normal() {
    // An L whose reflex edge (thickness, thickness) is its centre of gravity: 3 t^2 - 3 t + 1 ... solved for w = 1.
    // Area 2t - t^2, moment t/2 + (1 - t) t^2 / 2 = t (2t - t^2) gives t^2 - 3 t + 1 = 0.
    let t = (3.0 - 5.0_f64.sqrt()) / 2.0;
    let l = l_shape(1.0, 1.0, 1.0, t).unwrap();
    let edge = l.edges().iter().find(|e| !e.is_convex).unwrap();
    assert!(
        (edge.pseudo_normal - Vector3::new(1.0, 1.0, 0.0).normalize()).norm() < 1e-12,
        "{}",
        edge.pseudo_normal
    );
}

/// A cube whose faces are grids of `n` by `n` squares, each cut into two triangles, every triangle with corners of
/// its own as in an STL file.
fn stl_cube(n: u32) -> Vec<Point3<f64>> {
    let step = f64::from(2) / f64::from(n);
    let mut corners = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (f64::from(i), f64::from(j)))) {
                let at = |i: f64, j: f64| {
                    let mut p = [0.0; 3];
                    p[axis] = side;
                    (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (-1.0 + i * step, -1.0 + j * step);
                    Point3::from(p)
                };
                let [a, b, c, d] = [
                    at(i, j),
                    at(i + 1.0, j),
                    at(i + 1.0, j + 1.0),
                    at(i, j + 1.0),
                ];
                corners.extend(if side > 0.0 {
                    [a, b, c, a, c, d]
                } else {
                    [a, c, b, a, d, c]
                });
            }
        }
    }
    corners
}

#[test]
fn coplanar_triangles_and_straight_chains_are_merged() {
    for n in [1, 2, 5] {
        let (vertices, stands_for) = weld(&stl_cube(n), 1e-9);
        assert_eq!(vertices.len(), 6 * n as usize * n as usize + 2);
        let faces: Vec<Vec<u32>> = stands_for.chunks(3).map(<[u32]>::to_vec).collect();
        let shape = Polyhedron::from_faces(&vertices, &faces).unwrap();
        check(&shape, [8, 12, 6], 8.0, true);
        assert_eq!(shape.triangles().len(), 12 * n as usize * n as usize);
        assert!(shape.edges().iter().all(|e| (e.length - 2.0).abs() < 1e-15));
    }
}

#[test]
fn bent_and_concave_polygons_are_cut_well() {
    // A box whose lid is one concave polygon with corners on a straight line, and whose floor is bent.
    let l = l_shape(0.3, 0.4, 0.5, 0.1).unwrap();
    let faces: Vec<Vec<u32>> = l.faces().iter().map(|f| f.loops[0].clone()).collect();
    check(
        &Polyhedron::from_faces(l.vertices(), &faces).unwrap(),
        [12, 18, 8],
        0.03,
        false,
    );
    let cube = cuboid(&Vector3::repeat(1.0)).unwrap();
    let mut vertices = cube.vertices().to_vec();
    vertices[0] += Vector3::new(-0.1, -0.1, -0.1);
    let faces: Vec<Vec<u32>> = cube.faces().iter().map(|f| f.loops[0].clone()).collect();
    let bent = Polyhedron::from_faces(&vertices, &faces).unwrap();
    assert_eq!(
        [
            bent.vertices().len(),
            bent.edges().len(),
            bent.faces().len()
        ],
        [8, 15, 9]
    );
}

#[test]
fn weld_keeps_the_first_and_follows_no_chain() {
    let at = |x: f64| Point3::new(x, 0.0, 0.0);
    let (kept, ids) = weld(
        &[
            at(0.0),
            at(1.0),
            at(0.9e-3),
            at(1.8e-3),
            at(1.0),
            at(f64::NAN),
        ],
        1e-3,
    );
    assert_eq!(ids, [0, 1, 0, 2, 1, 3]);
    assert_eq!(kept[..3], [at(0.0), at(1.0), at(1.8e-3)]);
}

fn cube_parts() -> (Vec<Point3<f64>>, Vec<Vec<u32>>) {
    let cube = cuboid(&Vector3::repeat(1.0)).unwrap();
    (
        cube.vertices().to_vec(),
        cube.faces().iter().map(|f| f.loops[0].clone()).collect(),
    )
}

/// Builds the unit cube after `spoil` has had its way with it.
fn fault(spoil: impl Fn(&mut Vec<Point3<f64>>, &mut Vec<Vec<u32>>)) -> ShapeFault {
    let (mut vertices, mut faces) = cube_parts();
    spoil(&mut vertices, &mut faces);
    Polyhedron::from_faces(&vertices, &faces).unwrap_err()
}

#[test]
fn bad_meshes_are_refused_with_their_place() {
    assert_eq!(fault(|_, f| f.clear()), ShapeFault::Empty);
    assert_eq!(
        fault(|v, _| v[3].y = f64::NAN),
        ShapeFault::NotFinite { vertex: 3 }
    );
    assert_eq!(
        fault(|_, f| f[4][1] = 99),
        ShapeFault::IndexOutOfRange { face: 4, index: 99 }
    );
    assert_eq!(
        fault(|_, f| f[2] = vec![0, 1]),
        ShapeFault::DegenerateFace { face: 2 }
    );
    assert_eq!(
        fault(|_, f| f[2] = vec![0, 1, 0, 2]),
        ShapeFault::DegenerateFace { face: 2 }
    );
    assert!(matches!(
        fault(|_, f| drop(f.remove(3))),
        ShapeFault::OpenEdge { .. }
    ));
    assert!(matches!(
        fault(|_, f| f[5].reverse()),
        ShapeFault::InconsistentOrientation { faces: [_, 5], .. }
    ));
    assert!(matches!(
        fault(|_, f| f.push(f[0].clone())),
        ShapeFault::NonManifoldEdge { n_faces: 3, .. }
    ));
    assert!(
        matches!(fault(|_, f| f.iter_mut().for_each(|f| f.reverse())), ShapeFault::InsideOut { volume } if volume < 0.0)
    );
    assert!(matches!(
        fault(|v, _| v.iter_mut().for_each(|p| p.y *= 1e-13)),
        ShapeFault::DegenerateFace { .. }
    ));
    assert!(matches!(
        fault(|v, _| v.iter_mut().for_each(|p| *p *= 1e-9)),
        ShapeFault::SizeOutOfRange { .. }
    ));
    assert!(matches!(
        fault(|v, _| v.iter_mut().for_each(|p| *p *= 1e300)),
        ShapeFault::SizeOutOfRange { .. }
    ));
}

#[test]
fn bad_wholes_are_refused() {
    let twice = fault(|v, f| {
        let second: Vec<Vec<u32>> = f
            .iter()
            .map(|f| f.iter().map(|i| i + 8).collect())
            .collect();
        v.extend(v.clone().iter().map(|p| p + Vector3::x() * 3.0));
        f.extend(second);
    });
    assert_eq!(
        twice,
        ShapeFault::Disconnected {
            n_parts: 2,
            face: 6
        }
    );
    let too_long = fault(|_, f| f[1] = vec![0; 5000]);
    assert!(matches!(
        too_long,
        ShapeFault::TooManyCorners {
            face: 1,
            count: 5000,
            ..
        }
    ));
    let flat = Polyhedron::from_faces(&cube_parts().0[..4], &[vec![0, 1, 2, 3], vec![3, 2, 1, 0]])
        .unwrap_err();
    assert!(matches!(flat, ShapeFault::ZeroVolume { .. }));
}

#[test]
fn unused_vertices_are_dropped_and_bad_measures_named() {
    let (mut vertices, faces) = cube_parts();
    vertices.push(Point3::new(1e9, 0.0, 0.0));
    check(
        &Polyhedron::from_faces(&vertices, &faces).unwrap(),
        [8, 12, 6],
        1.0,
        true,
    );
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            cuboid(&Vector3::new(1.0, value, 1.0)),
            Err(ShapeFault::BadMeasure { .. })
        ));
        assert!(matches!(
            l_shape(1.0, 1.0, value, 0.5),
            Err(ShapeFault::BadMeasure { .. })
        ));
    }
    assert!(matches!(
        prism(2, 1.0, 1.0),
        Err(ShapeFault::BadMeasure { .. })
    ));
    assert!(matches!(
        l_shape(1.0, 1.0, 1.0, 1.0),
        Err(ShapeFault::BadMeasure { .. })
    ));
}
