//! The thread between tick and subscribers: names events, encodes frames, hands both on.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use tokio::sync::watch;
use tsukamu_proto::v1;

use crate::convert::event::{Names, device_event, event};
use crate::event_log::EventWriter;
use crate::metrics::Metrics;
use crate::recorder_handle::{RecordItem, RecorderHandle};
use crate::wire_message::WireMessage;

use super::inbox::{Batch, EventEntry, Inbox, What};
use super::mirror::{Encoded, Mirror};

/// What every subscriber reads: the newest frame, with the keyframe that it builds on.
#[derive(Clone, Debug, Default)]
pub struct Published {
    /// Counts published frames; 0 before the first.
    pub count: u64,
    /// Number of the tick it shows, over all epochs.
    pub serial: u64,
    /// Session epoch.
    pub epoch: u64,
    /// When the step was done, nanoseconds since the Unix epoch.
    pub wall_ns: u64,
    /// World time and tick of the newest frame.
    pub stamp: v1::Stamp,
    /// The keyframe.
    pub key: Option<Encoded>,
    /// The newest frame, when it is not the keyframe itself.
    pub delta: Option<Encoded>,
}

/// What the publisher's thread owns.
#[derive(Debug)]
pub struct Publisher {
    /// Where it gets its work.
    pub inbox: Arc<Inbox>,
    /// Where frames go.
    pub frames: watch::Sender<Published>,
    /// Where events go.
    pub events: EventWriter,
    /// Counters and the number of subscribers.
    pub metrics: Arc<Metrics>,
    /// Time between keyframes, nanoseconds.
    pub key_interval_ns: u64,
}

impl Publisher {
    /// Works until the inbox says stop. Dropping the senders then ends every stream.
    pub fn run(self) {
        let mut mirror = Mirror::default();
        let mut recorder: Option<RecorderHandle> = None;
        let mut spare = Batch::default();
        loop {
            let mut batch = self.inbox.take(spare);
            let has_news = batch.head.is_some();
            let change = batch.recorder.take();
            let n_before = change.as_ref().map_or(0, |(n_before, _)| *n_before);
            let (before, after) = batch.events.split_at(n_before);
            self.log_events(before, &mirror, recorder.as_ref());
            // A recording that ends gets the newest frame still, one that begins gets it already.
            let mut frame_recorder = recorder.clone();
            if let Some((_, change)) = change {
                frame_recorder = change.clone().or(frame_recorder);
                recorder = change;
            }
            self.log_events(after, &mirror, recorder.as_ref());
            mirror.apply(&mut batch);
            if has_news || batch.wanted {
                self.publish(&mut mirror, batch.serial, frame_recorder.as_ref());
            }
            for request in batch.scene_requests.drain(..) {
                if let Some(scene) = mirror.scene() {
                    // Whoever asked may be gone.
                    let _ = request.send(scene);
                }
            }
            if batch.stopped {
                return;
            }
            spare = batch.cleared();
        }
    }

    /// Encodes the newest tick and hands it on, if anyone wants it and does not have it.
    fn publish(&self, mirror: &mut Mirror, serial: u64, recorder: Option<&RecorderHandle>) {
        let recorder = recorder.filter(|recorder| recorder.options().frames);
        let n_listeners = self.metrics.frame_subscribers.load(Ordering::Acquire);
        let Some(stamp) = mirror.stamp().copied() else {
            return;
        };
        let last = self.frames.borrow();
        let count = last.count;
        let is_known = count > 0 && last.serial == serial;
        let old_key = last.key.clone();
        drop(last);
        if is_known || (n_listeners == 0 && recorder.is_none()) {
            return;
        }
        let (key, delta) = if mirror.is_key_due(self.key_interval_ns) {
            (mirror.keyframe(), None)
        } else {
            (old_key, mirror.delta())
        };
        let Some(newest) = delta.as_ref().or(key.as_ref()) else {
            return;
        };
        if let Some(recorder) = recorder {
            recorder.offer(stamp.wall_ns, RecordItem::Frame(newest.frame()));
        }
        self.metrics.frames_encoded.inc();
        self.metrics
            .frame_bytes_encoded
            .inc_by(newest.response.message_len() as u64);
        self.frames.send_replace(Published {
            count: count + 1,
            serial,
            epoch: stamp.epoch,
            wall_ns: stamp.wall_ns,
            stamp,
            key,
            delta,
        });
    }

    fn log_events(
        &self,
        entries: &[EventEntry],
        mirror: &Mirror,
        recorder: Option<&RecorderHandle>,
    ) {
        if entries.is_empty() {
            return;
        }
        let first = self.events.next_sequence();
        let encoded: Vec<WireMessage> = entries
            .iter()
            .zip(first..)
            .map(|(entry, sequence)| encode_event(entry, sequence, mirror))
            .collect();
        if let Some(recorder) = recorder {
            for (entry, event) in entries.iter().zip(&encoded) {
                recorder.offer(entry.stamp.wall_ns, RecordItem::Event(event.message()));
            }
        }
        self.metrics.events.inc_by(encoded.len() as u64);
        self.events.append(encoded.into_iter());
    }
}

fn encode_event(entry: &EventEntry, sequence: u64, mirror: &Mirror) -> WireMessage {
    let content = entry.content.as_deref();
    let mut message = match &entry.what {
        What::World(happened) => {
            let names = Names {
                hands: content.map_or(&[], |content| &content.hands),
                targets: content.map_or(&[], |content| &content.targets),
            };
            // An object that is gone still stands in the content that the publisher had before.
            let former = || {
                let objects = &mirror.content()?.objects;
                let place = objects
                    .binary_search_by_key(&happened.object?, |(id, _)| *id)
                    .ok()?;
                Some(objects[place].1.name.as_str())
            };
            let name = entry
                .object
                .as_ref()
                .map(|spec| spec.name.as_str())
                .or_else(former);
            event(happened, name.unwrap_or_default(), names)
        }
        What::SceneLoaded => v1::Event {
            kind: Some(v1::event::Kind::SceneLoaded(v1::SceneLoaded {
                name: content.map_or_else(String::new, |content| content.surroundings.name.clone()),
            })),
            ..v1::Event::default()
        },
        What::Device(news) => device_event(news),
    };
    message.stamp = Some(entry.stamp);
    message.sequence = sequence;
    WireMessage::new(&message)
}
