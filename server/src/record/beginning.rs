//! The world that a recording, or an epoch of it, begins with.

use nalgebra::Isometry3;
use tsukamu_proto::v1;
use tsukamu_world::World;
use tsukamu_world::snapshot::SnapshotFault;
use tsukamu_world::state::ObjectId;
use tsukamu_world::step::SceneFaults;

use crate::convert::fault::Fault;
use crate::convert::scene::{NamedHand, named_hand, object, scene_from, surroundings};

/// Why a recorded world cannot be built.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum BeginningFault {
    /// The recorded scene cannot be one.
    #[error("its scene cannot be read: {0}")]
    Scene(#[from] Fault),
    /// The recorded scene cannot be run.
    #[error("its scene cannot be run: {0}")]
    World(#[from] SceneFaults),
    /// The recorded state cannot be gone on from.
    #[error(transparent)]
    State(#[from] SnapshotFault),
    /// The recorded state is that of another tick.
    #[error("the state is that of tick {state}, the record is that of tick {record}")]
    Tick {
        /// Tick of the state.
        state: u64,
        /// Tick of the record.
        record: u64,
    },
}

/// What a recording begins with that begins with this world as it stands. `text` is the scene's own.
pub fn record_of(world: &World, epoch: u64, hands: &[NamedHand], text: &str) -> v1::SceneRecord {
    let scene = world.scene();
    let whole = |(id, body): (ObjectId, &tsukamu_world::state::Body)| {
        let now: &Isometry3<f64> = &body.pose;
        object(id, &body.spec, now, scene.grasp_angle)
    };
    v1::SceneRecord {
        epoch,
        scene: Some(v1::Scene {
            objects: world.objects().map(whole).collect(),
            hands: hands.iter().map(named_hand).collect(),
            ..surroundings(scene)
        }),
        source_text: text.to_owned(),
        tick: world.state().tick,
        state: world.state_bytes(),
    }
}

/// The world of a record, at the tick that it says.
///
/// # Errors
/// When it cannot be built.
pub fn world_at(record: &v1::SceneRecord) -> Result<World, BeginningFault> {
    let message = record.scene.as_ref().ok_or(Fault::Missing("scene"))?;
    let scene = scene_from(message)?;
    let world = if record.state.is_empty() {
        World::new(scene)?
    } else {
        let ids = message
            .objects
            .iter()
            .map(|object| ObjectId::from_bits(object.id));
        let ids: Vec<ObjectId> = ids.collect();
        World::restored(scene, &ids, &record.state)?
    };
    if world.state().tick != record.tick {
        return Err(BeginningFault::Tick {
            state: world.state().tick,
            record: record.tick,
        });
    }
    Ok(world)
}

/// The hands that are in a world at its beginning, with the names that its record gives them.
pub fn hands_of(world: &World, record: &v1::SceneRecord) -> Vec<NamedHand> {
    let named = record.scene.as_ref().map_or(&[][..], |scene| &scene.hands);
    let hands = world.hands().iter().map(|hand| NamedHand {
        id: hand.id,
        name: named
            .iter()
            .find(|named| named.id == hand.id.0)
            .map_or_else(String::new, |named| named.name.clone()),
        model: hand.model.clone(),
    });
    hands.collect()
}
