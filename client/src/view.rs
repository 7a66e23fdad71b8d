use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use thiserror::Error;
use tsukamu_proto::v1::{ContactState, Frame, HandFrame, Pose, Side, Tracking};

/// Joints of a hand in frames: finger by finger, thumb first, from the palm to the tip.
pub const N_JOINTS: usize = 20;
/// The low bits of an object's state byte: how hands touch it.
const STATE_BITS: u8 = 0b0111;
/// Set when it rests.
const RESTING_BIT: u8 = 0b1000;

/// Where in time something belongs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stamp {
    /// Counts the worlds of the daemon; ticks start again with it.
    pub epoch: u64,
    /// Steps since the epoch began.
    pub tick: u64,
    /// World time, seconds.
    pub world_time_s: f64,
    /// When the step was done, nanoseconds since the Unix epoch, by the daemon's clock.
    pub wall_ns: u64,
}

impl From<&tsukamu_proto::v1::Stamp> for Stamp {
    fn from(wire: &tsukamu_proto::v1::Stamp) -> Self {
        Self {
            epoch: wire.epoch,
            tick: wire.tick,
            world_time_s: wire.world_time_s,
            wall_ns: wire.wall_ns,
        }
    }
}

/// The world as the newest frame shows it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WorldView {
    /// When.
    pub stamp: Stamp,
    /// Counts changes of the scene's content.
    pub scene_version: u64,
    /// The objects by id.
    pub objects: BTreeMap<u64, ObjectView>,
    /// The hands, in the frame's order.
    pub hands: Vec<HandView>,
}

/// One object at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectView {
    /// `world_from_object`; the origin is the centre of gravity.
    pub pose: Isometry3<f64>,
    /// How hands touch it.
    pub state: ContactState,
    /// Whether it lies still.
    pub resting: bool,
    /// Id of the hand that holds it.
    pub holder: Option<u32>,
}

/// The joints of a hand, world space, metres; `None` was never tracked.
pub type Joints = [Option<Point3<f64>>; N_JOINTS];

/// One hand at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct HandView {
    /// Its id.
    pub id: u32,
    /// Left or right.
    pub side: Side,
    /// Whether it is followed.
    pub tracking: Tracking,
    /// `world_from_wrist`.
    pub wrist: Isometry3<f64>,
    /// As tracked.
    pub tracked: Joints,
    /// As shown: fingers opened to the surface of what they touch.
    pub shown: Joints,
    /// Id of the object it holds.
    pub holds: Option<u64>,
    /// Age of the sample that stands, seconds at the step.
    pub sample_age_s: f64,
}

/// What a frame was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Applied {
    /// A whole frame.
    Keyframe,
    /// A difference to the keyframe that is held.
    Delta,
}

/// Why a frame was not applied. The view stays as it was.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FrameFault {
    /// It says not when it is.
    #[error("the frame has no stamp")]
    NoStamp,
    /// It is a delta, and its keyframe is not the one that is held. The next keyframe mends it.
    #[error("the frame builds on keyframe {wanted}, which is not held")]
    MissingKeyframe {
        /// Tick of the keyframe that it builds on.
        wanted: u64,
    },
    /// It is a delta that is not newer than what is shown.
    #[error("frame {tick} is not newer than {shown}, which is shown")]
    Stale {
        /// Its tick.
        tick: u64,
        /// Tick that is shown.
        shown: u64,
    },
    /// One of its arrays has not the length that the number of its objects demands, or a hand's has not twenty joints.
    #[error("the frame has {found} values of {array}, where {expected} belong")]
    Length {
        /// The array.
        array: &'static str,
        /// The length that belongs there.
        expected: usize,
        /// The length that came.
        found: usize,
    },
    /// A number is not finite, or a rotation is no rotation.
    #[error("the frame has a pose that is none: {of}")]
    Pose {
        /// Whose.
        of: String,
    },
}

/// Folds the frames of one stream into a view: a keyframe replaces it, a delta replaces the delta before it.
///
/// Deltas are cumulative against their keyframe, so any of them may be lost. A new stream begins with a new fold.
#[derive(Clone, Debug, Default)]
pub struct FrameFold {
    view: WorldView,
    keyframe: BTreeMap<u64, ObjectView>,
    /// Epoch and tick of the keyframe.
    held: Option<(u64, u64)>,
    /// Ids in which the view may differ from the keyframe.
    overlaid: Vec<u64>,
}

impl FrameFold {
    /// The world as the newest frame shows it; `None` before the first keyframe.
    pub fn view(&self) -> Option<&WorldView> {
        self.held.map(|_| &self.view)
    }

    /// Applies one frame.
    ///
    /// # Errors
    /// When the frame is broken, or builds on what is not held; the view is then unchanged.
    pub fn apply(&mut self, frame: &Frame) -> Result<Applied, FrameFault> {
        let stamp = stamp_of(frame)?;
        let is_keyframe = frame.keyframe_tick == stamp.tick;
        if !is_keyframe {
            self.check_base(&stamp, frame.keyframe_tick)?;
        }
        let objects = objects_of(frame)?;
        let hands = frame
            .hands
            .iter()
            .map(hand_of)
            .collect::<Result<Vec<_>, _>>()?;
        if is_keyframe {
            self.keyframe = objects.into_iter().collect();
            self.view.objects.clone_from(&self.keyframe);
            self.overlaid.clear();
            self.held = Some((stamp.epoch, stamp.tick));
        } else {
            self.overlay(&objects, &frame.removed_ids);
        }
        self.view.stamp = stamp;
        self.view.scene_version = frame.scene_version;
        self.view.hands = hands;
        Ok(if is_keyframe {
            Applied::Keyframe
        } else {
            Applied::Delta
        })
    }

