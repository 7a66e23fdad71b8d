//! A recorded hand against one object.

use nalgebra::{Isometry3, Point3};
use tsukamu_motion::import::adroit_body::BodyRow;
use tsukamu_motion::track::{Outside, TrackHand};
use tsukamu_world::World;
use tsukamu_world::frame::EventKind;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::{Command, HandInput, StepInput};
use tsukamu_world::scene::Scene;
use tsukamu_world::state::{ContactState, HandId, ObjectId};

use super::{RecordingsFault, Stands};

/// The hand that is played.
const HAND: HandId = HandId(0);
/// The one object.
const OBJECT: ObjectId = ObjectId {
    slot: 0,
    generation: 0,
};

/// What the object did.
#[derive(Clone, Debug, Default)]
pub(super) struct Replay {
    /// One per step.
    pub(super) moments: Vec<Moment>,
    /// Every hold, in order.
    pub(super) holds: Vec<Hold>,
}

/// The object after one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    /// World time, seconds.
    pub(super) t_s: f64,
    /// `world_from_object`.
    pub(super) pose: Isometry3<f64>,
    /// How the hand touches it.
    pub(super) contact: ContactState,
}

/// One hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hold {
    /// When it began, seconds.
    pub(super) from_s: f64,
    /// When it ended, seconds; `None` if it outlasts the recording.
    pub(super) until_s: Option<f64>,
    /// The largest angle between two contact normals when it began, radians.
    pub(super) angle: f64,
}

/// Plays a hand into a scene of one object, to the end of its samples.
pub(super) fn replay(
    demo: &str,
    scene: Scene,
    model: &HandModel,
    stands: Stands,
    hand: &TrackHand,
) -> Result<Replay, RecordingsFault> {
    let refused = |why: String| RecordingsFault::Scene {
        demo: demo.to_owned(),
        why,
    };
    model
        .validate()
        .map_err(|fault| refused(fault.to_string()))?;
    let rate_hz = scene.rate_hz;
    let mut world = World::new(scene).map_err(|faults| refused(faults.to_string()))?;
    let end_s = hand.times_s.last().copied().unwrap_or(0.0);
    let mut answer = Replay::default();
    let mut input = StepInput::default();
    input.commands.push(Command::AddHand {
        hand: HAND,
        model: Box::new(model.clone()),
    });
    for tick in 1..=(end_s * rate_hz).floor() as u64 {
        let t_s = tick as f64 / rate_hz;
        input.hands.push(HandInput {
            hand: HAND,
            sample: hand.sample_at(t_s, Outside::Hold),
        });
        for event in &world.step(&input).events {
            note(&event.kind, t_s, &mut answer.holds);
        }
        input.clear();
        if stands == Stands::UntilGrasped && answer.holds.is_empty() {
            put_back(&mut world);
        }
        if let Some(body) = world.object(OBJECT) {
            answer.moments.push(Moment {
                t_s,
                pose: body.pose,
                contact: body.contact,
            });
        }
    }
    Ok(answer)
}

/// Puts the object back to its start, without motion; what touches it goes on touching it.
fn put_back(world: &mut World) {
    let mut state = world.snapshot();
    for body in state.slots.iter_mut().filter_map(|slot| slot.body.as_mut()) {
        body.pose = body.spec.pose;
        body.stop();
    }
    world.restore(state);
}

fn note(kind: &EventKind, t_s: f64, holds: &mut Vec<Hold>) {
    match kind {
        EventKind::Grasped { angle, .. } => holds.push(Hold {
            from_s: t_s,
            until_s: None,
            angle: *angle,
        }),
        EventKind::Released { .. } => {
            if let Some(hold) = holds.last_mut() {
                hold.until_s.get_or_insert(t_s);
            }
        }
        _ => {}
    }
}

impl Replay {
    /// The last moment at or before a time.
    pub(super) fn at(&self, t_s: f64) -> Option<&Moment> {
        let after = self.moments.partition_point(|moment| moment.t_s <= t_s);
        self.moments[..after].last()
    }

    /// The hold that lives at a time, or else the last one that began before it.
    pub(super) fn hold_at(&self, t_s: f64) -> Option<&Hold> {
        self.holds.iter().rev().find(|hold| hold.from_s <= t_s)
    }

    /// When the recording ends, seconds.
    pub(super) fn end_s(&self) -> f64 {
        self.moments.last().map_or(0.0, |moment| moment.t_s)
    }
}

/// Where a recorded body was at a time, between its rows.
pub(super) fn reference_place(path: &[BodyRow], t_s: f64) -> Option<Point3<f64>> {
    let after = path.partition_point(|row| row.t_s <= t_s);
    let before = path.get(after.checked_sub(1)?)?;
    let place = |row: &BodyRow| Point3::from(row.pose.translation.vector);
    let Some(next) = path.get(after) else {
        return Some(place(before));
    };
    let share = (t_s - before.t_s) / (next.t_s - before.t_s);
    Some(place(before) + (place(next) - place(before)) * share)
}
