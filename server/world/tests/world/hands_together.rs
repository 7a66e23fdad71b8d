//! Several hands on one object (model §4 and §5.2).

use nalgebra::Vector3;
use tsukamu_world::World;
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::sample::HandSample;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::{Command, HandInput, StepInput};
use tsukamu_world::polyhedron::shapes;
use tsukamu_world::state::{ContactState, HandId};

use crate::script::{hand_with, object, position, scene};

const LEFT: HandId = HandId(1);
const RIGHT: HandId = HandId(2);

/// One fingertip of a hand that comes from that side.
fn tip(x: f64, y: f64) -> HandSample {
    hand_with([x * 1.5, y + 0.1, 0.1], &[(7, [x, y, 0.0])])
}

fn both(left: HandSample, right: HandSample) -> StepInput {
    let hands = [(RIGHT, right), (LEFT, left)].map(|(hand, sample)| HandInput {
        hand,
        sample: Some(sample),
    });
    StepInput {
        commands: vec![],
        hands: hands.to_vec(),
    }
}

#[test]
fn one_finger_of_each_hand_hold_a_big_box_together() {
    let shape = shapes::cuboid(&Vector3::new(0.4, 0.2, 0.2)).unwrap();
    let mut world = World::new(scene(240.0, vec![object("box", shape, [0.0, 0.1, 0.0])])).unwrap();
    let add = |hand, side| Command::AddHand {
        hand,
        model: Box::new(HandModel::adult(side)),
    };
    world.step(&StepInput {
        commands: vec![add(RIGHT, Side::Right), add(LEFT, Side::Left)],
        hands: vec![],
    });
    for i in 0..30 {
        let x = 0.215 - 0.001 * f64::from(i.min(20));
        world.step(&both(tip(-x, 0.1), tip(x, 0.1)));
    }
    let held = || ContactState::Grasped;
    assert_eq!(world.objects().next().unwrap().1.contact, held());
    let start = position(&world, 0);
    let leader = world
        .objects()
        .next()
        .unwrap()
        .1
        .hold
        .map(|hold| hold.leader);
    assert_eq!(leader, Some(None), "no hand holds it alone");
    for i in 1..=100 {
        let y = 0.1 + 0.001 * f64::from(i);
        world.step(&both(tip(-0.195, y), tip(0.195, y)));
    }
    assert_eq!(world.objects().next().unwrap().1.contact, held());
    assert!(
        (position(&world, 0) - start - Vector3::new(0.0, 0.1, 0.0)).norm() < 1e-9,
        "{}",
        position(&world, 0)
    );
}

#[test]
fn the_order_in_which_hands_are_given_changes_nothing() {
    let shape = shapes::cuboid(&Vector3::new(0.4, 0.2, 0.2)).unwrap();
    let digests = [false, true].map(|swap| {
        let mut world = World::new(scene(
            240.0,
            vec![object("box", shape.clone(), [0.0, 0.1, 0.0])],
        ))
        .unwrap();
        let mut commands: Vec<Command> = [(RIGHT, Side::Right), (LEFT, Side::Left)]
            .map(|(hand, side)| Command::AddHand {
                hand,
                model: Box::new(HandModel::adult(side)),
            })
            .into();
        if swap {
            commands.reverse();
        }
        world.step(&StepInput {
            commands,
            hands: vec![],
        });
        for i in 0..60 {
            let x = 0.215 - 0.001 * f64::from(i.min(20));
            let mut input = both(tip(-x, 0.1), tip(x + 0.001, 0.1 + 0.0005 * f64::from(i)));
            if swap {
                input.hands.reverse();
            }
            world.step(&input);
        }
        world.digest()
    });
    assert_eq!(digests[0], digests[1]);
}
