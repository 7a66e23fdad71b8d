//! Laws that hold for any shape and any question, against slow and simple answers.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::{ProptestConfig, Strategy, prop_assert, prop_assume, proptest};
use proptest::test_runner::RngSeed;

use super::{is_inside, shapes};
use crate::polyhedron::Polyhedron;
use crate::query::overlap::overlap;
use crate::query::point::{signed_distance, sweep_point};
use crate::query::segment::segment_cuts;
use crate::query::segment_depth::max_depth_on_segment;
use crate::query::segment_sweep::sweep_segment;

fn config() -> ProptestConfig {
    let base = ProptestConfig {
        rng_seed: RngSeed::Fixed(1998),
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    ProptestConfig {
        cases: 96,
        max_global_rejects: 20_000,
        ..base
    }
}

fn vector(reach: f64) -> impl Strategy<Value = Vector3<f64>> {
    [-reach..reach, -reach..reach, -reach..reach].prop_map(Vector3::from)
}

fn point(reach: f64) -> impl Strategy<Value = Point3<f64>> {
    vector(reach).prop_map(Point3::from)
}

fn pose(reach: f64) -> impl Strategy<Value = Isometry3<f64>> {
    (vector(reach), vector(3.0)).prop_map(|(at, turn)| {
        Isometry3::from_parts(
            Translation3::from(at),
            UnitQuaternion::from_scaled_axis(turn),
        )
    })
}

/// Least distance to a dense net of surface points: too large by at most half the net's width.
fn distance_by_net(shape: &Polyhedron, p: &Point3<f64>) -> (f64, f64) {
    const N: u32 = 24;
    let (mut least, mut width) = (f64::INFINITY, 0.0_f64);
    for t in 0..shape.triangles().len() as u32 {
        let [a, b, c] = shape.triangle_corners(t);
        width = width.max((b - a).norm().max((c - a).norm()).max((c - b).norm()) / f64::from(N));
        for (i, j) in (0..=N).flat_map(|i| (0..=N - i).map(move |j| (f64::from(i), f64::from(j)))) {
            let q = a + (b - a) * (i / f64::from(N)) + (c - a) * (j / f64::from(N));
            least = least.min((q - p).norm());
        }
    }
    (least, width)
}

fn at(a: &Point3<f64>, b: &Point3<f64>, fraction: f64) -> Point3<f64> {
    a + (b - a) * fraction
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn distance_agrees_with_brute_force(which in 0..7_usize, p in point(3.0)) {
        let shape = &shapes()[which];
        let found = signed_distance(shape, &p);
        let (net, width) = distance_by_net(shape, &p);
        prop_assert!(found.distance.abs() <= net + 1e-12 && found.distance.abs() >= net - width);
        prop_assert!((found.distance < 0.0) == is_inside(shape, &p));
        prop_assert!(((found.on_surface - p).norm() - found.distance.abs()).abs() < 1e-12);
        let face = &shape.faces()[found.face as usize];
        prop_assert!((face.normal.dot(&found.on_surface.coords) - face.offset).abs() < 1e-9);
    }

    #[test]
    fn a_path_enters_where_dense_samples_do(which in 0..7_usize, a in point(3.0), b in point(3.0), ball in 0..3_u32) {
        let shape = &shapes()[which];
        let radius = 0.2 * f64::from(ball);
        let is_in = |p: &Point3<f64>| signed_distance(shape, p).distance < radius;
        prop_assume!(!is_in(&a));
        let first = (1..=1000).map(|i| f64::from(i) / 1000.0).find(|&f| is_in(&at(&a, &b, f)));
        match sweep_point(shape, &a, &b, radius) {
            None => prop_assert!(first.is_none(), "missed the entry before {first:?}"),
            Some(entry) => {
                prop_assert!(first.is_none_or(|f| f >= entry.fraction));
                let place = at(&a, &b, entry.fraction);
                prop_assert!((signed_distance(shape, &place).distance - radius).abs() < 1e-9);
                prop_assert!(((place - entry.point).norm() - radius).abs() < 1e-9);
                let face = &shape.faces()[entry.face as usize];
                prop_assert!((face.normal.dot(&entry.point.coords) - face.offset).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn no_path_slips_through_an_edge_or_corner(which in 0..7_usize, pick in 0..1000_usize, along in 0..5_u32, a in point(4.0)) {
        let shape = &shapes()[which];
        prop_assume!(signed_distance(shape, &a).distance > 0.0);
        let [from, to] = shape.edge_ends((pick % shape.edges().len()) as u32);
        let through = at(&from, &to, f64::from(along) / 4.0);
        let b = a + (through - a) * 1.5;
        let is_deep = (1..1000).any(|i| signed_distance(shape, &at(&a, &b, f64::from(i) / 1000.0)).distance < -1e-9);
        prop_assert!(!is_deep || sweep_point(shape, &a, &b, 0.0).is_some());
    }

    #[test]
    fn a_long_segment_gets_in_over_an_edge(which in 0..5_usize, a in vector(3.0), turn in vector(3.0), step in vector(3.0)) {
        // A segment much longer than a convex shape gets in only sideways, over an edge.
        let shape = &shapes()[which];
        let half = UnitQuaternion::from_scaled_axis(turn) * Vector3::x() * 50.0;
        let ends = |p: Vector3<f64>| [Point3::from(p - half), Point3::from(p + half)];
        let (from, to) = (ends(a), ends(a + step));
        let depth = |[p, q]: &[Point3<f64>; 2]| max_depth_on_segment(shape, p, q);
        prop_assume!(depth(&from) < -1e-6 && depth(&to) > 1e-6);
        let mut crossed = vec![];
        sweep_segment(shape, from, to, &mut crossed);
        prop_assert!(!crossed.is_empty());
        for c in crossed {
            let moved = [at(&from[0], &to[0], c.fraction), at(&from[1], &to[1], c.fraction)];
            prop_assert!((at(&moved[0], &moved[1], c.on_segment) - c.on_edge).norm() < 1e-7);
            prop_assert!(signed_distance(shape, &c.on_edge).distance.abs() < 1e-9);
        }
    }

    #[test]
    fn cuts_are_of_edges_between_the_faces_cut(which in 0..7_usize, a in point(3.0), b in point(3.0)) {
        let shape = &shapes()[which];
        let (mut cuts, mut back) = (vec![], vec![]);
        segment_cuts(shape, &a, &b, &mut cuts);
        segment_cuts(shape, &b, &a, &mut back);
        back.reverse();
        prop_assert!(cuts.iter().map(|c| c.edge).eq(back.iter().map(|c| c.edge)));
        for cut in &cuts {
            prop_assert!((0.0..=1.0).contains(&cut.on_segment));
            prop_assert!(max_depth_on_segment(shape, &a, &b) > 0.0);
            let [n0, n1] = shape.edges()[cut.edge as usize].faces.map(|f| shape.faces()[f as usize].normal);
            prop_assert!((b - a).dot(&n0) * (b - a).dot(&n1) < 0.0);
        }
    }

    #[test]
    fn depth_of_a_segment_agrees_with_samples(which in 0..7_usize, a in point(2.0), b in point(2.0)) {
        let shape = &shapes()[which];
        let sampled = (0..=1000).map(|i| -signed_distance(shape, &at(&a, &b, f64::from(i) / 1000.0)).distance);
        let sampled = sampled.fold(f64::NEG_INFINITY, f64::max);
        let (found, length) = (max_depth_on_segment(shape, &a, &b), (b - a).norm());
        if sampled > 0.0 {
            prop_assert!(found >= sampled - length / 256.0 && found <= sampled + length / 1000.0);
        } else {
            prop_assert!(found <= length / 1000.0);
        }
    }

    #[test]
    fn overlap_of_convex_shapes_is_the_shortest_way_out(i in 0..4_usize, j in 0..4_usize, pose in pose(1.5)) {
        let shapes = shapes();
        let (a, b) = (&shapes[i], &shapes[j]);
        let moved = |by: Vector3<f64>| Translation3::from(by) * pose;
        if let Some(found) = overlap(a, b, &pose) {
            prop_assert!((found.normal.norm() - 1.0).abs() < 1e-12);
            prop_assert!(overlap(a, b, &moved(found.normal * (found.depth + 1e-9))).is_none());
            prop_assert!(overlap(a, b, &moved(found.normal * (found.depth * 0.97 - 2e-6))).is_some() || found.depth < 1e-5);
            // No other direction is shorter.
            for face in a.faces() {
                prop_assert!(overlap(a, b, &moved(face.normal * (found.depth * 0.97 - 2e-6))).is_some() || found.depth < 1e-5);
            }
            let back = overlap(b, a, &pose.inverse()).map(|o| (o.depth - found.depth).abs());
            prop_assert!(back.is_some_and(|d| d < 1e-6 + 0.021 * found.depth));
        }
    }

    #[test]
    fn overlap_agrees_with_sampling(i in 0..7_usize, j in 0..7_usize, pose in pose(2.0)) {
        let shapes = shapes();
        let (a, b) = (&shapes[i], &shapes[j]);
        let (lo, hi) = (b.aabb().lo, b.aabb().hi);
        let grid = |k: u32| f64::from(k) / 14.0;
        let places = (0..15 * 15 * 15).map(|k| Vector3::new(grid(k % 15), grid(k / 15 % 15), grid(k / 225)));
        let deepest = places
            .map(|f| lo + (hi - lo).component_mul(&f))
            .map(|p| -signed_distance(b, &p).distance.max(signed_distance(a, &(pose * p)).distance))
            .fold(f64::NEG_INFINITY, f64::max);
        let found = overlap(a, b, &pose);
        prop_assert!(deepest <= 1e-6 || found.is_some(), "missed a common place {deepest} deep");
        // The grid is up to 0.3 wide: without a common ball of that size it may see nothing.
        prop_assert!(deepest > -0.3 || found.is_none(), "found {found:?} where samples are {deepest} apart");
    }

    #[test]
    fn a_rigid_move_of_all_moves_the_answer(which in 0..7_usize, pose in pose(5.0), p in point(3.0), q in point(3.0)) {
        let shape = &shapes()[which];
        let points: Vec<Point3<f64>> = shape.points().iter().map(|v| pose * v).collect();
        let faces: Vec<Vec<u32>> = shape.triangles().iter().map(|t| t.vertices.to_vec()).collect();
        let turned = Polyhedron::from_faces(&points, &faces).unwrap();
        prop_assert!((turned.centroid() - pose.translation.vector).coords.norm() < 1e-12);
        prop_assert!((turned.volume() / shape.volume() - 1.0).abs() < 1e-12);
        prop_assert!(turned.is_convex() == shape.is_convex() && turned.edges().len() == shape.edges().len());
        let turn = pose.rotation;
        let (tp, tq) = (turn * p, turn * q);
        let (d0, d1) = (signed_distance(shape, &p), signed_distance(&turned, &tp));
        prop_assert!((d0.distance - d1.distance).abs() < 1e-12);
        let (e0, e1) = (sweep_point(shape, &p, &q, 0.0), sweep_point(&turned, &tp, &tq, 0.0));
        prop_assert!(e0.is_some() == e1.is_some());
        if let (Some(e0), Some(e1)) = (e0, e1) {
            prop_assert!((e0.fraction - e1.fraction).abs() < 1e-10);
        }
        let (mut c0, mut c1) = (vec![], vec![]);
        segment_cuts(shape, &p, &q, &mut c0);
        segment_cuts(&turned, &tp, &tq, &mut c1);
        prop_assert!(c0.len() == c1.len() && c0.iter().zip(&c1).all(|(x, y)| (turn * x.on_edge - y.on_edge).norm() < 1e-9));
    }
}
