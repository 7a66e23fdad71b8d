//! The world as bytes: a world that goes on from them is the same to the last bit, and bad ones are refused.

use nalgebra::UnitQuaternion;
use proptest::prelude::{
    Just, ProptestConfig, Strategy, any, prop, prop_assert_eq, prop_oneof, proptest,
};
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::Command;
use tsukamu_world::scene::Scene;
use tsukamu_world::snapshot::SnapshotFault;
use tsukamu_world::state::{HandId, ObjectId};
use tsukamu_world::{StepInput, World};

use crate::laws::wandering;
use crate::script::{cube, object, posed, sample, scene, with_hand};

const SECOND_HAND: HandId = HandId(9);

/// Three cubes, a throw window of several steps, and a hand.
fn start() -> World {
    let turned = UnitQuaternion::from_euler_angles(0.4, 0.2, 0.1);
    let mut scene = scene(
        240.0,
        vec![
            object("a", cube(0.05), [0.0, 0.025, 0.0]),
            object("b", cube(0.05), [0.0, 0.075, 0.0]),
            posed("c", cube(0.05), [0.3, 0.3, 0.0], turned),
        ],
    );
    scene.throw_window_s = 0.03;
    let mut world = World::new(scene).unwrap();
    world.step(&with_hand());
    world
}

/// What a step's input is: the wandering hand, and now and then a command.
fn input(seed: u64, step: u32) -> StepInput {
    let mut input = sample(wandering(seed, step));
    let first = ObjectId {
        slot: 0,
        generation: 0,
    };
    input.commands = match step {
        20 => vec![Command::RemoveObject(ObjectId {
            slot: 2,
            generation: 0,
        })],
        30 => vec![Command::AddHand {
            hand: SECOND_HAND,
            model: Box::new(HandModel {
                palm_contacts: true,
                ..HandModel::adult(Side::Left)
            }),
        }],
        40 => vec![Command::AddObject(Box::new(object(
            "late",
            cube(0.04),
            [0.02, 0.4, 0.0],
        )))],
        60 => vec![Command::RemoveObject(ObjectId {
            slot: 1,
            generation: 0,
        })],
        90 => vec![Command::Release(first)],
        200 => vec![Command::Reset],
        _ => Vec::new(),
    };
    input
}

fn run(world: &mut World, seed: u64, steps: std::ops::Range<u32>) {
    for step in steps {
        world.step(&input(seed, step));
    }
}

/// The scene as it stands, and the ids of its objects.
fn scene_now(world: &World) -> (Scene, Vec<ObjectId>) {
    let (ids, objects) = world
        .objects()
        .map(|(id, body)| (id, (*body.spec).clone()))
        .unzip();
    (
        Scene {
            objects,
            ..world.scene().clone()
        },
        ids,
    )
}

fn restored(world: &World, bytes: &[u8]) -> Result<World, SnapshotFault> {
    let (scene, ids) = scene_now(world);
    World::restored(scene, &ids, bytes)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_world_goes_on_from_its_bytes(seed in 0..10_000_u64, cut in 0..230_u32) {
        let mut first = start();
        run(&mut first, seed, 0..cut);
        let bytes = first.state_bytes();
        let mut second = restored(&first, &bytes).unwrap();
        prop_assert_eq!(second.digest(), first.digest());
        prop_assert_eq!(second.state_bytes(), bytes);
        for step in cut..260 {
            let (frame, again) = (first.step(&input(seed, step)).clone(), second.step(&input(seed, step)));
            prop_assert_eq!(frame.events, again.events.clone(), "step {}", step);
            prop_assert_eq!(frame.changed, again.changed.clone(), "step {}", step);
            prop_assert_eq!(first.digest(), second.digest(), "step {}", step);
        }
        // Also what no digest tells: what fingers remember, settings.
        prop_assert_eq!(first.state_bytes(), second.state_bytes());
    }

    #[test]
    fn a_clone_of_the_state_goes_on_the_same(seed in 0..10_000_u64, cut in 0..230_u32) {
        let mut first = start();
        run(&mut first, seed, 0..cut);
        let mut second = first.clone();
        second.restore(first.snapshot());
        run(&mut first, seed, cut..260);
        run(&mut second, seed, cut..260);
        prop_assert_eq!(first.state_bytes(), second.state_bytes());
    }
}

