//! Queries whose answers are known by hand.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::polyhedron::Polyhedron;
use crate::polyhedron::shapes::{cuboid, l_shape};
use crate::query::overlap::{Overlap, overlap};
use crate::query::point::{is_deeper, signed_distance, sweep_point};
use crate::query::segment::segment_cuts;
use crate::query::segment_depth::max_depth_on_segment;
use crate::query::segment_sweep::sweep_segment;

const P: fn(f64, f64, f64) -> Point3<f64> = Point3::new;

fn cube() -> Polyhedron {
    cuboid(&Vector3::repeat(2.0)).unwrap()
}

/// An L of width 3, height 3, thickness 1, depth 2, and the author's point in its own space.
fn l() -> (Polyhedron, impl Fn(f64, f64, f64) -> Point3<f64>) {
    let shape = l_shape(3.0, 3.0, 2.0, 1.0).unwrap();
    let g = shape.centroid().coords;
    (shape, move |x, y, z| P(x, y, z) - g)
}

fn normal_of(shape: &Polyhedron, face: u32) -> [f64; 3] {
    shape.faces()[face as usize].normal.map(f64::round).into()
}

#[test]
fn distances() {
    let cube = cube();
    for (p, distance, normal) in [
        (P(0.0, 0.9, 0.0), -0.1, [0.0, 1.0, 0.0]),
        (P(0.3, 0.5, -0.95), -0.05, [0.0, 0.0, -1.0]),
        (P(1.5, 0.2, 0.1), 0.5, [1.0, 0.0, 0.0]),
        (P(1.0, 0.0, 0.0), 0.0, [1.0, 0.0, 0.0]),
    ] {
        let found = signed_distance(&cube, &p);
        assert!(
            (found.distance - distance).abs() < 1e-15 && normal_of(&cube, found.face) == normal,
            "{found:?}"
        );
        assert_eq!(is_deeper(&cube, &p, 0.0), distance < 0.0);
    }
    assert!((signed_distance(&cube, &P(2.0, 2.0, 2.0)).distance - 3.0_f64.sqrt()).abs() < 1e-15);
    let (l, at) = l();
    for (p, distance) in [
        (at(0.5, 2.0, 0.0), -0.5),
        (at(2.0, 2.0, 0.0), 1.0),
        (at(1.1, 1.2, 0.0), 0.1),
        (at(0.9, 0.9, 0.0), -0.1 * 2.0_f64.sqrt()),
        (at(0.9, 0.2, 0.0), -0.2),
        (at(4.0, 2.0, 0.0), 2.0_f64.sqrt()),
    ] {
        assert!(
            (signed_distance(&l, &p).distance - distance).abs() < 1e-14,
            "{p}"
        );
        assert_eq!(is_deeper(&l, &p, 0.0), distance < 0.0);
    }
}

