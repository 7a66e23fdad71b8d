//! What leaves the world after a step: to the publisher, the recorder, and whoever waits.

use std::sync::Arc;

use tsukamu_proto::v1;
use tsukamu_world::frame::EventKind;
use tsukamu_world::hand::joint::N_FINGERS;
use tsukamu_world::hand::part::PartLayout;
use tsukamu_world::state::{Body, HandId, ObjectId};

use crate::broadcast::inbox::{Content, EventEntry, HandNow, Head, What};
use crate::clock::Clock;
use crate::convert::frame::ObjectNow;
use crate::convert::hand::hand_seen;
use crate::convert::input::step_input;
use crate::convert::scene::surroundings;
use crate::input::feedback::fingers_of;
use crate::input::intake::{DriveNow, Driver, Feed, StepTime};
use crate::input::sources::Arrived;
use crate::recorder_handle::{RecordItem, RecorderHandle};

use super::engine::{Engine, Waiting};

impl Engine {
    /// Posts what a step changed. Nothing is encoded here.
    pub(super) fn post_step(&mut self, now_ns: u64) {
        let frame = self.world.frame();
        let structural =
            |kind: &EventKind| matches!(kind, EventKind::ObjectAdded | EventKind::ObjectRemoved);
        if std::mem::take(&mut self.changed_content)
            || frame.events.iter().any(|event| structural(&event.kind))
        {
            self.content = Arc::new(self.content_now());
            let n_objects = self.content.objects.len() as u32;
            self.outlets.status.update(|status| {
                status.n_objects = n_objects;
                status.model = self.world.scene().model.name();
            });
        }
        self.post(now_ns, false);
    }

    /// Posts the world as it is: what changed, or, in a new epoch, everything.
    pub(super) fn post(&self, now_ns: u64, is_start: bool) {
        let (world, frame) = (&self.world, self.world.frame());
        let hands = frame.hands.iter().map(|hand| {
            let driver = self.driver_of(hand.hand);
            HandNow {
                frame: hand.clone(),
                sample_age_s: driver.map_or(0.0, |driver| driver.age_s(now_ns)),
                touching: self.touching(hand.hand),
            }
        });
        let head = Head {
            stamp: self.stamp,
            hands: hands.collect(),
        };
        let events = frame
            .events
            .iter()
            .filter(|_| !is_start)
            .map(|event| EventEntry {
                stamp: self.stamp,
                object: event
                    .object
                    .and_then(|id| world.object(id))
                    .map(|body| Arc::clone(&body.spec)),
                what: What::World(event.clone()),
                content: Some(Arc::clone(&self.content)),
            });
        let changed = frame
            .changed
            .iter()
            .filter_map(|id| Some(object_now(*id, world.object(*id)?)));
        self.outlets.inbox.post(|batch| {
            if is_start {
                batch.restart();
                batch.add_changes(
                    world.objects().map(|(id, body)| object_now(id, body)),
                    usize::MAX >> 8,
                );
                batch.events.push(EventEntry {
                    stamp: self.stamp,
                    what: What::SceneLoaded,
                    object: None,
                    content: Some(Arc::clone(&self.content)),
                });
            } else {
                batch.add_changes(changed, self.content.objects.len());
            }
            for entry in events {
                if let What::World(event) = &entry.what
                    && matches!(event.kind, EventKind::ObjectRemoved)
                {
                    batch.removed.extend(event.object);
                }
                batch.events.push(entry);
            }
            batch.content = Some(Arc::clone(&self.content));
            batch.head = Some(head);
            batch.serial = self.serial;
        });
    }

    /// Who drives a hand that is shown; nobody here drives those of a recording, though they may have the same ids.
    fn driver_of(&self, hand: HandId) -> Option<&Driver> {
        let mut drivers = self.drivers.iter().filter(|_| self.playback.is_none());
        drivers.find(|driver| driver.hand == hand)
    }

    /// Whether each finger of a hand touches anything: objects that rest are touched by none.
    fn touching(&self, hand: HandId) -> [bool; N_FINGERS] {
        let mut touching = [false; N_FINGERS];
        let Some(named) = self.hands.iter().find(|named| named.id == hand) else {
            return touching;
        };
        let (layout, state) = (PartLayout::of(&named.model), self.world.state());
        let bodies = state.awake.iter().filter_map(|slot| state.body(*slot));
        let touches = bodies.flat_map(|body| &body.touches);
        for touch in touches.filter(|touch| touch.hand == hand) {
            if let Some(finger) = layout.finger(touch.part) {
                touching[finger.index()] = true;
            }
        }
        touching
    }

