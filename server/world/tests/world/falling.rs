//! Free objects: flight, floor, neighbours, rest.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::{Strategy, prop, prop_assert, prop_assert_eq, proptest};
use tsukamu_world::World;
use tsukamu_world::frame::EventKind;
use tsukamu_world::polyhedron::{Polyhedron, shapes};

use crate::script::{cube, idle, kinds, object, posed, position, scene};

#[test]
fn a_cube_on_the_floor_rests_at_once_and_stays() {
    let mut world = World::new(scene(
        240.0,
        vec![object("a", cube(0.05), [0.0, 0.025, 0.0])],
    ))
    .unwrap();
    assert_eq!(kinds(&idle(&mut world, 1)), ["rested"]);
    let digest_free = world
        .object(tsukamu_world::state::ObjectId {
            slot: 0,
            generation: 0,
        })
        .unwrap()
        .pose;
    assert!(idle(&mut world, 1000).is_empty());
    assert_eq!(world.objects().next().unwrap().1.pose, digest_free);
}

#[test]
fn a_dropped_cube_lands_and_rests_flat() {
    let mut world =
        World::new(scene(240.0, vec![object("a", cube(0.05), [0.0, 0.5, 0.0])])).unwrap();
    let events = idle(&mut world, 240);
    assert_eq!(kinds(&events), ["landed", "rested"]);
    assert!((position(&world, 0).y - 0.025).abs() < 1e-9);
    let EventKind::Landed { velocity } = events[0].1.kind else {
        panic!("landed first")
    };
    // v = -sqrt(2 g h) with h = 0.475 m.
    assert!((velocity.y + 3.053).abs() < 0.1, "{velocity}");
}

#[test]
fn a_stack_of_three_stays_through_ten_seconds() {
    let stack = (0..3)
        .map(|i| {
            object(
                &format!("{i}"),
                cube(0.05),
                [0.0, 0.025 + 0.05 * f64::from(i), 0.0],
            )
        })
        .collect();
    let mut world = World::new(scene(240.0, stack)).unwrap();
    let events = idle(&mut world, 2400);
    assert_eq!(
        events
            .iter()
            .filter(|(_, e)| e.kind.name() == "rested")
            .count(),
        3
    );
    for slot in 0..3 {
        let expected = 0.025 + 0.05 * f64::from(slot);
        assert!((position(&world, slot).y - expected).abs() < 1e-6, "{slot}");
    }
}

#[test]
fn one_cube_dropped_on_another_stays_on_it() {
    let two = vec![
        object("a", cube(0.05), [0.0, 0.025, 0.0]),
        object("b", cube(0.05), [0.01, 0.3, 0.0]),
    ];
    for rate in [60.0, 240.0, 1000.0] {
        let mut world = World::new(scene(rate, two.clone())).unwrap();
        let events = idle(&mut world, rate as u32);
        assert!(kinds(&events).contains(&"blocked"), "{events:?}");
        let y = position(&world, 1).y;
        assert!((y - 0.075).abs() < 1e-5, "{rate} Hz: {y}");
    }
}

#[test]
fn what_leans_on_a_removed_object_falls() {
    use tsukamu_world::StepInput;
    use tsukamu_world::input::Command;
    use tsukamu_world::state::ObjectId;
    let two = vec![
        object("a", cube(0.05), [0.0, 0.025, 0.0]),
        object("b", cube(0.05), [0.0, 0.075, 0.0]),
    ];
    let mut world = World::new(scene(240.0, two)).unwrap();
    idle(&mut world, 10);
    let gone = ObjectId {
        slot: 0,
        generation: 0,
    };
    world.step(&StepInput {
        commands: vec![Command::RemoveObject(gone)],
        hands: vec![],
    });
    idle(&mut world, 240);
    assert!((position(&world, 1).y - 0.025).abs() < 1e-6);
    assert!(world.object(gone).is_none());
}

fn solids() -> Vec<Polyhedron> {
    vec![
        cube(0.05),
        shapes::cuboid(&Vector3::new(0.02, 0.06, 0.11)).unwrap(),
        shapes::pyramid(0.05, 0.05, 0.06).unwrap(),
        shapes::prism(6, 0.03, 0.05).unwrap(),
        shapes::l_shape(0.06, 0.09, 0.04, 0.02).unwrap(),
        shapes::ellipsoid(&Vector3::new(0.03, 0.04, 0.05)).unwrap(),
    ]
}

fn any_rotation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    prop::array::uniform3(-3.0..3.0f64)
        .prop_map(|v| UnitQuaternion::from_scaled_axis(Vector3::from(v)))
}

proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(96))]

    #[test]
    fn everything_comes_to_rest_and_nothing_ends_below_the_floor(
        solid in 0..6usize, rotation in any_rotation(), height in 0.1..0.6f64, rate in 0..4usize,
    ) {
        let rate = [60.0, 240.0, 1000.0, 2000.0][rate];
        let shape = solids().swap_remove(solid);
        let mut world = World::new(scene(rate, vec![posed("a", shape, [0.0, height, 0.0], rotation)])).unwrap();
        let mut rested = false;
        for _ in 0..(rate as u32 * 20) {
            idle(&mut world, 1);
            let (_, body) = world.objects().next().unwrap();
            let low = tsukamu_world::environment::floor::lowest(&body.spec.shape, &body.pose);
            prop_assert!(low > -1e-9, "{low} below the floor");
            if body.is_resting() {
                rested = true;
                break;
            }
        }
        prop_assert!(rested, "still moving after 20 s");
        let pose = world.objects().next().unwrap().1.pose;
        idle(&mut world, 100);
        prop_assert_eq!(world.objects().next().unwrap().1.pose, pose);
    }
}
