//! How a touch or a grasp ends: commands, hands that go, the throw window.

use nalgebra::Vector3;
use tsukamu_world::World;
use tsukamu_world::frame::{EventKind, ReleaseReason};
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::sample::HandSample;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::{Command, StepInput};
use tsukamu_world::scene::Scene;
use tsukamu_world::state::{ContactState, HandId, ObjectId};

use crate::script::{HAND, cube, hand_with, idle, kinds, object, run, sample, scene};

const THUMB_TIP: usize = 3;
const INDEX_TIP: usize = 7;
const OBJECT: ObjectId = ObjectId {
    slot: 0,
    generation: 0,
};

/// A thumb tip and an index tip at these x, at a height.
fn tips(thumb: f64, index: f64, y: f64) -> HandSample {
    hand_with(
        [0.5 * (thumb + index), y + 0.05, 0.15],
        &[(THUMB_TIP, [thumb, y, 0.0]), (INDEX_TIP, [index, y, 0.0])],
    )
}

fn one_cube() -> Scene {
    scene(240.0, vec![object("a", cube(0.05), [0.0, 0.025, 0.0])])
}

/// A cube in the hand, its tips 4 mm deep on both sides, where it stood.
fn held(scene: Scene) -> World {
    let mut world = World::new(scene).unwrap();
    let close = (0..15).map(|i| {
        let half = 0.035 - 0.001 * f64::from(i);
        tips(-half, half, 0.025)
    });
    run(&mut world, close);
    assert_eq!(contact(&world), ContactState::Grasped);
    world
}

fn contact(world: &World) -> ContactState {
    world.object(OBJECT).unwrap().contact
}

fn command(command: Command, hand: HandSample) -> StepInput {
    StepInput {
        commands: vec![command],
        ..sample(hand)
    }
}

fn reasons(world: &World) -> Vec<ReleaseReason> {
    let events = world.frame().events.iter();
    events
        .filter_map(|event| match event.kind {
            EventKind::Released { reason } => Some(reason),
            _ => None,
        })
        .collect()
}

#[test]
fn after_a_release_by_command_a_grasp_needs_the_test_to_fail_once_and_no_more() {
    let mut world = held(one_cube());
    world.step(&command(
        Command::Release(OBJECT),
        tips(-0.021, 0.021, 0.025),
    ));
    assert_eq!(reasons(&world), [ReleaseReason::Command]);
    for _ in 0..10 {
        world.step(&sample(tips(-0.021, 0.021, 0.025)));
        assert_eq!(
            contact(&world),
            ContactState::Free,
            "the fingers are still closed"
        );
    }
    // The index finger leaves, the thumb goes on pushing: the test has failed. Then the finger comes back.
    for i in 0..10 {
        world.step(&sample(tips(-0.021 + 1e-4 * f64::from(i), 0.03, 0.025)));
    }
    assert_eq!(contact(&world), ContactState::PushedAtOne);
    for i in 0..10 {
        world.step(&sample(tips(-0.02, 0.03 - 0.001 * f64::from(i), 0.025)));
    }
    assert_eq!(contact(&world), ContactState::Grasped);
}

#[test]
fn a_release_by_command_is_shown_and_throws_like_any_other() {
    let mut world = held(one_cube());
    // At rest on the floor in the hand: nothing moves, but its state changes.
    world.step(&command(
        Command::Release(OBJECT),
        tips(-0.021, 0.021, 0.025),
    ));
    assert!(world.frame().changed.contains(&OBJECT), "the state changed");

    let window = Scene {
        throw_window_s: 0.05,
        ..one_cube()
    };
    for scene in [one_cube(), window] {
        let mut world = held(scene);
        for i in 0..30 {
            world.step(&sample(tips(-0.021, 0.021, 0.025 + 0.005 * f64::from(i))));
        }
        world.step(&command(
            Command::Release(OBJECT),
            tips(-0.021, 0.021, 0.175),
        ));
        let thrown = world
            .frame()
            .events
            .iter()
            .find_map(|event| match event.kind {
                EventKind::Thrown { velocity } => Some(velocity),
                _ => None,
            });
        let velocity = thrown.expect("thrown");
        assert!(
            (velocity - Vector3::new(0.0, 1.2, 0.0)).norm() < 1e-9,
            "{velocity}"
        );
        assert!(world.object(OBJECT).unwrap().track.is_empty());
    }
}

#[test]
fn the_throw_window_reaches_back_to_the_beginning_of_the_touch_and_no_farther() {
    let mut world = World::new(Scene {
        throw_window_s: 0.1,
        ..one_cube()
    })
    .unwrap();
    // A push to x = 20 mm, and the finger goes away.
    let push = (0..=40).map(|i| {
        let x = -0.045 + 0.001 * f64::from(i);
        hand_with([x - 0.1, 0.1, 0.1], &[(INDEX_TIP, [x, 0.025, 0.0])])
    });
    let away = (0..40).map(|i| {
        let x = -0.005 - 0.002 * f64::from(i);
        hand_with([x - 0.1, 0.1, 0.1], &[(INDEX_TIP, [x, 0.025, 0.0])])
    });
    run(&mut world, push.chain(away));
    assert_eq!(contact(&world), ContactState::Free);
    assert!(
        world.object(OBJECT).unwrap().track.is_empty(),
        "old positions"
    );
}

