//! The golden digest: the same bits in debug and release, on any x86-64 machine.

use nalgebra::{UnitQuaternion, Vector3};
use tsukamu_world::World;
use tsukamu_world::polyhedron::shapes;

use crate::script::{cube, hand_with, idle, object, posed, run, scene};

/// The state after two seconds of everything: a grasp and a throw, a stack, toppling solids, a concave one.
/// It changes only when the model does; then say so in the changelog, for old recordings will not verify.
const GOLDEN: u64 = 0x35ce_5b66_043d_1793;

#[test]
fn the_golden_digest() {
    let turned = |a, b, c| UnitQuaternion::from_euler_angles(a, b, c);
    let objects = vec![
        object("thrown", cube(0.05), [0.0, 0.025, 0.0]),
        object("under", cube(0.05), [0.3, 0.025, 0.0]),
        object("over", cube(0.05), [0.31, 0.2, 0.01]),
        posed(
            "ell",
            shapes::l_shape(0.06, 0.09, 0.04, 0.02).unwrap(),
            [-0.3, 0.3, 0.0],
            turned(0.5, 0.2, 0.9),
        ),
        posed(
            "ball",
            shapes::ellipsoid(&Vector3::new(0.03, 0.04, 0.05)).unwrap(),
            [0.0, 0.3, 0.5],
            turned(1.0, 0.1, 0.2),
        ),
    ];
    let mut world = World::new(scene(240.0, objects)).unwrap();
    let close = (0..40).map(|i| (0.0, 0.07 - 0.001 * f64::from(i.min(25))));
    let swing = (0..60).map(|i| (0.0005 * f64::from(i * i) / 2.0 / 10.0, 0.045));
    let open = (0..20).map(|i| (0.0885 + 0.003 * f64::from(i), 0.045 + 0.004 * f64::from(i)));
    let script = close.chain(swing).chain(open).map(|(way, gap)| {
        let centre = Vector3::new(0.0, 0.025 + way, -way);
        let half = Vector3::new(gap / 2.0, 0.0, 0.0);
        // Last links too, tilted, so that judgement segments cut edges.
        let link = Vector3::new(0.004, 0.021, 0.017);
        let places = [
            (2, centre - half + link),
            (3, centre - half),
            (6, centre + half + link),
            (7, centre + half),
        ];
        let wrist = centre + Vector3::new(0.0, 0.05, 0.15);
        let mut sample = hand_with(
            wrist.into(),
            &places.map(|(joint, place)| (joint, place.into())),
        );
        sample.wrist.rotation = turned(0.2 + way, -0.1, 0.3);
        sample
    });
    run(&mut world, script);
    idle(&mut world, 360);
    assert_eq!(
        world.digest(),
        GOLDEN,
        "the digest is {:#018x}",
        world.digest()
    );
}
