//! Each case of the floor (model §7), worked out by hand on poses of a 50 mm cube.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use tsukamu_world::environment::floor::{FloorScratch, Outcome, Settled, lifted, settle};

use crate::script::cube;

const GRAVITY: Vector3<f64> = Vector3::new(0.0, -9.81, 0.0);
const HALF: f64 = 0.025;

fn on_floor(rotation: UnitQuaternion<f64>) -> Isometry3<f64> {
    let cube = cube(2.0 * HALF);
    let up = Isometry3::from_parts(nalgebra::Translation3::identity(), rotation);
    // From 10 cm below, so that lifting puts the deepest vertex exactly on the floor.
    lifted(
        &cube,
        &(nalgebra::Translation3::new(0.0, -0.1, 0.0) * up),
        0.0,
    )
}

fn settled(pose: &Isometry3<f64>, gm: [f64; 3]) -> Settled {
    settle(
        &cube(2.0 * HALF),
        pose,
        &Vector3::from(gm),
        &GRAVITY,
        0.0,
        &mut FloorScratch::default(),
    )
}

fn check_turn(pose: &Isometry3<f64>, gm: [f64; 3], case: u8, centre: [f64; 3], tangent: f64) {
    let after = settled(pose, gm);
    assert_eq!(
        after.outcome,
        Outcome::Toppling {
            case,
            struck: false
        }
    );
    let angle = pose.rotation.angle_to(&after.pose.rotation);
    assert!(
        (angle - libm::atan(tangent)).abs() < 1e-9,
        "turned by {angle}, expected arctan {tangent}"
    );
    // The centre of the turn stays where it is.
    let centre = Point3::from(centre);
    let moved = after.pose * pose.inverse_transform_point(&centre);
    assert!((moved - centre).norm() < 1e-9, "the centre went to {moved}");
}

#[test]
fn stable_over_a_face() {
    let flat = on_floor(UnitQuaternion::identity());
    assert_eq!(settled(&flat, [0.0, -1e-4, 0.0]).outcome, Outcome::Stable);
    // G′ = G + 25 mm down and 20 mm aside: still within ±25 mm.
    assert_eq!(
        settled(&flat, [0.8e-4, -1e-4, 0.0]).outcome,
        Outcome::Stable
    );
    // Exactly over the side.
    assert_eq!(settled(&flat, [1e-4, -1e-4, 0.0]).outcome, Outcome::Stable);
}

#[test]
fn three_or_more_vertices_topple_over_the_two_nearest() {
    // G′ 50 mm aside: over the side at x = +25 mm, between its corners, so about their line.
    // C is (25, 0, 0), CG = (-25, 25, 0); Gm = (2, -1, 0)e-4: along (-1, 1)/√2 it is -3e-4/√2, so
    // T = (1.5, -1.5)e-4, R = (0.5, 0.5)e-4; tan = |R|/|CG| = 0.5e-4/0.025.
    let flat = on_floor(UnitQuaternion::identity());
    check_turn(
        &flat,
        [2e-4, -1e-4, 0.0],
        3,
        [HALF, 0.0, 0.0],
        0.5e-4 / HALF,
    );
}

#[test]
fn one_vertex_turns_about_it() {
    // On a corner, tilted so that the space diagonal leans toward +x: only one vertex on the floor.
    let upright =
        UnitQuaternion::rotation_between(&Vector3::new(1.0, 1.0, 1.0), &Vector3::y()).unwrap();
    let lean = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -0.1);
    let pose = on_floor(lean * upright);
    let g = pose.translation.vector;
    let corner = pose * Point3::new(-HALF, -HALF, -HALF);
    assert!(corner.y.abs() < 1e-12);
    // Straight down by 1e-4: CG leans by 0.1 rad, so R = 1e-4 sin 0.1 across a lever of 25√3 mm.
    let lever = HALF * 3.0_f64.sqrt();
    assert!(((g - corner.coords).norm() - lever).abs() < 1e-12);
    check_turn(
        &pose,
        [0.0, -1e-4, 0.0],
        1,
        corner.coords.into(),
        1e-4 * libm::sin(0.1) / lever,
    );
    // Upright on the corner and straight down: Gm ∥ CG, balanced.
    assert_eq!(
        settled(&on_floor(upright), [0.0, -1e-4, 0.0]).outcome,
        Outcome::Balanced
    );
}

#[test]
fn two_vertices_turn_about_their_line_while_g_is_between_them() {
    // On the edge along z, leaning 0.2 rad past the balance toward -x (turned about +z from 45°).
    let pose = on_floor(UnitQuaternion::from_axis_angle(
        &Vector3::z_axis(),
        std::f64::consts::FRAC_PI_4 + 0.2,
    ));
    let corner = pose * Point3::new(-HALF, -HALF, 0.0);
    assert!(corner.y.abs() < 1e-12);
    // Lever 25√2 mm at 0.2 rad from the vertical: R = 1e-4 sin 0.2.
    let lever = HALF * 2.0_f64.sqrt();
    check_turn(
        &pose,
        [0.0, -1e-4, 0.0],
        2,
        corner.coords.into(),
        1e-4 * libm::sin(0.2) / lever,
    );
    // A part of Gm along the edge does not count in 2b.
    check_turn(
        &pose,
        [0.0, -1e-4, 0.5e-4],
        2,
        corner.coords.into(),
        1e-4 * libm::sin(0.2) / lever,
    );
}

#[test]
fn two_vertices_turn_about_the_nearer_one_when_g_falls_beyond_it() {
    // The same edge; Gm leads 4 times as far along +z as down: G′ lies beyond the vertex at z = +25 mm.
    let pose = on_floor(UnitQuaternion::from_axis_angle(
        &Vector3::z_axis(),
        std::f64::consts::FRAC_PI_4,
    ));
    let vertex = pose * Point3::new(-HALF, -HALF, HALF);
    let gm = Vector3::new(0.0, -1e-4, 4e-4);
    let cg = pose.translation.vector - vertex.coords;
    // CG = (0, 25√2, -25) mm. Split by hand: Gm·CG = -1e-4·25√2e-3 - 4e-4·25e-3.
    let along = cg * (gm.dot(&cg) / cg.norm_squared());
    let across = gm - along;
    check_turn(
        &pose,
        gm.into(),
        2,
        vertex.coords.into(),
        across.norm() / cg.norm(),
    );
}

#[test]
fn a_topple_stops_with_the_next_vertex_on_the_floor() {
    // 1 mrad before lying flat on the side toward -x, pushed by a centimetre: it strikes.
    let pose = on_floor(UnitQuaternion::from_axis_angle(
        &Vector3::z_axis(),
        std::f64::consts::FRAC_PI_2 - 1e-3,
    ));
    let after = settled(&pose, [0.0, -0.01, 0.0]);
    assert_eq!(
        after.outcome,
        Outcome::Toppling {
            case: 2,
            struck: true
        }
    );
    let turned = pose.rotation.angle_to(&after.pose.rotation);
    assert!((turned - 1e-3).abs() < 1e-9, "{turned}");
    assert!((after.pose.translation.vector.y - HALF).abs() < 1e-9);
}

#[test]
fn without_a_way_into_the_floor_g_is_projected_along_gravity() {
    let flat = on_floor(UnitQuaternion::identity());
    assert_eq!(settled(&flat, [1e-3, 0.0, 0.0]).outcome, Outcome::Stable);
    assert_eq!(settled(&flat, [1e-3, 1e-3, 0.0]).outcome, Outcome::Stable);
}