#[test]
fn point_paths() {
    // From, to, radius; fraction and normal of the face entered.
    let (cube, up, right) = (cube(), [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    let cases = [
        (P(0.2, 3.0, 0.1), P(0.2, -1.0, 0.1), 0.0, Some((0.5, up))),
        (P(0.2, 3.0, 0.1), P(0.2, -5.0, 0.1), 0.0, Some((0.25, up))),
        (P(0.2, 3.0, 0.1), P(0.2, -1.0, 0.1), 0.5, Some((0.375, up))),
        (P(0.2, 3.0, 0.1), P(0.2, 1.0, 0.1), 0.0, None),
        (P(0.2, 3.0, 0.1), P(0.2, 1.01, 0.1), 0.0, None),
        (P(0.2, 0.5, 0.1), P(0.2, -5.0, 0.1), 0.0, None),
        (P(0.2, 1.0, 0.1), P(0.2, 0.0, 0.1), 0.0, Some((0.0, up))),
        (P(0.2, 1.0, 0.1), P(0.2, 2.0, 0.1), 0.0, None),
        (P(0.2, 1.0, 0.1), P(0.4, 1.0, 0.1), 0.0, None),
        // Through an edge's middle and a corner: in by the lowest face; along an edge, touching a corner: not in.
        (P(2.0, 2.0, 0.0), P(0.0, 0.0, 0.0), 0.0, Some((0.5, right))),
        (
            P(2.0, 2.0, 2.0),
            P(0.0, 0.0, 0.0),
            0.0,
            Some((0.5, [0.0, 0.0, 1.0])),
        ),
        (P(0.0, 2.0, 0.0), P(2.0, 0.0, 0.0), 0.0, None),
        (P(1.0, 1.0, -5.0), P(1.0, 1.0, 5.0), 0.0, None),
        (P(5.0, 5.0, 5.0), P(5.0, 5.0, 5.0), 0.0, None),
        // The ball is round at an edge: 0.7 beside it, it passes at sqrt(0.98) > 0.9.
        (P(-3.0, 1.7, 1.7), P(3.0, 1.7, 1.7), 0.9, None),
    ];
    for (from, to, radius, expected) in cases {
        let found = sweep_point(&cube, &from, &to, radius);
        let found = found.map(|e| ((e.fraction * 1e12).round() / 1e12, normal_of(&cube, e.face)));
        assert_eq!(found, expected, "{from} {to}");
    }
}

#[test]
fn point_paths_in_a_notch() {
    let (l, at) = l();
    let enter = |from, to, radius| {
        sweep_point(&l, &from, &to, radius).map(|e| (e.fraction, normal_of(&l, e.face)))
    };
    let near = |found: Option<(f64, [f64; 3])>, fraction: f64, normal: [f64; 3]| {
        found.is_some_and(|(f, n)| (f - fraction).abs() < 1e-12 && n == normal)
    };
    assert!(near(
        enter(at(2.0, 2.0, 0.0), at(2.0, 0.0, 0.0), 0.0),
        0.5,
        [0.0, 1.0, 0.0]
    ));
    assert!(near(
        enter(at(2.0, 2.0, 0.0), at(2.0, -8.0, 0.0), 0.0),
        0.1,
        [0.0, 1.0, 0.0]
    ));
    assert!(near(
        enter(at(2.0, 2.0, 0.0), at(0.0, 2.0, 0.0), 0.25),
        0.375,
        [1.0, 0.0, 0.0]
    ));
    // Down through the notch's edge itself, and through a thin place twice.
    assert!(
        enter(at(2.0, 2.0, 0.0), at(0.0, 0.0, 0.0), 0.0)
            .is_some_and(|(f, _)| (f - 0.5).abs() < 1e-12)
    );
    assert!(near(
        enter(at(-1.0, 2.5, 0.0), at(4.0, 2.5, 0.0), 0.0),
        0.2,
        [-1.0, 0.0, 0.0]
    ));
    assert_eq!(enter(at(0.5, 2.5, 0.0), at(4.0, 2.5, 0.0), 0.0), None);
    assert_eq!(enter(at(2.0, 3.5, 0.0), at(3.5, 2.0, 0.0), 0.0), None);
    // Past the outer corner, touching its edge only.
    assert_eq!(enter(at(-1.0, 1.0, 0.0), at(1.0, -1.0, 0.0), 0.0), None);
}

#[test]
fn cuts() {
    let mut cuts = vec![];
    let cube = cube();
    segment_cuts(&cube, &P(0.0, 1.5, 0.25), &P(1.5, 0.0, 0.25), &mut cuts);
    assert_eq!(cuts.len(), 1);
    assert!(
        (cuts[0].on_edge - P(1.0, 1.0, 0.25)).norm() < 1e-15
            && (cuts[0].on_segment - 0.5).abs() < 1e-15
    );
    cuts.clear();
    // Opposite faces, an end inside, outside, through the corner only.
    segment_cuts(&cube, &P(0.0, 2.0, 0.0), &P(0.1, -2.0, 0.0), &mut cuts);
    segment_cuts(&cube, &P(0.0, 2.0, 0.0), &P(0.5, 0.5, 0.0), &mut cuts);
    segment_cuts(&cube, &P(0.0, 2.5, 0.0), &P(2.5, 0.0, 0.0), &mut cuts);
    segment_cuts(&cube, &P(0.0, 2.0, 0.0), &P(2.0, 0.0, 0.0), &mut cuts);
    assert_eq!(cuts, []);
    let (l, at) = l();
    // Across both tips of the L: two edges in one segment.
    segment_cuts(&l, &at(-0.5, 2.5, 0.0), &at(1.0, 4.0, 0.0), &mut cuts);
    segment_cuts(&l, &at(0.5, 3.25, 0.0), &at(3.25, 0.5, 0.0), &mut cuts);
    let places: Vec<Point3<f64>> = cuts.iter().map(|c| c.on_edge).collect();
    assert_eq!(places.len(), 2, "{cuts:?}");
    assert!(
        (places[0] - at(1.0, 3.0, 0.0)).norm() < 1e-12
            && (places[1] - at(3.0, 1.0, 0.0)).norm() < 1e-12
    );
}

#[test]
fn crossings_of_edges() {
    let mut out = vec![];
    let cube = cube();
    let ends = |y: f64, dx: f64| [P(dx, y, 0.1), P(2.0 + dx, y - 2.0, 0.1)];
    sweep_segment(&cube, ends(2.5, 0.0), ends(1.5, 0.0), &mut out);
    assert_eq!(out.len(), 1);
    assert!(
        (out[0].fraction - 0.5).abs() < 1e-12 && (out[0].on_edge - P(1.0, 1.0, 0.1)).norm() < 1e-12
    );
    assert!((out[0].on_segment - 0.5).abs() < 1e-12);
    out.clear();
    // Outward, beside, and standing still crosses nothing; a flick through the whole corner does.
    sweep_segment(&cube, ends(1.5, 0.0), ends(2.5, 0.0), &mut out);
    sweep_segment(&cube, ends(5.5, 0.0), ends(2.5, 0.0), &mut out);
    sweep_segment(&cube, ends(1.5, 0.0), ends(1.5, 0.0), &mut out);
    assert_eq!(out, []);
    sweep_segment(&cube, ends(2.5, 0.0), ends(-2.5, 0.0), &mut out);
    assert_eq!(out.len(), 1);
    out.clear();
    // A segment that turns about a far end down on an edge: at 45 degrees to it, a true quadratic.
    sweep_segment(
        &cube,
        [P(-3.0, 1.5, 3.0), P(3.0, 1.5, -1.0)],
        [P(-3.0, 0.0, 3.0), P(3.0, 1.5, -1.0)],
        &mut out,
    );
    assert!(!out.is_empty());
    // Into the notch: the reflex edge is never reported.
    let (l, at) = l();
    out.clear();
    sweep_segment(
        &l,
        [at(1.5, 1.5, -2.0), at(1.5, 1.6, 2.0)],
        [at(0.8, 0.8, -2.0), at(0.8, 0.9, 2.0)],
        &mut out,
    );
    assert!(out.iter().all(|c| l.edges()[c.edge as usize].is_convex));
}

#[test]
fn depths_of_segments() {
    let cube = cube();
    for (a, b, depth) in [
        (P(-3.0, 0.7, 0.0), P(3.0, 0.7, 0.0), 0.3),
        (P(0.0, 1.5, 0.0), P(1.5, 0.0, 0.0), 0.25),
        (P(0.0, 0.0, 0.0), P(0.9, 0.0, 0.0), 1.0),
        (P(0.0, 3.0, 0.0), P(0.0, 0.9, 0.0), 0.1),
        (P(0.2, 0.9, 0.0), P(0.2, 0.9, 0.0), 0.1),
    ] {
        assert!(
            (max_depth_on_segment(&cube, &a, &b) - depth).abs() < 1e-14,
            "{a} {b}"
        );
    }
    assert!(max_depth_on_segment(&cube, &P(0.0, 3.0, 0.0), &P(3.0, 0.0, 0.0)) <= 0.0);
    let (l, at) = l();
    assert!((max_depth_on_segment(&l, &at(2.0, 3.0, 0.0), &at(2.0, 0.7, 0.0)) - 0.3).abs() < 1e-12);
    assert!((max_depth_on_segment(&l, &at(-2.0, 2.0, 0.1), &at(4.0, 2.0, 0.1)) - 0.5).abs() < 1e-3);
    assert!(max_depth_on_segment(&l, &at(1.1, 4.0, 0.0), &at(1.2, 1.2, 0.0)) <= 0.0);
}

fn moved(p: Vector3<f64>) -> Isometry3<f64> {
    Translation3::from(p).into()
}

fn is_near(found: Option<Overlap>, depth: f64, normal: [f64; 3]) -> bool {
    found.is_some_and(|o| {
        (o.depth - depth).abs() < 1e-9 && (o.normal - Vector3::from(normal)).norm() < 1e-6
    })
}

#[test]
fn overlaps_of_boxes() {
    let cube = cube();
    assert!(is_near(
        overlap(&cube, &cube, &moved(Vector3::new(0.1, 1.9, 0.2))),
        0.1,
        [0.0, 1.0, 0.0]
    ));
    assert!(is_near(
        overlap(&cube, &cube, &moved(Vector3::new(0.1, 0.2, -1.8))),
        0.2,
        [0.0, 0.0, -1.0]
    ));
    for apart in [2.0, 2.0 - 0.5e-7, 2.5, 9.0] {
        assert_eq!(
            overlap(&cube, &cube, &moved(Vector3::new(0.1, apart, 0.2))),
            None
        );
    }
    // Two edges across: each cube stands on an edge, turned against the other.
    let turn =
        |axis: Vector3<f64>| UnitQuaternion::from_scaled_axis(axis * core::f64::consts::FRAC_PI_4);
    let lower = Isometry3::from_parts(Translation3::identity(), turn(Vector3::z()));
    let upper = |y: f64| Isometry3::from_parts(Translation3::new(0.0, y, 0.0), turn(Vector3::x()));
    let reach = 8.0_f64.sqrt();
    let found = overlap(&cube, &cube, &(lower.inverse() * upper(reach - 0.1)));
    assert!(
        is_near(
            found.map(|o| Overlap {
                normal: lower * o.normal,
                ..o
            }),
            0.1,
            [0.0, 1.0, 0.0]
        ),
        "{found:?}"
    );
    assert_eq!(
        overlap(&cube, &cube, &(lower.inverse() * upper(reach + 1e-6))),
        None
    );
}

#[test]
fn overlaps_with_an_l() {
    let (l, at) = l();
    let small = cuboid(&Vector3::repeat(1.0)).unwrap();
    let put = |x: f64, y: f64, z: f64| moved(at(x, y, z).coords);
    let of = |x, y, z| overlap(&l, &small, &put(x, y, z));
    // On the foot, against the upright, in the corner, over the rim, on top; and each just touching.
    assert!(is_near(of(2.2, 1.49, 0.0), 0.01, [0.0, 1.0, 0.0]));
    assert!(
        is_near(of(1.48, 2.0, 0.0), 0.02, [1.0, 0.0, 0.0]),
        "{:?}",
        of(1.48, 2.0, 0.0)
    );
    let both = of(1.498, 1.49, 0.0).unwrap();
    assert!(
        (both.normal * both.depth - Vector3::new(0.002, 0.01, 0.0)).norm() < 1e-6,
        "{both:?}"
    );
    assert!(is_near(of(3.2, 1.49, 0.9), 0.01, [0.0, 1.0, 0.0]));
    assert!(is_near(of(0.5, 3.48, 0.0), 0.02, [0.0, 1.0, 0.0]));
    for touching in [
        of(2.2, 1.5, 0.0),
        of(1.5, 1.5, 0.0),
        of(1.5, 1.5 - 5e-8, 0.0),
        of(3.2, 1.5, 0.9),
        of(0.5, 3.5, 0.0),
    ] {
        assert_eq!(touching, None);
    }
    assert_eq!(of(2.2, 2.5, 0.0), None);
    // The other way round the normal turns round.
    let turned = overlap(&small, &l, &put(2.2, 1.49, 0.0).inverse());
    assert!(is_near(turned, 0.01, [0.0, -1.0, 0.0]), "{turned:?}");
    // A plate that overhangs the foot on both sides has no corner in the L.
    let plate = cuboid(&Vector3::new(1.0, 0.2, 5.0)).unwrap();
    assert!(is_near(
        overlap(&l, &plate, &put(2.2, 1.09, 0.0)),
        0.01,
        [0.0, 1.0, 0.0]
    ));
    // A bar across the foot, as thick as it and at its height: their edges only touch.
    let bar = cuboid(&Vector3::new(1.0, 1.0, 6.0)).unwrap();
    assert!(overlap(&l, &bar, &put(2.2, 0.5, 0.0)).is_some());
}