    /// The world's content as it is now, with the next version.
    pub(super) fn content_now(&self) -> Content {
        let scene = self.world.scene();
        Content {
            epoch: self.stamp.epoch,
            version: self.content.version + 1,
            surroundings: surroundings(scene),
            grasp_angle: scene.grasp_angle,
            targets: scene.targets.clone(),
            objects: self
                .world
                .objects()
                .map(|(id, body)| (id, Arc::clone(&body.spec)))
                .collect(),
            hands: self.hands.clone(),
        }
    }

    /// Hands the step's input to the recording, and now and then the digest.
    pub(super) fn record_input(&self) {
        let Some(recorder) = &self.recorder else {
            return;
        };
        let (epoch, tick) = (self.stamp.epoch, self.stamp.tick);
        let message = step_input(epoch, tick, &self.input, |hand| self.hand_name(hand));
        recorder.offer(self.stamp.wall_ns, RecordItem::Input(message));
        // Once a second of world time, and at the very first step.
        let interval = (self.rate_hz().round() as u64).max(1);
        if tick == 1 || tick.is_multiple_of(interval) {
            self.record_digest();
        }
    }

    /// Hands the digest to the recording.
    pub(super) fn record_digest(&self) {
        let Some(recorder) = &self.recorder else {
            return;
        };
        let (epoch, tick) = (self.stamp.epoch, self.stamp.tick);
        let digest = v1::Digest {
            epoch,
            tick,
            digest: self.world.digest(),
        };
        recorder.offer(self.stamp.wall_ns, RecordItem::Digest(digest));
    }

    /// Tells the gloves and the clients that drive hands how these stand; newest wins.
    pub(super) fn answer_drivers(&mut self) {
        let now_ns = self.now_ns();
        for driver in &self.drivers {
            let feel = driver.source.feel();
            if feel.is_none() && !matches!(driver.feed, Feed::Remote { .. }) {
                continue;
            }
            self.touches.clear();
            // What the hands of a recording touch and hold is not for those who watch it.
            let is_live = self.playback.is_none();
            if is_live {
                self.world.contacts_of(driver.hand, &mut self.touches);
            }
            if let Some(feel) = feel {
                feel.tell(now_ns, fingers_of(&driver.model, &self.touches));
            }
            let Feed::Remote { answers } = &driver.feed else {
                continue;
            };
            let applied = driver.applied();
            let holds = self
                .world
                .frame()
                .hands
                .iter()
                .find(|hand| is_live && hand.hand == driver.hand);
            answers.send_replace(DriveNow {
                stamp: self.stamp,
                applied_source_ns: applied.map_or(0, |applied| applied.source_ns),
                applied_tick: applied.map_or(0, |applied| applied.tick),
                n_dropped: driver.source.n_dropped(),
                n_superseded: driver.source.n_superseded(),
                touches: self.touches.clone(),
                holds: holds.and_then(|hand| hand.holds),
            });
        }
    }

    /// Answers those whose commands this step carried out. Whoever is gone is gone.
    pub(super) fn answer_waiting(&mut self) {
        for waiting in self.waiting.drain(..) {
            match waiting {
                Waiting::Command(reply) => {
                    let _ = reply.send(Ok(self.stamp));
                }
                Waiting::Object(name, reply) => {
                    let found = self
                        .world
                        .objects()
                        .find(|(_, body)| body.spec.name == name);
                    let answer = found.map(|(id, _)| (self.stamp, id));
                    let refused = || {
                        super::request::Refusal::Object(format!(
                            "{name:?} was passed over by the world"
                        ))
                    };
                    let _ = reply.send(answer.ok_or_else(refused));
                }
            }
        }
    }
}

fn object_now(id: ObjectId, body: &Body) -> ObjectNow {
    ObjectNow {
        id,
        pose: body.pose,
        contact: body.contact,
        rests: body.is_resting(),
        holder: body.hold.and_then(|hold| hold.leader),
    }
}

/// Hands the samples that arrived since the last step to the recording; the last one is what the step took.
pub(super) fn record_samples(
    recorder: &RecorderHandle,
    driver: &Driver,
    arrived: &[Arrived],
    time: StepTime,
    clock: &Clock,
) {
    for (index, item) in arrived.iter().enumerate() {
        let message = v1::RawSample {
            source: driver.source.name.clone(),
            hand: driver.hand.0,
            source_ns: item.source_ns,
            arrival_ns: item.arrival_ns,
            applied_tick: if index + 1 == arrived.len() {
                time.tick
            } else {
                0
            },
            sample: Some(hand_seen(&item.seen, item.source_ns)),
            fitted_ns: item.fitted_ns,
            ticks: item.ticks,
        };
        recorder.offer(clock.wall_of(item.arrival_ns), RecordItem::Sample(message));
    }
}
