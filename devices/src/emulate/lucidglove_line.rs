//! Writes the lines of a LucidGlove.

use std::fmt::Write as _;

use crate::emulate::lucidglove::LucidGloveBuild;
use crate::glove::lucidglove::posture::sensors_of;
use crate::glove::lucidglove::protocol::{Encoding, FLAGS, LEGACY_FLAGS, N_FINGERS, N_JOINTS};
use crate::glove::sensor::GloveSensor;

/// How the fingers are bent, counts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FingersNow {
    curls: [u16; N_FINGERS],
    joints: [[u16; N_JOINTS]; N_FINGERS],
    splays: [u16; N_FINGERS],
}

/// Stick in counts, and buttons by the bits of the protocol.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ControlsNow {
    pub(crate) stick: [u16; 2],
    pub(crate) buttons: u32,
}

impl ControlsNow {
    pub(crate) const fn resting(max: u16) -> Self {
        Self {
            stick: [max / 2; 2],
            buttons: 0,
        }
    }
}

impl FingersNow {
    pub(crate) const fn straight(max: u16) -> Self {
        Self {
            curls: [0; N_FINGERS],
            joints: [[0; N_JOINTS]; N_FINGERS],
            splays: [max / 2; N_FINGERS],
        }
    }

    pub(crate) fn set_curls(&mut self, curls: [u16; N_FINGERS], max: u16) {
        self.curls = curls.map(|curl| curl.min(max));
        self.joints = self.curls.map(|curl| [curl; N_JOINTS]);
    }

    pub(crate) fn set_slots(&mut self, raw: &[u16; GloveSensor::N_SLOTS], max: u16) {
        let counts = |sensor: GloveSensor| raw[sensor.slot()].min(max);
        for finger in 0..N_FINGERS {
            let sensors = sensors_of(finger);
            let bent = sensors.into_iter().flatten().map(counts);
            let n_sensors = sensors.into_iter().flatten().count() as u32;
            let sum: u32 = bent.map(u32::from).sum();
            // The mean of numbers of 16 bits is one.
            self.curls[finger] = (sum / n_sensors) as u16;
            self.joints[finger] = sensors.map(|sensor| sensor.map_or(self.curls[finger], counts));
        }
        // An abduction between two fingers is half the difference of their splays above the middle; the middle
        // finger's own is the middle.
        let twice = |sensor: GloveSensor| 2 * i32::from(counts(sensor)) - i32::from(max);
        let bounded = |splay: i32| splay.clamp(0, i32::from(max)) as u16;
        let middle = i32::from(max / 2);
        let ring = middle - twice(GloveSensor::RingMiddleAbduction);
        self.splays = [
            counts(GloveSensor::ThumbAbduction),
            bounded(middle + twice(GloveSensor::MiddleIndexAbduction)),
            bounded(middle),
            bounded(ring),
            bounded(ring - twice(GloveSensor::LittleRingAbduction)),
        ];
    }
}

/// One sample without its line end.
pub(crate) fn sample_line(
    build: &LucidGloveBuild,
    fingers: &FingersNow,
    controls: &ControlsNow,
) -> String {
    match build.encoding {
        Encoding::Alpha => alpha(build, fingers, controls),
        Encoding::Legacy => legacy(fingers, controls),
    }
}

fn legacy(fingers: &FingersNow, controls: &ControlsNow) -> String {
    let values = fingers.curls.iter().chain(&controls.stick).copied();
    let flags = LEGACY_FLAGS.map(|bit| u16::from(controls.buttons & bit != 0));
    let fields: Vec<String> = values.chain(flags).map(|value| value.to_string()).collect();
    fields.join("&")
}

fn alpha(build: &LucidGloveBuild, fingers: &FingersNow, controls: &ControlsNow) -> String {
    let mut line = String::new();
    // Writing to a string cannot fail.
    for (index, letter) in ('A'..='E').enumerate() {
        let _ = write!(line, "{letter}{}", fingers.curls[index]);
        if build.joints {
            if build.splay {
                let _ = write!(line, "({letter}B){}", fingers.splays[index]);
            }
            for (joint, value) in ('A'..='D').zip(fingers.joints[index]) {
                let _ = write!(line, "({letter}A{joint}){value}");
            }
        }
    }
    let [x, y] = controls.stick;
    let half = build.max / 2;
    let trigger = 2 * u32::from(fingers.curls[1].saturating_sub(half));
    let _ = write!(line, "F{x}G{y}P{trigger}");
    for (letter, bit) in FLAGS {
        if controls.buttons & bit != 0 {
            line.push(char::from(letter));
        }
    }
    if build.splay && !build.joints {
        for (letter, splay) in ('A'..='E').zip(fingers.splays) {
            let _ = write!(line, "({letter}B){splay}");
        }
    }
    line
}
