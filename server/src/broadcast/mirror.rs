//! The publisher's copy of the world, and the keyframes and cumulative deltas made from it.

use std::sync::Arc;

use bytes::{BufMut, Bytes, BytesMut};
use prost::Message;
use tsukamu_proto::v1;
use tsukamu_world::state::ObjectId;

use crate::convert::frame::{ObjectNow, hand_frame, push_object};
use crate::wire_message::WireMessage;

use super::inbox::{Batch, Content, Head, SceneNow};

/// Tag of `WatchFramesResponse.frame`: field 1, length-delimited.
const FRAME_TAG: u8 = 0x0A;

/// The world as the last tick left it.
#[derive(Debug, Default)]
pub(super) struct Mirror {
    content: Option<Arc<Content>>,
    /// By slot.
    objects: Vec<Option<ObjectNow>>,
    head: Option<Head>,
    key: Option<Key>,
    /// Slots that changed since the keyframe; each at most once.
    since_key: Vec<u32>,
    /// By slot: whether it is in `since_key`.
    is_since_key: Vec<bool>,
    removed_since_key: Vec<ObjectId>,
    /// Kept for its memory.
    message: v1::Frame,
    buffer: BytesMut,
}

#[derive(Clone, Copy, Debug)]
struct Key {
    tick: u64,
    wall_ns: u64,
}

/// An encoded frame.
#[derive(Clone, Debug)]
pub struct Encoded {
    /// Tick of the frame.
    pub tick: u64,
    /// An encoded `WatchFramesResponse`.
    pub response: WireMessage,
    /// Where in the message the encoded `Frame` begins.
    frame_at: usize,
}

impl Encoded {
    /// The encoded `Frame` alone.
    pub fn frame(&self) -> Bytes {
        self.response.message().slice(self.frame_at..)
    }
}

impl Mirror {
    /// Takes over what happened since the last time.
    pub(super) fn apply(&mut self, batch: &mut Batch) {
        if batch.restarted {
            self.objects.clear();
            self.head = None;
            self.forget_key();
        }
        if let Some(content) = batch.content.take() {
            self.content = Some(content);
        }
        for object in &batch.changes {
            let slot = object.id.slot as usize;
            if slot >= self.objects.len() {
                self.objects.resize(slot + 1, None);
                self.is_since_key.resize(slot + 1, false);
            }
            self.objects[slot] = Some(*object);
            if !std::mem::replace(&mut self.is_since_key[slot], true) {
                self.since_key.push(object.id.slot);
            }
        }
        for id in &batch.removed {
            if let Some(place) = self.objects.get_mut(id.slot as usize)
                && place.is_some_and(|object| object.id == *id)
            {
                *place = None;
            }
            self.removed_since_key.push(*id);
        }
        if let Some(head) = batch.head.take() {
            self.head = Some(head);
        }
    }

    /// The newest tick; `None` before the first.
    pub(super) fn stamp(&self) -> Option<&v1::Stamp> {
        self.head.as_ref().map(|head| &head.stamp)
    }

    /// Whether the next frame must be a keyframe, given their interval.
    pub(super) fn is_key_due(&self, interval_ns: u64) -> bool {
        match (self.key, self.stamp()) {
            (Some(key), Some(stamp)) => stamp.wall_ns.saturating_sub(key.wall_ns) >= interval_ns,
            _ => true,
        }
    }

    /// Encodes everything; `None` before the first tick. Deltas build on it from now on.
    pub(super) fn keyframe(&mut self) -> Option<Encoded> {
        let stamp = self.stamp().copied()?;
        self.forget_key();
        self.key = Some(Key {
            tick: stamp.tick,
            wall_ns: stamp.wall_ns,
        });
        let mut message = self.begin(stamp.tick);
        let mut objects: Vec<&ObjectNow> = self.objects.iter().flatten().collect();
        objects.sort_unstable_by_key(|object| object.id.to_bits());
        for object in objects {
            push_object(&mut message, object);
        }
        Some(self.finish(message, stamp.tick))
    }

    /// Encodes what changed since the keyframe; `None` where there is no keyframe yet.
    pub(super) fn delta(&mut self) -> Option<Encoded> {
        let key = self.key?;
        let tick = self.stamp()?.tick;
        let mut message = self.begin(key.tick);
        let objects = &self.objects;
        let changed = |slot: &u32| objects.get(*slot as usize).and_then(Option::as_ref);
        self.since_key
            .sort_unstable_by_key(|slot| changed(slot).map(|object| object.id.to_bits()));
        for object in self.since_key.iter().filter_map(changed) {
            push_object(&mut message, object);
        }
        message
            .removed_ids
            .extend(self.removed_since_key.iter().map(|id| id.to_bits()));
        message.removed_ids.sort_unstable();
        message.removed_ids.dedup();
        Some(self.finish(message, tick))
    }

    /// The scene as it stands; `None` before there is one.
    pub(super) fn scene(&self) -> Option<SceneNow> {
        let content = self.content.as_ref()?;
        let pose = |(id, spec): &(ObjectId, Arc<tsukamu_world::scene::ObjectSpec>)| {
            let now = self.objects.get(id.slot as usize).copied().flatten();
            now.filter(|object| object.id == *id)
                .map_or(spec.pose, |object| object.pose)
        };
        let stamp = self.stamp().copied().unwrap_or_default();
        Some(SceneNow {
            stamp,
            poses: content.objects.iter().map(pose).collect(),
            hands: self
                .head
                .as_ref()
                .map_or_else(Vec::new, |head| head.hands.clone()),
            content: Arc::clone(content),
        })
    }

    /// What is in the world, as of the last time.
    pub(super) fn content(&self) -> Option<&Arc<Content>> {
        self.content.as_ref()
    }

    fn forget_key(&mut self) {
        self.key = None;
        self.since_key.clear();
        self.removed_since_key.clear();
        self.is_since_key.clear();
        self.is_since_key.resize(self.objects.len(), false);
    }

    /// The reused message with everything but objects.
    fn begin(&mut self, keyframe_tick: u64) -> v1::Frame {
        let mut message = std::mem::take(&mut self.message);
        message.object_ids.clear();
        message.positions.clear();
        message.rotations.clear();
        message.states.clear();
        message.holders.clear();
        message.removed_ids.clear();
        message.hands.clear();
        message.keyframe_tick = keyframe_tick;
        message.scene_version = self.content.as_ref().map_or(0, |content| content.version);
        if let Some(head) = &self.head {
            message.stamp = Some(head.stamp);
            message.hands.extend(
                head.hands
                    .iter()
                    .map(|hand| hand_frame(&hand.frame, hand.sample_age_s)),
            );
        }
        message
    }

    fn finish(&mut self, message: v1::Frame, tick: u64) -> Encoded {
        let length = message.encoded_len();
        let prefix = 1 + prost::length_delimiter_len(length);
        let response = WireMessage::build(&mut self.buffer, prefix + length, |buffer| {
            buffer.put_u8(FRAME_TAG);
            message
                .encode_length_delimited(buffer)
                .expect("the buffer grows");
        });
        self.message = message;
        Encoded {
            tick,
            response,
            frame_at: prefix,
        }
    }
}
