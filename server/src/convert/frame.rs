//! What a tick publishes.

use nalgebra::{Isometry3, Point3};
use tsukamu_proto::v1;
use tsukamu_world::frame::HandFrame;
use tsukamu_world::hand::joint::N_JOINTS;
use tsukamu_world::state::{ContactState, HandId, ObjectId};

use super::basic::{contact_state, plus_one, pose, side, tracking};

/// Bit of a state byte that says "rests".
const RESTS: u8 = 1 << 3;

/// One object as a frame shows it.
#[derive(Clone, Copy, Debug)]
pub struct ObjectNow {
    /// Which one.
    pub id: ObjectId,
    /// `world_from_object`.
    pub pose: Isometry3<f64>,
    /// How hands touch it.
    pub contact: ContactState,
    /// Whether it lies still.
    pub rests: bool,
    /// The hand that holds it.
    pub holder: Option<HandId>,
}

/// Appends one object to the packed arrays.
pub fn push_object(frame: &mut v1::Frame, object: &ObjectNow) {
    let position = &object.pose.translation.vector;
    let rotation = &object.pose.rotation;
    frame.object_ids.push(object.id.to_bits());
    frame.positions.extend([position.x, position.y, position.z]);
    frame
        .rotations
        .extend([rotation.i, rotation.j, rotation.k, rotation.w].map(|part| part as f32));
    frame
        .states
        .push(contact_state(object.contact) as u8 | if object.rests { RESTS } else { 0 });
    frame
        .holders
        .push(object.holder.map_or(0, |hand| hand.0.saturating_add(1)));
}

/// One hand as a message. `sample_age_s` is the age of the sample that stands, in seconds.
pub fn hand_frame(hand: &HandFrame, sample_age_s: f32) -> v1::HandFrame {
    v1::HandFrame {
        id: hand.hand.0,
        side: side(hand.side).into(),
        tracking: tracking(hand.tracking).into(),
        wrist: Some(pose(&hand.wrist)),
        tracked: joint_list(&hand.tracked),
        shown: joint_list(&hand.shown),
        holds: plus_one(hand.holds.map(|id| id.to_bits())),
        sample_age_s,
    }
}

fn joint_list(joints: &[Option<Point3<f64>>; N_JOINTS]) -> Vec<f32> {
    joints
        .iter()
        .flat_map(|joint| joint.map_or([f32::NAN; 3], |p| [p.x as f32, p.y as f32, p.z as f32]))
        .collect()
}