#[test]
fn a_hand_that_goes_ends_its_contacts_also_with_what_rests() {
    // Told to let go, the fingers stay closed around a cube that lies on the floor; then the hand is gone.
    let ends: [fn() -> Command; 2] = [
        || Command::RemoveHand(HAND),
        || Command::AddHand {
            hand: HAND,
            model: Box::new(HandModel::adult(Side::Left)),
        },
    ];
    for end in ends {
        let mut world = held(one_cube());
        let closed = || tips(-0.021, 0.021, 0.025);
        world.step(&command(Command::Release(OBJECT), closed()));
        for _ in 0..5 {
            world.step(&sample(closed()));
        }
        let mut touches = Vec::new();
        world.contacts_of(HAND, &mut touches);
        assert_eq!(touches.len(), 2, "still inside");
        world.step(&StepInput {
            commands: vec![end()],
            hands: vec![],
        });
        let ended = kinds_of(&world, "contact_ended");
        assert_eq!(ended, 2);
        assert!(world.object(OBJECT).unwrap().touches.is_empty());
        assert!(!world.object(OBJECT).unwrap().barred);
        idle(&mut world, 2);
        assert!(world.object(OBJECT).unwrap().is_resting());
    }
    // The same when it is lost.
    let mut world = held(one_cube());
    world.step(&command(
        Command::Release(OBJECT),
        tips(-0.021, 0.021, 0.025),
    ));
    world.step(&sample(tips(-0.021, 0.021, 0.025)));
    let events = idle(&mut world, 62);
    let n_ended = kinds(&events)
        .iter()
        .filter(|kind| **kind == "contact_ended")
        .count();
    assert_eq!(n_ended, 2, "{events:?}");
}

fn kinds_of(world: &World, name: &str) -> usize {
    let events = world.frame().events.iter();
    events.filter(|event| event.kind.name() == name).count()
}

#[test]
fn a_hand_that_is_replaced_or_removed_lets_go_for_want_of_tracking() {
    for end in [
        Command::RemoveHand(HAND),
        Command::AddHand {
            hand: HAND,
            model: Box::new(HandModel::adult(Side::Right)),
        },
    ] {
        let mut world = held(one_cube());
        for i in 0..30 {
            world.step(&sample(tips(-0.021, 0.021, 0.025 + 0.001 * f64::from(i))));
        }
        let before = world.object(OBJECT).unwrap().position();
        world.step(&StepInput {
            commands: vec![end],
            hands: vec![],
        });
        assert_eq!(reasons(&world), [ReleaseReason::TrackingLost]);
        let after = world.object(OBJECT).unwrap().position();
        assert!(
            (after - before).norm() < 0.002,
            "it flies on from where it was: {after}"
        );
    }
}

#[test]
fn what_is_held_is_released_before_it_is_removed_or_set_back() {
    for end in [Command::RemoveObject(OBJECT), Command::Reset] {
        let mut world = held(one_cube());
        world.step(&command(end, tips(-0.3, 0.3, 0.3)));
        assert_eq!(reasons(&world), [ReleaseReason::Command]);
        assert_eq!(world.frame().events[0].hand, Some(HAND));
        assert_eq!(world.frame().hands[0].holds, None);
        idle(&mut world, 100);
    }
}

#[test]
fn a_push_says_who_pushes_and_with_how_many_contacts() {
    let other = HandId(3);
    let mut world = World::new(one_cube()).unwrap();
    // Hand 3 is found with a fingertip inside and leaves; hand 7 comes from the other side.
    let add = |hand| Command::AddHand {
        hand,
        model: Box::new(HandModel::adult(Side::Right)),
    };
    world.step(&StepInput {
        commands: vec![add(other), add(HAND)],
        hands: vec![],
    });
    let finger = |x: f64, y: f64| hand_with([x, y + 0.1, 0.1], &[(INDEX_TIP, [x, y, 0.0])]);
    let step = |world: &mut World, top: f64, side: f64| {
        let hands = [(other, finger(0.0, top)), (HAND, finger(side, 0.025))];
        let hands = hands.map(|(hand, sample)| tsukamu_world::input::HandInput {
            hand,
            sample: Some(sample),
        });
        world.step(&StepInput {
            commands: vec![],
            hands: hands.to_vec(),
        });
    };
    let wide = tsukamu_world::scene::ObjectSpec {
        grasp_angle: Some(3.0),
        ..world.scene().objects[0].clone()
    };
    world.step(&StepInput {
        commands: vec![
            Command::RemoveObject(OBJECT),
            Command::AddObject(Box::new(wide)),
        ],
        hands: vec![],
    });
    step(&mut world, 0.045, -0.03);
    step(&mut world, 0.046, -0.03);
    // The first leaves upward, still inside; the second pushes.
    step(&mut world, 0.047, -0.02);
    let pushed: Vec<_> = world
        .frame()
        .events
        .iter()
        .filter_map(|event| match event.kind {
            EventKind::Pushed { n_contacts } => Some((event.hand, n_contacts)),
            _ => None,
        })
        .collect();
    assert_eq!(pushed, [(Some(HAND), 1)]);
}

#[test]
fn contacts_lie_on_the_surface_also_of_what_is_pushed() {
    let mut world = World::new(one_cube()).unwrap();
    let push = (0..30).map(|i| {
        let x = -0.045 + 0.001 * f64::from(i);
        hand_with([x - 0.1, 0.1, 0.1], &[(INDEX_TIP, [x, 0.025, 0.0])])
    });
    run(&mut world, push);
    let mut touches = Vec::new();
    world.contacts_of(HAND, &mut touches);
    assert_eq!(touches.len(), 1);
    let at = touches[0].point.coords - Vector3::new(-0.016, 0.025, 0.0);
    assert!(at.norm() < 1e-9, "{}", touches[0].point);
    // A finger 4 mm inside what it holds touches its surface all the same.
    let world = held(one_cube());
    touches.clear();
    world.contacts_of(HAND, &mut touches);
    let left = world.object(OBJECT).unwrap().position().x - 0.025;
    assert!(
        (touches[0].point.x - left).abs() < 1e-9,
        "{}",
        touches[0].point
    );
}