/// A way to spoil bytes.
#[derive(Clone, Debug)]
enum Spoil {
    Flip(prop::sample::Index, u8),
    Write(prop::sample::Index, [u8; 8]),
    Cut(prop::sample::Index),
    Drop(prop::sample::Index),
    Append(u8),
}

fn spoils() -> impl Strategy<Value = Spoil> {
    let numbers = [f64::NAN, f64::INFINITY, f64::MAX, -1.0e12, 0.0].map(f64::to_le_bytes);
    prop_oneof![
        4 => (any::<prop::sample::Index>(), 0..8_u8).prop_map(|(at, bit)| Spoil::Flip(at, bit)),
        2 => (any::<prop::sample::Index>(), prop::sample::select(numbers.to_vec()))
            .prop_map(|(at, number)| Spoil::Write(at, number)),
        1 => any::<prop::sample::Index>().prop_map(Spoil::Cut),
        1 => any::<prop::sample::Index>().prop_map(Spoil::Drop),
        1 => (any::<u8>(), Just(())).prop_map(|(byte, ())| Spoil::Append(byte)),
    ]
}

fn spoil(bytes: &mut Vec<u8>, how: &Spoil) {
    match how {
        Spoil::Append(byte) => bytes.push(*byte),
        _ if bytes.is_empty() => {}
        Spoil::Flip(at, bit) => {
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
        }
        Spoil::Write(at, number) => {
            let at = at.index(bytes.len());
            let n = (bytes.len() - at).min(8);
            bytes[at..at + n].copy_from_slice(&number[..n]);
        }
        Spoil::Cut(at) => bytes.truncate(at.index(bytes.len())),
        Spoil::Drop(at) => {
            bytes.remove(at.index(bytes.len()));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn spoilt_bytes_are_refused_or_harmless(
        moment in 0..MOMENTS, how in prop::collection::vec(spoils(), 1..4),
    ) {
        let (world, seed, step) = &*moment_of(moment);
        let mut bytes = world.state_bytes();
        how.iter().for_each(|how| spoil(&mut bytes, how));
        // The step's own checks run in this build.
        if let Ok(mut other) = restored(world, &bytes) {
            run(&mut other, *seed, *step..step + 30);
        }
    }
}

/// Worlds in all kinds of situations.
const MOMENTS: usize = 12;

type Moment = std::sync::Arc<(World, u64, u32)>;

fn moment_of(index: usize) -> Moment {
    static WORLDS: std::sync::OnceLock<Vec<Moment>> = std::sync::OnceLock::new();
    let made = |k: u64| {
        let step = 5 + 20 * k as u32;
        let mut world = start();
        run(&mut world, k, 0..step);
        std::sync::Arc::new((world, k, step))
    };
    std::sync::Arc::clone(&WORLDS.get_or_init(|| (0..MOMENTS as u64).map(made).collect())[index])
}

#[test]
fn bytes_of_something_else_are_told_apart() {
    let mut world = start();
    run(&mut world, 3, 0..50);
    let bytes = world.state_bytes();
    let fault = |bytes: &[u8]| restored(&world, bytes).map(|_| ()).unwrap_err();
    assert_eq!(fault(&[]), SnapshotFault::Damaged);
    assert_eq!(
        fault(&[&[99], &bytes[1..]].concat()),
        SnapshotFault::Version(99)
    );
    assert_eq!(fault(&[&bytes[..], &[0]].concat()), SnapshotFault::Damaged);
    for end in 1..bytes.len() {
        assert_eq!(fault(&bytes[..end]), SnapshotFault::Damaged, "cut at {end}");
    }
    let (scene, mut ids) = scene_now(&world);
    let few = World::restored(scene.clone(), &ids[1..], &bytes);
    let objects = ids.len();
    assert_eq!(
        few.map(|_| ()),
        Err(SnapshotFault::Ids {
            ids: objects - 1,
            objects
        })
    );
    ids[0].generation += 1;
    let other = World::restored(scene, &ids, &bytes);
    assert!(matches!(other.map(|_| ()), Err(SnapshotFault::Object(id)) if id.slot == 0));
}
