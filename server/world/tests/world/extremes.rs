//! Inputs at the ends of what is allowed, and beyond them.

use nalgebra::{UnitQuaternion, Vector3};
use tsukamu_world::environment::floor::lowest;
use tsukamu_world::frame::Tracking;
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::sample::HandSample;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::{Command, StepInput};
use tsukamu_world::polyhedron::shapes;
use tsukamu_world::scene::Scene;
use tsukamu_world::{World, scene::SceneFault};

use crate::laws::wandering;
use crate::script::{HAND, cube, hand_with, idle, kinds, object, posed, run, sample, scene};

/// Everything at once: all twenty joints of a hand that jumps about.
fn whole_hand(seed: u64, step: u32, reach: f64) -> HandSample {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (u64::from(step / 3) << 17);
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    for _ in 0..8 {
        next();
    }
    let centre = Vector3::new(next(), next(), next()) * reach;
    let joints: Vec<(usize, [f64; 3])> = (0..20)
        .map(|joint| {
            let offset = Vector3::new(next(), next(), next()) * 0.15;
            // Some links have no length.
            let offset = if joint % 7 == 3 {
                Vector3::zeros()
            } else {
                offset
            };
            (joint, (centre + offset).into())
        })
        .collect();
    let mut hand = hand_with(centre.into(), &joints);
    hand.wrist.rotation =
        UnitQuaternion::from_euler_angles(next() * 6.0, next() * 6.0, next() * 6.0);
    hand
}

fn some_objects(floor: f64) -> Vec<tsukamu_world::scene::ObjectSpec> {
    let turned = UnitQuaternion::from_euler_angles(0.7, 0.2, 0.4);
    vec![
        object("cube", cube(0.05), [0.0, floor + 0.025, 0.0]),
        object("on it", cube(0.05), [0.01, floor + 0.075, 0.0]),
        posed(
            "ell",
            shapes::l_shape(0.06, 0.09, 0.04, 0.02).unwrap(),
            [0.1, floor + 0.3, 0.0],
            turned,
        ),
        posed(
            "ball",
            shapes::ellipsoid(&Vector3::new(0.03, 0.04, 0.05)).unwrap(),
            [-0.1, floor + 0.2, 0.0],
            turned,
        ),
    ]
}

fn model(points: f64, sides: u32, palm: bool) -> Command {
    let mut model = HandModel::adult(Side::Left);
    model.point_radius = points;
    model.prism_sides = sides;
    model.palm_contacts = palm;
    Command::AddHand {
        hand: HAND,
        model: Box::new(model),
    }
}

#[test]
fn wild_hands_at_all_rates_leave_a_world_that_is_sound() {
    for (seed, rate) in (0_u64..).zip([1.0, 12.0, 60.0, 240.0, 4000.0]) {
        for floor in [0.0, -1.0e4, 9.9e3] {
            let start = Scene {
                floor_height: floor,
                ..scene(rate, some_objects(floor))
            };
            let window = Scene {
                throw_window_s: 0.5,
                ..start.clone()
            };
            check_wild_hand(start.clone(), model(0.0, 4, false), seed, 0.3);
            check_wild_hand(window.clone(), model(0.008, 8, true), seed, 0.3);
            check_wild_hand(window, model(0.05, 3, true), seed, 5.0e3);
        }
    }
}

fn check_wild_hand(start: Scene, hand: Command, seed: u64, reach: f64) {
    let (floor, rate) = (start.floor_height, start.rate_hz);
    let mut world = World::new(start).unwrap();
    world.step(&StepInput {
        commands: vec![hand],
        hands: vec![],
    });
    for step in 0..90 {
        let up = Vector3::new(0.0, floor, 0.0);
        world.step(&sample(lifted(whole_hand(seed, step, reach), up)));
        for (_, body) in world.objects() {
            let above = lowest(&body.spec.shape, &body.pose) - floor;
            let slack = 1e-9 + 1e-11 * body.position().coords.norm();
            assert!(above > -slack, "{rate} Hz, step {step}: {above}");
            assert!(body.displacement.iter().all(|x| x.is_finite()));
        }
        let shown = world.frame().hands[0].shown.iter().flatten();
        assert!(shown.flat_map(|p| p.iter()).all(|x| x.is_finite()));
    }
}

fn lifted(mut hand: HandSample, up: Vector3<f64>) -> HandSample {
    hand.wrist.translation.vector += up;
    if let tsukamu_world::hand::sample::FingerPose::Points(points) = &mut hand.fingers {
        for point in points.iter_mut().flatten() {
            *point += up;
        }
    }
    hand
}

