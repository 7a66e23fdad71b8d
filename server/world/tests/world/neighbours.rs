//! Objects that run into each other (model §8).

use nalgebra::Vector3;
use tsukamu_world::World;
use tsukamu_world::hand::sample::HandSample;
use tsukamu_world::state::ContactState;

use crate::script::{cube, hand_with, kinds, object, position, run, sample, scene};

const THUMB_TIP: usize = 3;
const INDEX_TIP: usize = 7;

/// Two tips on both sides of z around a centre, so that x is free for neighbours.
fn pinch(centre: Vector3<f64>, gap: f64) -> HandSample {
    let half = Vector3::new(0.0, 0.0, gap / 2.0);
    let wrist = centre + Vector3::new(0.0, 0.1, 0.1);
    hand_with(
        wrist.into(),
        &[
            (THUMB_TIP, (centre + half).into()),
            (INDEX_TIP, (centre - half).into()),
        ],
    )
}

fn grip(centre: Vector3<f64>) -> impl Iterator<Item = HandSample> {
    (0..30).map(move |i| pinch(centre, 0.07 - 0.001 * f64::from(i)))
}

fn steps(from: Vector3<f64>, to: Vector3<f64>, n: u32) -> impl Iterator<Item = HandSample> {
    (1..=n).map(move |i| pinch(from.lerp(&to, f64::from(i) / f64::from(n)), 0.041))
}

#[test]
fn a_pushed_cube_takes_a_row_of_neighbours_along() {
    let row = (0..3).map(|i| {
        let x = 0.06 * f64::from(i);
        object(&format!("{i}"), cube(0.05), [x, 0.025, 0.0])
    });
    let mut world = World::new(scene(240.0, row.collect())).unwrap();
    let script = (0..=80).map(|i| {
        let x = -0.045 + 0.001 * f64::from(i);
        hand_with([x - 0.1, 0.1, 0.1], &[(INDEX_TIP, [x, 0.025, 0.0])])
    });
    run(&mut world, script);
    // The tip ends at x = 35 mm: the first cube at 60 mm. Each neighbour moves with whole steps of 1 mm, so it is
    // at most a step farther than touching.
    assert!((position(&world, 0).x - 0.06).abs() < 1e-9);
    for slot in 1..3 {
        let gap = position(&world, slot).x - position(&world, slot - 1).x - 0.05;
        assert!((-1e-7..=1.001e-3).contains(&gap), "{slot}: {gap}");
        assert!(position(&world, slot).z.abs() < 1e-12);
    }
}

#[test]
fn pressing_a_held_block_on_a_cube_leaves_both_overlapping_as_in_fig_11() {
    let two = vec![
        object("under", cube(0.05), [0.0, 0.025, 0.0]),
        object("held", cube(0.05), [0.2, 0.025, 0.0]),
    ];
    let mut world = World::new(scene(240.0, two)).unwrap();
    let [start, above, over, pressed] = [
        [0.2, 0.025, 0.0],
        [0.2, 0.13, 0.0],
        [0.0, 0.13, 0.0],
        [0.0, 0.065, 0.0],
    ]
    .map(Vector3::from);
    let script = grip(start)
        .chain(steps(start, above, 50))
        .chain(steps(above, over, 50))
        .chain(steps(over, pressed, 50));
    run(&mut world, script);
    assert_eq!(
        world.objects().nth(1).unwrap().1.contact,
        ContactState::Grasped
    );
    // Pressed 10 mm into the cube: the cube cannot go below the floor, the block stays in the hand.
    assert!(
        (position(&world, 0) - Vector3::new(0.0, 0.025, 0.0))
            .coords
            .norm()
            < 1e-9
    );
    assert!((position(&world, 1).y - 0.065).abs() < 1e-9);
    // Lifting it off leaves the cube where it is.
    for one in steps(pressed, over, 50) {
        world.step(&sample(one));
    }
    assert!(
        (position(&world, 0) - Vector3::new(0.0, 0.025, 0.0))
            .coords
            .norm()
            < 1e-9
    );
}

#[test]
fn an_object_let_go_on_another_stays_there() {
    let two = vec![
        object("under", cube(0.05), [0.0, 0.025, 0.0]),
        object("held", cube(0.05), [0.2, 0.025, 0.0]),
    ];
    let mut world = World::new(scene(240.0, two)).unwrap();
    let [start, above, over, down] = [
        [0.2, 0.025, 0.0],
        [0.2, 0.13, 0.0],
        [0.0, 0.13, 0.0],
        [0.0, 0.077, 0.0],
    ]
    .map(Vector3::from);
    let script = grip(start)
        .chain(steps(start, above, 50))
        .chain(steps(above, over, 50))
        .chain(steps(over, down, 50))
        .chain((0..30).map(move |i| pinch(down, 0.041 + 0.001 * f64::from(i))))
        .chain((0..100).map(move |_| pinch(down, 0.07)));
    let events = run(&mut world, script);
    assert_eq!(
        kinds(&events)
            .iter()
            .filter(|kind| **kind == "blocked")
            .count(),
        1
    );
    assert!(
        (position(&world, 1).y - 0.075).abs() < 1e-5,
        "{}",
        position(&world, 1)
    );
    assert!(world.objects().all(|(_, body)| body.is_resting()));
}

#[test]
fn what_another_hand_holds_still_is_not_pushed_out_of_it() {
    use tsukamu_world::hand::joint::Side;
    use tsukamu_world::hand::skeleton::HandModel;
    use tsukamu_world::input::{Command, HandInput, StepInput};
    use tsukamu_world::state::HandId;

    let two = vec![
        object("still", cube(0.05), [0.0, 0.025, 0.0]),
        object("moving", cube(0.05), [0.2, 0.025, 0.0]),
    ];
    let mut world = World::new(scene(240.0, two)).unwrap();
    let add = |hand| Command::AddHand {
        hand,
        model: Box::new(HandModel::adult(Side::Right)),
    };
    world.step(&StepInput {
        commands: vec![add(HandId(1)), add(HandId(2))],
        hands: vec![],
    });
    let mut step = |still: HandSample, moving: HandSample| {
        let hands = [(HandId(1), still), (HandId(2), moving)];
        let hands = hands.map(|(hand, sample)| HandInput {
            hand,
            sample: Some(sample),
        });
        world.step(&StepInput {
            commands: vec![],
            hands: hands.to_vec(),
        });
        let poses: Vec<_> = world.objects().map(|(_, body)| body.position()).collect();
        poses
    };
    let [here, there] = [[0.0, 0.025, 0.0], [0.2, 0.025, 0.0]].map(Vector3::from);
    for (still, moving) in grip(here).zip(grip(there)) {
        step(still, moving);
    }
    for moving in steps(there, Vector3::new(0.03, 0.025, 0.0), 170) {
        let places = step(pinch(here, 0.041), moving);
        assert!((places[0].coords - here).norm() < 1e-9, "{}", places[0]);
    }
}
