//! From datagrams to hands.

use std::borrow::Cow;
use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::Deserialize;

use super::lz4;
use super::settings::RokokoSettings;
use super::skeleton::HandJoints;
use crate::glove::calibrate::{Handedness, SensorCalibration};
use crate::glove::sensor::GloveSensor;
use crate::session::DeviceInfo;
use crate::source::links::degrees_as_they_are;
use crate::source::session::{Decoder, FoundHand};
use crate::source::unity::position_from_unity;

/// Its name in messages.
const FAMILY: &str = "Rokoko";
/// One tick of the device's counter, ns; the sender's time is in seconds.
const TICK_NS: f64 = 1000.0;
/// Ticks in a second.
const TICKS_PER_S: f64 = 1.0e6;
/// Sensors that the joints of a hand stand for: four of the thumb, three of each finger, three between fingers.
const N_SENSORS: usize = 19;
/// Names of a finger's joints; the second is also known by another.
const JOINTS: [&str; 4] = ["Proximal", "Medial", "Distal", "Tip"];
const SECOND_JOINT_ALSO: &str = "Intermediate";
/// Names of the fingers.
const FINGERS: [&str; 5] = ["Thumb", "Index", "Middle", "Ring", "Little"];

#[derive(Debug, Deserialize)]
struct Frame<'a> {
    #[serde(borrow)]
    scene: Scene<'a>,
}

#[derive(Debug, Deserialize)]
struct Scene<'a> {
    timestamp: Option<f64>,
    #[serde(borrow, default)]
    actors: Vec<Actor<'a>>,
}

#[derive(Debug, Deserialize)]
struct Actor<'a> {
    #[serde(borrow, default)]
    name: Cow<'a, str>,
    #[serde(default)]
    meta: Meta,
    #[serde(borrow, default)]
    body: BTreeMap<Cow<'a, str>, Joint>,
}

/// What an actor wears; what is not said is taken to be there.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Meta {
    has_left_glove: Option<bool>,
    has_right_glove: Option<bool>,
}

#[derive(Debug, Deserialize)]
struct Joint {
    position: Option<Xyz>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
struct Xyz {
    x: f64,
    y: f64,
    z: f64,
}

impl Actor<'_> {
    fn place(&self, name: &str) -> Option<Vector3<f64>> {
        let Xyz { x, y, z } = self.body.get(name)?.position?;
        position_from_unity([x, y, z])
    }

    fn joints(&self, hand: Handedness) -> HandJoints {
        let side = match hand {
            Handedness::Left => "left",
            Handedness::Right => "right",
        };
        let joint = |finger: &str, index: usize| {
            let named = |joint: &str| self.place(&format!("{side}{finger}{joint}"));
            named(JOINTS[index]).or_else(|| (index == 1).then(|| named(SECOND_JOINT_ALSO))?)
        };
        HandJoints {
            hand: self.place(&format!("{side}Hand")),
            fingers: FINGERS.map(|finger| [0, 1, 2, 3].map(|index| joint(finger, index))),
        }
    }

    fn hand(
        &self,
        hand: Handedness,
        stamp_ns: u64,
        device_ticks: Option<u64>,
    ) -> Option<FoundHand> {
        let wears = match hand {
            Handedness::Left => self.meta.has_left_glove,
            Handedness::Right => self.meta.has_right_glove,
        };
        let joints = self.joints(hand);
        let world_from_wrist = joints.wrist(hand)?;
        let links = joints.links(&world_from_wrist);
        Some(FoundHand {
            hand,
            stamp_ns,
            // A body without gloves has fingers too, and they do not move.
            raw: (wears != Some(false) && !links.is_empty()).then(|| links.degrees(hand)),
            world_from_wrist: Some(world_from_wrist),
            device_ticks,
        })
    }
}

/// The decoder of Rokoko's streams.
#[derive(Debug)]
pub(crate) struct Rokoko {
    settings: RokokoSettings,
    /// Name of the actor whose hands are taken, and whether the sender says the time.
    about: Option<(String, bool)>,
    is_news: bool,
}

impl Rokoko {
    /// A decoder that has seen nothing.
    pub(crate) fn new(settings: &RokokoSettings) -> Self {
        Self {
            settings: settings.clone(),
            about: None,
            is_news: false,
        }
    }

    fn take_json(
        &mut self,
        stamp_ns: u64,
        json: &[u8],
        found: &mut Vec<FoundHand>,
    ) -> Result<(), String> {
        let frame: Frame<'_> =
            serde_json::from_slice(json).map_err(|fault| format!("JSON: {fault}"))?;
        let ticks = frame.scene.timestamp.and_then(ticks_from_seconds);
        for actor in &frame.scene.actors {
            let is_wanted = self.settings.actor.as_ref();
            if is_wanted.is_some_and(|wanted| *wanted != actor.name) {
                continue;
            }
            let hands = [Handedness::Left, Handedness::Right];
            let hand = |hand| actor.hand(hand, stamp_ns, ticks);
            found.extend(hands.into_iter().filter_map(hand));
            if !found.is_empty() {
                self.note(&actor.name, ticks.is_some());
                return Ok(());
            }
        }
        Ok(())
    }

    fn note(&mut self, actor: &str, has_time: bool) {
        let is_known = self
            .about
            .as_ref()
            .is_some_and(|(name, time)| name == actor && *time == has_time);
        if !is_known {
            self.about = Some((actor.to_owned(), has_time));
            self.is_news = true;
        }
    }
}

impl Decoder for Rokoko {
    fn family(&self) -> &'static str {
        FAMILY
    }

    fn default_of(&self, _sensor: GloveSensor) -> SensorCalibration {
        degrees_as_they_are()
    }

    fn take(
        &mut self,
        stamp_ns: u64,
        datagram: &[u8],
        found: &mut Vec<FoundHand>,
    ) -> Result<(), String> {
        if lz4::is_frame(datagram) {
            let json = lz4::frame(datagram).ok_or("a broken LZ4 frame")?;
            return self.take_json(stamp_ns, &json, found);
        }
        if datagram.trim_ascii_start().starts_with(b"{") {
            return self.take_json(stamp_ns, datagram, found);
        }
        match lz4::block(datagram) {
            Some(json) if json.trim_ascii_start().starts_with(b"{") => {
                self.take_json(stamp_ns, &json, found)
            }
            _ => Err("neither JSON nor LZ4; choose JSON v3 in the sender".to_owned()),
        }
    }

    fn news(&mut self) -> Option<DeviceInfo> {
        let (actor, has_time) = self.about.as_ref()?;
        std::mem::take(&mut self.is_news).then(|| DeviceInfo {
            family: FAMILY,
            firmware: String::new(),
            identity: format!("actor {actor:?}"),
            n_sensors: N_SENSORS,
            hand: None,
            tick_ns: has_time.then_some(TICK_NS),
            rate_hz: None,
        })
    }

    fn forget(&mut self) {
        self.about = None;
        self.is_news = false;
    }
}

fn ticks_from_seconds(time_s: f64) -> Option<u64> {
    (0.0..1.0e11)
        .contains(&time_s)
        .then(|| (time_s * TICKS_PER_S).round() as u64)
}
