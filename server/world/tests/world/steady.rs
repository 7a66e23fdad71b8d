//! A steady step allocates nothing.

use nalgebra::Vector3;
use tsukamu_world::StepInput;
use tsukamu_world::World;
use tsukamu_world::hand::sample::HandSample;
use tsukamu_world::state::ContactState;

use crate::script::{cube, hand_with, object, run, sample, scene};

fn pinch(centre: Vector3<f64>, gap: f64) -> HandSample {
    let half = Vector3::new(gap / 2.0, 0.0, 0.0);
    let wrist = centre + Vector3::new(0.0, 0.05, 0.15);
    let at = |v: Vector3<f64>| -> [f64; 3] { v.into() };
    let link = Vector3::new(0.0, 0.02, 0.03);
    // Whole last links, so that judgement segments are there too.
    hand_with(
        wrist.into(),
        &[
            (2, at(centre - half + link)),
            (3, at(centre - half)),
            (6, at(centre + half + link)),
            (7, at(centre + half)),
        ],
    )
}

#[test]
fn carrying_falling_and_resting_allocate_nothing() {
    let mut objects = vec![object("held", cube(0.05), [0.0, 0.025, 0.0])];
    for i in 0..20 {
        objects.push(object(
            &format!("resting {i}"),
            cube(0.05),
            [0.2 + 0.06 * f64::from(i), 0.025, 0.0],
        ));
    }
    objects.push(object("falling", cube(0.05), [-1.0, 900.0, 0.0]));
    let mut world = World::new(scene(240.0, objects)).unwrap();
    let at = |i: u32| Vector3::new(0.0, 0.025 + 0.0005 * f64::from(i), 0.0);
    let close = (0..40).map(|i| pinch(at(0), 0.07 - 0.001 * f64::from(i.min(25))));
    run(
        &mut world,
        close.chain((0..200).map(|i| pinch(at(i), 0.045))),
    );
    assert_eq!(
        world.objects().next().unwrap().1.contact,
        ContactState::Grasped
    );
    let inputs: Vec<_> = (200..1200).map(|i| sample(pinch(at(i), 0.045))).collect();
    let count = allocation_counter::measure(|| {
        for input in &inputs {
            world.step(input);
        }
    });
    assert_eq!(
        world.objects().next().unwrap().1.contact,
        ContactState::Grasped
    );
    assert_eq!(count.count_total, 0, "{count:?}");
    // A source slower than the steps: every other one has no sample.
    let count = allocation_counter::measure(|| {
        for input in inputs.iter().rev().take(20) {
            world.step(input);
            world.step(&StepInput::default());
        }
    });
    assert_eq!(count.count_total, 0, "{count:?}");
}

#[test]
fn an_object_that_nothing_touches_takes_no_memory_for_touches() {
    let start = tsukamu_world::scene::Scene {
        throw_window_s: 0.5,
        ..scene(4000.0, vec![object("a", cube(0.05), [0.0, 0.025, 0.0])])
    };
    let world = World::new(start).unwrap();
    let (_, body) = world.objects().next().unwrap();
    assert_eq!((body.touches.capacity(), body.track.capacity()), (0, 0));
}
