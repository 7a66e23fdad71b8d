//! The world as VRPN shows it: poses, angles and buttons at one time, encoded for everybody.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use tsukamu_devices::tracker::space::TrackerSpace;
use tsukamu_devices::vrpn::body::{PosQuat, encode_channels};
use tsukamu_devices::vrpn::message::{Header, Time, encode_with};
use tsukamu_world::frame::{HandFrame, Tracking};
use tsukamu_world::hand::joint::{N_JOINTS, POINTS_PER_FINGER};
use tsukamu_world::hand::kinematics::angles_from_points;
use tsukamu_world::hand::sample::N_ANGLES;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::state::HandId;

use crate::broadcast::inbox::{HandNow, SceneNow};

use super::names::{CHANNEL_ID, HandIds, OBJECTS_ID, POS_QUAT_ID, Roster, SLOTS_MAX, WORLD_ID};

/// Buttons of a hand: it holds something, five fingers touch, it is followed.
pub(super) const N_BUTTONS: usize = 7;
/// How often objects that do not move are shown too: a datagram may have been lost, a program may listen late.
const WHOLE_NS: u64 = 1_000_000_000;

/// One hand.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HandReport {
    /// Its number.
    pub(super) slot: usize,
    /// Wrist and joints; empty when it is not followed.
    pub(super) poses: Vec<PosQuat>,
    /// Joint angles, degrees; `None` while a joint was never tracked.
    pub(super) angles: Option<[f64; N_ANGLES]>,
    /// Pressed buttons, one bit each.
    pub(super) buttons: u32,
}

/// The world at one time.
#[derive(Debug)]
pub(super) struct Picture {
    /// Counts pictures; no two are the same.
    pub(super) serial: u64,
    /// When the step was done.
    pub(super) time: Time,
    /// Own names.
    pub(super) roster: Arc<Roster>,
    /// Hands, by number.
    pub(super) hands: Vec<HandReport>,
    /// Objects by slot.
    pub(super) objects: BTreeMap<u32, PosQuat>,
    /// Everything, encoded.
    pub(super) whole: Vec<u8>,
    /// What changed since the picture before, encoded; everything now and then.
    pub(super) changed: Vec<u8>,
}

/// Makes pictures of scenes.
#[derive(Debug)]
pub(super) struct Painter {
    axes: TrackerSpace,
    slots: BTreeMap<HandId, usize>,
    roster: Option<(u64, u64, Arc<Roster>)>,
    objects: BTreeMap<u32, PosQuat>,
    serial: u64,
    /// Epoch and tick of the last picture.
    last: Option<(u64, u64)>,
    whole_ns: u64,
}

impl Painter {
    pub(super) const fn new(axes: TrackerSpace) -> Self {
        Self {
            axes,
            slots: BTreeMap::new(),
            roster: None,
            objects: BTreeMap::new(),
            serial: 0,
            last: None,
            whole_ns: 0,
        }
    }

    /// Nobody watches for a while: the next scene makes a picture in any case.
    pub(super) fn pause(&mut self) {
        self.last = None;
    }

    /// A picture; `None` when the world has not moved on since the last.
    pub(super) fn paint(&mut self, now: &SceneNow) -> Option<Picture> {
        let at = (now.stamp.epoch, now.stamp.tick);
        if self.last == Some(at) {
            return None;
        }
        self.last = Some(at);
        self.serial += 1;
        self.seat(now);
        let objects = self.objects_of(now);
        let is_whole = now.stamp.wall_ns.abs_diff(self.whole_ns) >= WHOLE_NS;
        if is_whole {
            self.whole_ns = now.stamp.wall_ns;
        }
        let moved = |(slot, pose): &(&u32, &PosQuat)| self.objects.get(slot) != Some(*pose);
        let hands: Vec<HandReport> = now
            .hands
            .iter()
            .filter_map(|hand| self.report(now, hand))
            .collect();
        let mut writer = Writer::new(now.stamp.wall_ns, self.serial);
        let world = [
            now.stamp.epoch as f64,
            now.stamp.tick as f64,
            now.stamp.world_time_s,
        ];
        writer.channels(WORLD_ID, &world);
        for hand in &hands {
            writer.hand(HandIds::of(hand.slot), hand);
        }
        let changed_from = writer.out.len();
        for (_, pose) in objects.iter().filter(moved) {
            writer.pose(OBJECTS_ID, pose);
        }
        let mut changed = writer.out.clone();
        writer.out.truncate(changed_from);
        for pose in objects.values() {
            writer.pose(OBJECTS_ID, pose);
        }
        if is_whole {
            changed.clone_from(&writer.out);
        }
        self.objects.clone_from(&objects);
        Some(Picture {
            serial: self.serial,
            time: writer.time,
            roster: self.roster_of(now),
            hands,
            objects,
            whole: writer.out,
            changed,
        })
    }

    /// Gives numbers to hands that came, and takes them from hands that went.
    fn seat(&mut self, now: &SceneNow) {
        let here = &now.content.hands;
        self.slots
            .retain(|id, _| here.iter().any(|hand| hand.id == *id));
        for hand in here {
            let is_free = |slot: &usize| !self.slots.values().any(|taken| taken == slot);
            if !self.slots.contains_key(&hand.id)
                && let Some(slot) = (0..SLOTS_MAX).find(is_free)
            {
                self.slots.insert(hand.id, slot);
            }
        }
    }

