//! Objects that run into each other (Funahashi et al. 1998, §4.3).
//!
//! What a hand-moved object runs into is translated along with it, rotation left out; two objects of which no hand
//! touches either stop where they meet.

use nalgebra::{Isometry3, Translation3, Vector3};

use crate::contact::broad::BroadPhase;
use crate::environment::floor::lifted;
use crate::polyhedron::Polyhedron;
use crate::query::overlap::overlap;
use crate::state::State;

/// Halvings of the way to the moment when two objects meet: a millionth of the step.
const HALVINGS: u32 = 20;
/// A translation that leads out of a neighbour, or along it within this share, does not move it.
const ALONG: f64 = 1.0e-6;

/// Memory that neighbours use again in every step.
#[derive(Clone, Debug, Default)]
pub(crate) struct NeighbourScratch {
    near: Vec<u32>,
}

/// An object that moved, or that a hand keeps where it is, and how far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mover {
    /// Its slot.
    pub(crate) slot: u32,
    /// Translation of its centre of gravity in this step, metres, world space.
    pub(crate) translation: Vector3<f64>,
}

/// The objects that moved in a step, each once, in the order in which they did.
#[derive(Clone, Debug, Default)]
pub(crate) struct Movers {
    list: Vec<Mover>,
    /// By slot, whether it is in the list.
    known: Vec<bool>,
}

impl Movers {
    pub(crate) fn push(&mut self, mover: Mover) {
        let index = mover.slot as usize;
        if self.known.len() <= index {
            self.known.resize(index + 1, false);
        }
        self.known[index] = true;
        self.list.push(mover);
    }

    pub(crate) fn contains(&self, slot: u32) -> bool {
        self.known.get(slot as usize).is_some_and(|known| *known)
    }

    pub(crate) fn as_slice(&self) -> &[Mover] {
        &self.list
    }

    pub(crate) fn clear(&mut self) {
        for mover in self.list.drain(..) {
            self.known[mover.slot as usize] = false;
        }
    }
}

/// Translates what the movers run into along with them, and what that runs into likewise. The moved objects are
/// appended to `movers`; each moves once in a step. An object that enters a neighbour no deeper (it is being lifted off,
/// or slides along) leaves it alone.
///
/// What is pressed below the floor is lifted back onto it, which may leave both overlapping: Fig. 11 of the paper.
pub(crate) fn shove(
    state: &mut State,
    broad: &mut BroadPhase,
    floor: f64,
    movers: &mut Movers,
    scratch: &mut NeighbourScratch,
) {
    let mut next = 0;
    while let Some(&mover) = movers.as_slice().get(next) {
        next += 1;
        let Some(bounds) = broad.bounds(mover.slot).copied() else {
            continue;
        };
        if mover.translation == Vector3::zeros() {
            continue;
        }
        scratch.near.clear();
        broad.query(&bounds, &mut scratch.near);
        for &other in &scratch.near {
            if movers.contains(other) || !runs_into(state, mover, other) {
                continue;
            }
            state.wake(other);
            let body = state.taken(other);
            let pose = Translation3::from(mover.translation) * body.pose;
            body.pose = lifted(&body.spec.shape, &pose, floor);
            body.stop();
            broad.set(other, body.spec.shape.aabb().moved(&body.pose));
            movers.push(Mover {
                slot: other,
                translation: mover.translation,
            });
        }
    }
}

fn runs_into(state: &State, mover: Mover, other: u32) -> bool {
    let (Some(moving), Some(still)) = (state.body(mover.slot), state.body(other)) else {
        return false;
    };
    let met = meeting(
        &moving.spec.shape,
        &moving.pose,
        &still.spec.shape,
        &still.pose,
    );
    met.is_some_and(|out| out.dot(&mover.translation) > ALONG * mover.translation.norm())
}

/// The way out for the second object, a unit vector in world space, if the two overlap.
fn meeting(
    first: &Polyhedron,
    world_from_first: &Isometry3<f64>,
    second: &Polyhedron,
    world_from_second: &Isometry3<f64>,
) -> Option<Vector3<f64>> {
    let first_from_second = world_from_first.inv_mul(world_from_second);
    overlap(first, second, &first_from_second).map(|found| world_from_first.rotation * found.normal)
}

/// Where an object that no hand touches stops on its way, and at what.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    /// The last pose on the way that runs into nothing.
    pub(crate) pose: Isometry3<f64>,
    /// Slot of what is in the way.
    pub(crate) by: u32,
}

/// Follows the object of `slot` on the way from its pose to `to`; `None` if nothing is in the way.
///
/// A neighbour that it overlaps already and does not enter deeper is not in the way.
pub(crate) fn stop_on_the_way(
    state: &State,
    broad: &BroadPhase,
    slot: u32,
    to: &Isometry3<f64>,
    scratch: &mut NeighbourScratch,
) -> Option<Stop> {
    let body = state.body(slot)?;
    let way = to.translation.vector - body.pose.translation.vector;
    scratch.near.clear();
    broad.query(&body.spec.shape.aabb().moved(to), &mut scratch.near);
    let mut first: Option<(f64, u32)> = None;
    for &other in &scratch.near {
        let Some(still) = state.body(other).filter(|_| other != slot) else {
            continue;
        };
        let meets_at =
            |pose: &Isometry3<f64>| meeting(&still.spec.shape, &still.pose, &body.spec.shape, pose);
        let enters = |out: Vector3<f64>| out.dot(&way) < 0.0;
        if !meets_at(to).is_some_and(enters) {
            continue;
        }
        let share = free_share(&body.pose, to, |pose| meets_at(pose).is_some());
        if first.is_none_or(|(least, _)| share < least) {
            first = Some((share, other));
        }
    }
    first.map(|(share, by)| Stop {
        pose: between(&body.pose, to, share),
        by,
    })
}

/// The largest share of the way, to a millionth, at which `meets` does not hold; 0 if it holds from the start.
fn free_share(
    from: &Isometry3<f64>,
    to: &Isometry3<f64>,
    meets: impl Fn(&Isometry3<f64>) -> bool,
) -> f64 {
    if meets(from) {
        return 0.0;
    }
    let (mut free, mut met) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (free + met);
        if meets(&between(from, to, middle)) {
            met = middle;
        } else {
            free = middle;
        }
    }
    free
}

/// The pose at a share of the way; exactly `from` at 0.
fn between(from: &Isometry3<f64>, to: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    if share <= 0.0 {
        return *from;
    }
    let position = from.translation.vector.lerp(&to.translation.vector, share);
    Isometry3::from_parts(
        Translation3::from(position),
        from.rotation.nlerp(&to.rotation, share),
    )
}
