//! A world's state as bytes, for recordings that begin in mid-session: exact to the last bit.
//!
//! The bytes hold what steps change and nothing else: shapes, start poses and surroundings belong to the scene.
//! One byte says which version of the layout follows.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::contact::Touch;
use crate::hand::hand_state::HandState;
use crate::scene::{OBJECTS_MAX, ObjectSpec, Scene};
use crate::state::{Body, ContactState, Hold, ObjectId, Rest, Slot, State};
use crate::step::{SceneFaults, World};
pub use crate::validate::StateFault;
use crate::validate::check_read;

/// Version of the layout. It grows with every change to what is stored, the hand's types included.
const VERSION: u8 = 1;

/// Why a state cannot be gone on from.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SnapshotFault {
    /// Another build wrote it.
    #[error("the state is of version {0}: this build reads version {VERSION}")]
    Version(u8),
    /// The bytes are cut, changed or not a state at all.
    #[error("the state's bytes are damaged")]
    Damaged,
    /// The scene cannot be run.
    #[error(transparent)]
    Scene(#[from] SceneFaults),
    /// The scene and the state do not hold the same objects.
    #[error("object {}: it is in the scene or in the state, not in both", .0.to_bits())]
    Object(ObjectId),
    /// Not as many ids as objects.
    #[error("{ids} ids for {objects} objects")]
    Ids {
        /// Number of ids.
        ids: usize,
        /// Number of objects in the scene.
        objects: usize,
    },
    /// The state can be read, but no step ends with it.
    #[error("the state cannot be: {0}")]
    State(#[from] StateFault),
}

/// What is stored. Which slots are awake follows from the objects.
#[derive(Serialize, Deserialize)]
struct Stored {
    tick: u64,
    /// Of every slot, taken or not.
    generations: Vec<u32>,
    /// With their slots.
    bodies: Vec<(u32, StoredBody)>,
    hands: Vec<HandState>,
}

/// A [`Body`] without its spec.
#[derive(Serialize, Deserialize)]
struct StoredBody {
    pose: Isometry3<f64>,
    displacement: Vector3<f64>,
    spin: UnitQuaternion<f64>,
    track: Vec<Point3<f64>>,
    contact: ContactState,
    hold: Option<Hold>,
    touches: Vec<Touch>,
    rest: Rest,
    on_floor: bool,
    topple_case: u8,
    still: bool,
    barred: bool,
}

impl World {
    /// The state as bytes, to go on from with [`World::restored`].
    ///
    /// # Panics
    /// Never: a vector takes every byte.
    pub fn state_bytes(&self) -> Vec<u8> {
        postcard::to_extend(&Stored::of(self.state()), vec![VERSION])
            .expect("a vector takes every byte")
    }

    /// The world whose state these bytes are. The scene holds the objects of that state, with the poses that a reset
    /// takes them back to, and its settings then; `ids` names the objects in their order.
    ///
    /// # Errors
    /// When scene or bytes cannot be gone on from.
    pub fn restored(scene: Scene, ids: &[ObjectId], bytes: &[u8]) -> Result<Self, SnapshotFault> {
        let (version, bytes) = bytes.split_first().ok_or(SnapshotFault::Damaged)?;
        if *version != VERSION {
            return Err(SnapshotFault::Version(*version));
        }
        let faults = scene.validate();
        if !faults.is_empty() {
            return Err(SceneFaults(faults).into());
        }
        let (stored, rest): (Stored, _) =
            postcard::take_from_bytes(bytes).map_err(|_fault| SnapshotFault::Damaged)?;
        if !rest.is_empty() {
            return Err(SnapshotFault::Damaged);
        }
        let state = stored.into_state(specs(&scene, ids)?)?;
        check_read(&state, &scene)?;
        Ok(Self::with(scene, state))
    }
}

type Specs = BTreeMap<ObjectId, Arc<ObjectSpec>>;

fn specs(scene: &Scene, ids: &[ObjectId]) -> Result<Specs, SnapshotFault> {
    if ids.len() != scene.objects.len() {
        return Err(SnapshotFault::Ids {
            ids: ids.len(),
            objects: scene.objects.len(),
        });
    }
    let mut specs = Specs::new();
    for (id, spec) in ids.iter().zip(&scene.objects) {
        if specs.insert(*id, Arc::new(spec.clone())).is_some() {
            return Err(SnapshotFault::Object(*id));
        }
    }
    Ok(specs)
}

impl Stored {
    fn of(state: &State) -> Self {
        let bodies = (0_u32..).zip(&state.slots).filter_map(|(slot, place)| {
            place
                .body
                .as_ref()
                .map(|body| (slot, StoredBody::of(body.clone())))
        });
        Self {
            tick: state.tick,
            generations: state.slots.iter().map(|slot| slot.generation).collect(),
            bodies: bodies.collect(),
            hands: state.hands.clone(),
        }
    }

    fn into_state(self, mut specs: Specs) -> Result<State, SnapshotFault> {
        if self.generations.len() > OBJECTS_MAX {
            return Err(
                StateFault::State("it has more slots than a scene may have objects").into(),
            );
        }
        let empty = |generation| Slot {
            generation,
            body: None,
        };
        let mut slots: Vec<Slot> = self.generations.into_iter().map(empty).collect();
        let mut awake = Vec::new();
        for (slot, body) in self.bodies {
            let place = slots
                .get_mut(slot as usize)
                .ok_or(StateFault::Object(slot, "it is not there"))?;
            let id = ObjectId {
                slot,
                generation: place.generation,
            };
            let spec = specs.remove(&id).ok_or(SnapshotFault::Object(id))?;
            if body.rest == Rest::Awake {
                awake.push(slot);
            }
            place.body = Some(body.into_body(spec));
        }
        if let Some(id) = specs.into_keys().next() {
            return Err(SnapshotFault::Object(id));
        }
        Ok(State {
            tick: self.tick,
            slots,
            awake,
            hands: self.hands,
        })
    }
}

impl StoredBody {
    fn of(body: Body) -> Self {
        // Every field by name: a new one must not be forgotten.
        let Body {
            spec: _,
            pose,
            displacement,
            spin,
            track,
            contact,
            hold,
            touches,
            rest,
            on_floor,
            topple_case,
            still,
            barred,
        } = body;
        Self {
            pose,
            displacement,
            spin,
            track,
            contact,
            hold,
            touches,
            rest,
            on_floor,
            topple_case,
            still,
            barred,
        }
    }

    fn into_body(self, spec: Arc<ObjectSpec>) -> Body {
        Body {
            pose: self.pose,
            displacement: self.displacement,
            spin: self.spin,
            track: self.track,
            contact: self.contact,
            hold: self.hold,
            touches: self.touches,
            rest: self.rest,
            on_floor: self.on_floor,
            topple_case: self.topple_case,
            still: self.still,
            barred: self.barred,
            ..Body::new(spec)
        }
    }
}
