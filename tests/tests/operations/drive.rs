//! Runs a built-in scene with a synthetic hand and keeps what became of it.

use nalgebra::{Isometry3, Point3};
use tsukamu_motion::synthetic::{SceneInfo, SyntheticHand, build};
use tsukamu_server::scene_file;
use tsukamu_world::World;
use tsukamu_world::frame::{Event, EventKind};
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::{Command, HandInput, StepInput};
use tsukamu_world::scene::Scene;
use tsukamu_world::state::{ContactState, HandId};

/// The rates at which every operation must come about, Hz.
pub(crate) const RATES_HZ: [f64; 4] = [60.0, 240.0, 1000.0, 2000.0];
const HAND: HandId = HandId(1);

/// One object at one tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) pose: Isometry3<f64>,
    pub(crate) contact: ContactState,
    pub(crate) resting: bool,
}

/// What became of a scene.
pub(crate) struct Run {
    pub(crate) rate_hz: f64,
    pub(crate) hand: SyntheticHand,
    /// By tick, then by object; tick 0 is the start.
    pub(crate) ticks: Vec<Vec<Place>>,
    pub(crate) events: Vec<(u64, Event)>,
    pub(crate) scene: Scene,
}

impl Run {
    pub(crate) fn places(&self, object: usize) -> impl Iterator<Item = (u64, Place)> {
        (0_u64..).zip(self.ticks.iter().map(move |places| places[object]))
    }

    pub(crate) fn position(&self, tick: u64, object: usize) -> Point3<f64> {
        self.ticks[tick as usize][object]
            .pose
            .translation
            .vector
            .into()
    }

    pub(crate) fn last(&self, object: usize) -> Place {
        self.ticks[self.ticks.len() - 1][object]
    }

    /// The ticks of all events of that kind and object.
    pub(crate) fn events_of(&self, object: usize, kind: &str) -> Vec<(u64, EventKind)> {
        let of = |event: &Event| event.object.is_some_and(|id| id.slot as usize == object);
        let found = self
            .events
            .iter()
            .filter(|(_, event)| of(event) && event.kind.name() == kind);
        found
            .map(|(tick, event)| (*tick, event.kind.clone()))
            .collect()
    }

    /// How many vertices of the object are on the floor at the end, within a micrometre.
    pub(crate) fn vertices_on_floor(&self, object: usize) -> usize {
        let spec = &self.scene.objects[object];
        let heights = spec
            .shape
            .vertices()
            .iter()
            .map(|vertex| (self.last(object).pose * vertex).y);
        heights
            .filter(|y| (y - self.scene.floor_height).abs() < 1e-6)
            .count()
    }
}

/// Runs a scene with a hand at every rate, with some seeds right and left, `after_s` seconds longer than its motion.
pub(crate) fn for_all(scene_name: &str, spec: &str, after_s: f64, check: fn(&Run, &str)) {
    let separator = if spec.contains('?') { '&' } else { '?' };
    for rate in RATES_HZ {
        for (seed, side) in [
            (1, "right"),
            (2, "right"),
            (5, "right"),
            (1, "left"),
            (4, "left"),
        ] {
            let spec = format!("{spec}{separator}seed={seed}&side={side}");
            let what = format!("{spec} at {rate} Hz");
            check(&run(scene_name, &spec, rate, after_s), &what);
        }
    }
}

fn scene(name: &str, rate_hz: f64) -> Scene {
    let mut scene = scene_file::load(name)
        .unwrap_or_else(|mistakes| panic!("{name}: {mistakes:?}"))
        .scene;
    scene.rate_hz = rate_hz;
    scene
}

/// Runs the built-in scene of that name with the hand of that text, `after_s` seconds longer than its motion.
pub(crate) fn run(scene_name: &str, spec: &str, rate_hz: f64, after_s: f64) -> Run {
    let scene = scene(scene_name, rate_hz);
    let hand =
        build(spec, &SceneInfo::from(&scene)).unwrap_or_else(|fault| panic!("{spec}: {fault}"));
    let mut world = World::new(scene.clone()).expect("a scene of the project's own");
    let n_ticks = ((hand.duration_s() + after_s) * rate_hz).ceil() as u64;
    let mut run = Run {
        rate_hz,
        hand,
        ticks: vec![places(&world)],
        events: Vec::new(),
        scene,
    };
    for tick in 1..=n_ticks {
        let sample = Some(run.hand.sample_at(tick as f64 / rate_hz));
        let mut input = StepInput {
            commands: Vec::new(),
            hands: vec![HandInput { hand: HAND, sample }],
        };
        if tick == 1 {
            let model = Box::new(HandModel::adult(run.hand.side()));
            input.commands.push(Command::AddHand { hand: HAND, model });
        }
        let frame = world.step(&input);
        run.events
            .extend(frame.events.iter().map(|event| (tick, event.clone())));
        run.ticks.push(places(&world));
    }
    run
}

fn places(world: &World) -> Vec<Place> {
    let objects = world.objects();
    objects
        .map(|(_, body)| Place {
            pose: body.pose,
            contact: body.contact,
            resting: body.is_resting(),
        })
        .collect()
}