    fn roster_of(&mut self, now: &SceneNow) -> Arc<Roster> {
        let content = &now.content;
        if let Some((epoch, version, roster)) = &self.roster
            && (*epoch, *version) == (content.epoch, content.version)
        {
            return Arc::clone(roster);
        }
        let hands: Vec<(usize, &str)> = content
            .hands
            .iter()
            .filter_map(|hand| Some((*self.slots.get(&hand.id)?, hand.name.as_str())))
            .collect();
        let roster = Arc::new(Roster::of(&hands, &content.objects));
        self.roster = Some((content.epoch, content.version, Arc::clone(&roster)));
        roster
    }

    fn objects_of(&self, now: &SceneNow) -> BTreeMap<u32, PosQuat> {
        let ids = now.content.objects.iter().map(|(id, _)| id.slot);
        ids.zip(&now.poses)
            .map(|(slot, pose)| (slot, self.pos_quat(slot as i32, pose)))
            .collect()
    }

    fn report(&self, now: &SceneNow, hand: &HandNow) -> Option<HandReport> {
        let frame = &hand.frame;
        let named = now
            .content
            .hands
            .iter()
            .find(|named| named.id == frame.hand)?;
        let is_seen = matches!(frame.tracking, Tracking::Tracked | Tracking::Held);
        let flags = std::iter::once(frame.holds.is_some())
            .chain(hand.touching)
            .chain([frame.tracking == Tracking::Tracked]);
        let bits = flags
            .enumerate()
            .map(|(bit, is_on)| u32::from(is_on) << bit);
        Some(HandReport {
            slot: *self.slots.get(&frame.hand)?,
            poses: if is_seen {
                self.poses(frame)
            } else {
                Vec::new()
            },
            angles: is_seen.then(|| angles_deg(&named.model, frame)).flatten(),
            buttons: bits.sum(),
        })
    }

    /// The wrist, and each joint that was ever tracked. A joint's rotation is that of the link before it, turned by the
    /// shortest way so that -z points to the next joint; the tip has that of its link.
    fn poses(&self, frame: &HandFrame) -> Vec<PosQuat> {
        let mut poses = vec![self.pos_quat(0, &frame.wrist)];
        for (finger, joints) in frame.shown.chunks(POINTS_PER_FINGER).enumerate() {
            let mut rotation = frame.wrist.rotation;
            for (step, joint) in joints.iter().enumerate() {
                let Some(place) = joint else { continue };
                if let Some(Some(next)) = joints.get(step + 1) {
                    rotation = turned_toward(&rotation, &(next - place));
                }
                let sensor = 1 + finger * POINTS_PER_FINGER + step;
                let pose = Isometry3::from_parts(Translation3::from(place.coords), rotation);
                poses.push(self.pos_quat(sensor as i32, &pose));
            }
        }
        poses
    }

    fn pos_quat(&self, sensor: i32, pose: &Isometry3<f64>) -> PosQuat {
        let pose = self.axes.from_world(pose);
        let rotation = pose.rotation;
        PosQuat {
            sensor,
            position: pose.translation.vector.into(),
            rotation: [rotation.i, rotation.j, rotation.k, rotation.w],
        }
    }
}

/// A rotation turned by the shortest way so that its -z points along `direction`; itself where that is undefined.
fn turned_toward(rotation: &UnitQuaternion<f64>, direction: &Vector3<f64>) -> UnitQuaternion<f64> {
    let forward = rotation * -Vector3::z();
    UnitQuaternion::rotation_between(&forward, direction).map_or(*rotation, |turn| turn * rotation)
}

/// The joint angles as tracked, degrees; `None` while a joint was never tracked.
fn angles_deg(model: &HandModel, frame: &HandFrame) -> Option<[f64; N_ANGLES]> {
    let mut points = [Point3::origin(); N_JOINTS];
    for (point, tracked) in points.iter_mut().zip(&frame.tracked) {
        *point = frame.wrist.inverse_transform_point(&(*tracked)?);
    }
    let angles = angles_from_points(&model.skeleton, model.side, &points);
    Some(angles.to_list().map(f64::to_degrees))
}

/// Encodes messages of one time.
#[derive(Debug)]
pub(super) struct Writer {
    pub(super) out: Vec<u8>,
    pub(super) time: Time,
    sequence: u32,
}

impl Writer {
    pub(super) fn new(unix_ns: u64, serial: u64) -> Self {
        Self::at(Time::from_unix_ns(unix_ns), serial)
    }

    pub(super) const fn at(time: Time, serial: u64) -> Self {
        Self {
            out: Vec::new(),
            time,
            sequence: serial as u32,
        }
    }

    pub(super) fn message(&mut self, sender: i32, kind: i32, body: impl FnOnce(&mut Vec<u8>)) {
        let header = Header {
            time: self.time,
            sender,
            kind,
            sequence: self.sequence,
        };
        encode_with(&header, &mut self.out, body);
    }

    pub(super) fn pose(&mut self, sender: i32, pose: &PosQuat) {
        self.message(sender, POS_QUAT_ID, |out| pose.encode(out));
    }

    pub(super) fn channels(&mut self, sender: i32, channels: &[f64]) {
        self.message(sender, CHANNEL_ID, |out| encode_channels(channels, out));
    }

    /// Poses and angles of a hand.
    pub(super) fn hand(&mut self, ids: HandIds, hand: &HandReport) {
        for pose in &hand.poses {
            self.pose(ids.hand, pose);
        }
        if let Some(angles) = &hand.angles {
            self.channels(ids.glove, angles);
        }
    }
}
