//! From datagrams to hands.

use nalgebra::{Isometry3, Translation3};

use super::bones::{ROOT, find};
use super::frame::SideFrame;
use super::osc::{Argument, Malformed, Message, visit_messages};
use crate::glove::calibrate::{Handedness, SensorCalibration};
use crate::glove::sensor::GloveSensor;
use crate::session::DeviceInfo;
use crate::source::links::degrees_as_they_are;
use crate::source::session::{Decoder, FoundHand};
use crate::source::unity::{position_from_unity, rotation_from_unity};

/// Its name in messages.
const FAMILY: &str = "VMC";
/// One tick of the device's counter, ns; the sender's time is in seconds.
const TICK_NS: f64 = 1000.0;
/// Ticks in a second.
const TICKS_PER_S: f64 = 1.0e6;
/// Sensors that the bones of a hand stand for: four of the thumb, three of each finger, three between fingers.
const N_SENSORS: usize = 19;

const HANDS: [Handedness; 2] = [Handedness::Left, Handedness::Right];

/// What the sender is found to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct About {
    seen: [bool; 2],
    placed: [bool; 2],
}

/// The decoder of VMC.
#[derive(Debug, Default)]
pub(crate) struct Vmc {
    sides: [SideFrame; 2],
    ticks: Option<u64>,
    /// When the present datagram was read, ns.
    now_ns: u64,
    about: About,
    told: Option<About>,
}

impl Vmc {
    fn take_message(
        &mut self,
        message: &Message<'_>,
        found: &mut Vec<FoundHand>,
    ) -> Result<(), Malformed> {
        match message.address {
            "/VMC/Ext/Bone/Pos" => {
                if let Some((name, pose)) = named_pose(message)?
                    && let Some((hand, slot)) = find(name)
                {
                    self.take_bone(hand, slot, pose, found);
                }
            }
            "/VMC/Ext/Root/Pos" => {
                if let Some((_, pose)) = named_pose(message)? {
                    self.take_bone(None, ROOT, pose, found);
                }
            }
            "/VMC/Ext/T" => {
                let time_s = message.arguments().next().transpose()?;
                let time_s = time_s.and_then(|time| time.number());
                self.ticks = time_s.and_then(ticks_from_seconds).or(self.ticks);
            }
            // Face, cameras, devices, and whatever the protocol is extended by.
            _ => {}
        }
        Ok(())
    }

    /// Takes a bone of one hand, or of what carries both.
    fn take_bone(
        &mut self,
        hand: Option<Handedness>,
        slot: usize,
        pose: Isometry3<f64>,
        found: &mut Vec<FoundHand>,
    ) {
        for (index, side) in HANDS.into_iter().enumerate() {
            if hand.is_some_and(|hand| hand != side) {
                continue;
            }
            if self.sides[index].ends_before(slot) {
                self.give_out(index, found);
            }
            if self.sides[index].take(self.now_ns, slot, pose) {
                self.give_out(index, found);
            }
        }
    }

    fn give_out(&mut self, index: usize, found: &mut Vec<FoundHand>) {
        let (frame, hand) = (&self.sides[index], HANDS[index]);
        let one = FoundHand {
            hand,
            stamp_ns: frame.stamp_ns(),
            raw: frame.degrees(hand),
            world_from_wrist: frame.wrist(hand),
            device_ticks: self.ticks,
        };
        if one.raw.is_none() && one.world_from_wrist.is_none() {
            return;
        }
        self.about.seen[index] = true;
        self.about.placed[index] = frame.is_placed();
        found.push(one);
    }
}

impl Decoder for Vmc {
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
        self.now_ns = stamp_ns;
        visit_messages(datagram, &mut |message| self.take_message(&message, found))
            .map_err(|malformed| malformed.text().to_owned())
    }

    fn news(&mut self) -> Option<DeviceInfo> {
        if self.told == Some(self.about) {
            return None;
        }
        self.told = Some(self.about);
        Some(DeviceInfo {
            family: FAMILY,
            firmware: String::new(),
            identity: self.about.text(),
            n_sensors: N_SENSORS,
            hand: match self.about.seen {
                [true, false] => Some(Handedness::Left),
                [false, true] => Some(Handedness::Right),
                _ => None,
            },
            tick_ns: self.ticks.map(|_| TICK_NS),
            rate_hz: None,
        })
    }

    fn forget(&mut self) {
        *self = Self::default();
    }
}

impl About {
    fn text(self) -> String {
        let parts = ["left", "right"]
            .into_iter()
            .zip(self.seen)
            .zip(self.placed);
        let parts = parts.filter_map(|((name, seen), placed)| {
            let place = if placed {
                "placed by the bones of its arm"
            } else {
                // The pose is that of the bones that did come.
                "not placed: bones of its arm, or their positions, are not sent"
            };
            seen.then(|| format!("{name} hand, {place}"))
        });
        parts.collect::<Vec<_>>().join("; ")
    }
}

/// The name, position and rotation of a message; `None` when it has no such arguments or they are no pose.
fn named_pose<'a>(message: &Message<'a>) -> Result<Option<(&'a str, Isometry3<f64>)>, Malformed> {
    let mut arguments = message.arguments();
    let Some(Argument::Text(name)) = arguments.next().transpose()? else {
        return Ok(None);
    };
    let mut numbers = [0.0; 7];
    for number in &mut numbers {
        let Some(value) = arguments
            .next()
            .transpose()?
            .and_then(|value| value.number())
        else {
            return Ok(None);
        };
        *number = value;
    }
    let [x, y, z, qx, qy, qz, qw] = numbers;
    let pose = position_from_unity([x, y, z])
        .zip(rotation_from_unity([qx, qy, qz, qw]))
        .map(|(position, rotation)| Isometry3::from_parts(Translation3::from(position), rotation));
    Ok(pose.map(|pose| (name, pose)))
}

/// The sender's time as ticks. It sends 32 bits, which hold a microsecond for 8 s after its start, 0.1 ms for a quarter of
/// an hour and 8 ms for a day.
fn ticks_from_seconds(time_s: f64) -> Option<u64> {
    (0.0..1.0e9)
        .contains(&time_s)
        .then(|| (time_s * TICKS_PER_S).round() as u64)
}