#[test]
fn everything_rests_at_the_slowest_and_the_fastest_rate() {
    for (rate, seconds) in [(1.0, 600), (4000.0, 8)] {
        let mut world = World::new(scene(rate, some_objects(0.0))).unwrap();
        idle(&mut world, rate as u32 * seconds);
        for (_, body) in world.objects() {
            assert!(body.is_resting(), "{} at {rate} Hz", body.spec.name);
        }
    }
}

#[test]
fn a_sample_from_beyond_the_world_is_none() {
    for far in [1.0e5, 1.0e160, 1.0e308] {
        let mut world = World::new(scene(240.0, some_objects(0.0))).unwrap();
        run(&mut world, (0..60).map(|step| wandering(5, step)));
        let there = world.hands()[0].posed.wrist;
        let mut gone = wandering(5, 60);
        gone.wrist.translation.vector.x = far;
        world.step(&sample(gone));
        assert_eq!(world.hands()[0].tracking, Tracking::Held, "{far}");
        assert_eq!(world.hands()[0].posed.wrist, there);
        world.step(&sample(hand_with(
            [0.0, 0.2, 0.2],
            &[(7, [0.0, -far, 0.0])],
        )));
        assert_eq!(world.hands()[0].tracking, Tracking::Held, "{far}");
        idle(&mut world, 100);
    }
}

#[test]
fn gravity_beyond_reason_is_refused_and_none_leaves_things_where_they_are() {
    for bad in [1.0e4, 1.0e300] {
        let start = Scene {
            gravity: Vector3::new(0.0, -bad, 0.0),
            ..Scene::default()
        };
        assert!(
            matches!(start.validate()[..], [SceneFault::Gravity(_)]),
            "{bad}"
        );
    }
    let start = Scene {
        gravity: Vector3::zeros(),
        ..scene(240.0, some_objects(0.0))
    };
    let mut world = World::new(start).unwrap();
    let before: Vec<_> = world.objects().map(|(_, body)| body.pose).collect();
    idle(&mut world, 240);
    let after: Vec<_> = world.objects().map(|(_, body)| body.pose).collect();
    assert_eq!(before, after);
}

#[test]
fn a_world_without_objects_goes_on() {
    let mut world = World::new(scene(240.0, vec![])).unwrap();
    run(&mut world, (0..30).map(|step| wandering(1, step)));
    let spec = object("late", cube(0.05), [0.0, 0.5, 0.0]);
    world.step(&StepInput {
        commands: vec![Command::AddObject(Box::new(spec)), Command::Reset],
        hands: vec![],
    });
    let late = world.objects().next().unwrap().0;
    world.step(&StepInput {
        commands: vec![
            Command::RemoveObject(late),
            Command::RemoveObject(late),
            Command::Reset,
        ],
        hands: vec![],
    });
    idle(&mut world, 10);
    assert_eq!(world.objects().count(), 0);
}

#[test]
fn what_comes_down_exactly_on_the_floor_has_landed() {
    // 1 m/s² at 1 Hz: 1 m, then 2 m, then 3 m down.
    let start = Scene {
        gravity: Vector3::new(0.0, -1.0, 0.0),
        ..scene(1.0, vec![object("a", cube(0.5), [0.0, 6.25, 0.0])])
    };
    let mut world = World::new(start).unwrap();
    let events = idle(&mut world, 10);
    assert_eq!(kinds(&events), ["landed", "rested"]);
}

#[test]
fn times_that_are_whole_steps_are_as_many_steps_at_any_rate() {
    for rate in [1.0, 60.0, 100.0, 240.0, 1000.0, 4000.0] {
        for steps in (0..=(0.5 * rate) as u32).step_by(1 + rate as usize / 100) {
            let time_s = f64::from(steps) / rate;
            let start = Scene {
                throw_window_s: time_s,
                tracking_grace_s: (time_s * 1e6).round() / 1e6,
                ..scene(rate, vec![])
            };
            assert_eq!(
                start.track_length(),
                steps as usize + 1,
                "{time_s} s at {rate} Hz"
            );
            if rate != 60.0 && rate != 240.0 {
                assert_eq!(
                    start.grace_steps(),
                    u64::from(steps),
                    "{time_s} s at {rate} Hz"
                );
            }
        }
    }
    let decimal = Scene {
        throw_window_s: 0.07,
        tracking_grace_s: 0.29,
        ..scene(100.0, vec![])
    };
    assert_eq!((decimal.track_length(), decimal.grace_steps()), (8, 29));
}