    fn check_base(&self, stamp: &Stamp, keyframe_tick: u64) -> Result<(), FrameFault> {
        if self.held != Some((stamp.epoch, keyframe_tick)) {
            return Err(FrameFault::MissingKeyframe {
                wanted: keyframe_tick,
            });
        }
        if stamp.tick <= self.view.stamp.tick {
            return Err(FrameFault::Stale {
                tick: stamp.tick,
                shown: self.view.stamp.tick,
            });
        }
        Ok(())
    }

    /// Takes back the delta that stands, then lays this one over the keyframe.
    fn overlay(&mut self, objects: &[(u64, ObjectView)], removed: &[u64]) {
        for id in self.overlaid.drain(..) {
            match self.keyframe.get(&id) {
                Some(object) => self.view.objects.insert(id, *object),
                None => self.view.objects.remove(&id),
            };
        }
        for (id, object) in objects {
            self.view.objects.insert(*id, *object);
            self.overlaid.push(*id);
        }
        for id in removed {
            self.view.objects.remove(id);
            self.overlaid.push(*id);
        }
    }
}

fn stamp_of(frame: &Frame) -> Result<Stamp, FrameFault> {
    frame
        .stamp
        .as_ref()
        .map(Stamp::from)
        .ok_or(FrameFault::NoStamp)
}

fn objects_of(frame: &Frame) -> Result<Vec<(u64, ObjectView)>, FrameFault> {
    let n_objects = frame.object_ids.len();
    check_length("positions", 3 * n_objects, frame.positions.len())?;
    check_length("rotations", 4 * n_objects, frame.rotations.len())?;
    check_length("states", n_objects, frame.states.len())?;
    check_length("holders", n_objects, frame.holders.len())?;
    let positions = frame.positions.chunks_exact(3);
    let rotations = frame.rotations.chunks_exact(4);
    let states = frame.states.iter().zip(&frame.holders);
    let parts = frame
        .object_ids
        .iter()
        .zip(positions.zip(rotations))
        .zip(states);
    parts
        .map(|((id, (position, rotation)), (state, holder))| {
            let coords = [rotation[0], rotation[1], rotation[2], rotation[3]].map(f64::from);
            let pose =
                pose_of([position[0], position[1], position[2]], coords).ok_or_else(|| {
                    FrameFault::Pose {
                        of: format!("object {id}"),
                    }
                })?;
            let object = ObjectView {
                pose,
                state: ContactState::try_from(i32::from(state & STATE_BITS)).unwrap_or_default(),
                resting: state & RESTING_BIT != 0,
                holder: holder.checked_sub(1),
            };
            Ok((*id, object))
        })
        .collect()
}

fn hand_of(hand: &HandFrame) -> Result<HandView, FrameFault> {
    let wrist = hand
        .wrist
        .as_ref()
        .map_or_else(|| Some(Isometry3::identity()), isometry);
    Ok(HandView {
        id: hand.id,
        side: hand.side(),
        tracking: hand.tracking(),
        wrist: wrist.ok_or_else(|| FrameFault::Pose {
            of: format!("the wrist of hand {}", hand.id),
        })?,
        tracked: joints_of("tracked joints", &hand.tracked)?,
        shown: joints_of("shown joints", &hand.shown)?,
        holds: hand.holds.checked_sub(1),
        sample_age_s: f64::from(hand.sample_age_s),
    })
}

/// The joints in their wire order; an empty array is a hand of which none was ever tracked.
fn joints_of(array: &'static str, values: &[f32]) -> Result<Joints, FrameFault> {
    let mut joints = [None; N_JOINTS];
    if values.is_empty() {
        return Ok(joints);
    }
    check_length(array, 3 * N_JOINTS, values.len())?;
    for (joint, xyz) in joints.iter_mut().zip(values.chunks_exact(3)) {
        let point = Point3::new(f64::from(xyz[0]), f64::from(xyz[1]), f64::from(xyz[2]));
        *joint = point.coords.iter().all(|x| x.is_finite()).then_some(point);
    }
    Ok(joints)
}

/// The pose as an isometry; `None` when a number is not finite or the rotation has no length.
/// A missing position is the origin, a missing rotation is none.
pub fn isometry(pose: &Pose) -> Option<Isometry3<f64>> {
    let position = pose.position.unwrap_or_default();
    let rotation = pose
        .rotation
        .map_or([0.0, 0.0, 0.0, 1.0], |q| [q.x, q.y, q.z, q.w]);
    pose_of([position.x, position.y, position.z], rotation)
}

fn pose_of([x, y, z]: [f64; 3], [i, j, k, w]: [f64; 4]) -> Option<Isometry3<f64>> {
    let rotation = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-6)?;
    let pose = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
    let finite = [x, y, z, i, j, k, w].iter().all(|value| value.is_finite());
    finite.then_some(pose)
}

fn check_length(array: &'static str, expected: usize, found: usize) -> Result<(), FrameFault> {
    if expected == found {
        Ok(())
    } else {
        Err(FrameFault::Length {
            array,
            expected,
            found,
        })
    }
}

#[cfg(test)]
#[path = "view_tests.rs"]
mod tests;
