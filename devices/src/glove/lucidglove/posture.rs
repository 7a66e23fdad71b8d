//! The newest numbers of a glove, and which sensors they stand for.

use crate::glove::lucidglove::decode::Sample;
use crate::glove::lucidglove::protocol::{
    AXIS_STICK_X, AXIS_TRIGGER, Encoding, N_FINGERS, N_JOINTS,
};
use crate::glove::sensor::GloveSensor;
use crate::reading::Controls;

/// Sensors of the thumb by joint from the base.
const THUMB: [Option<GloveSensor>; N_JOINTS] = [
    Some(GloveSensor::ThumbRotation),
    Some(GloveSensor::ThumbMcp),
    Some(GloveSensor::ThumbIp),
    None,
];
/// Sensors of the other fingers by joint from the base; the metacarpal has none.
const FINGERS: [[Option<GloveSensor>; N_JOINTS]; 4] = [
    [
        None,
        Some(GloveSensor::IndexMcp),
        Some(GloveSensor::IndexPip),
        Some(GloveSensor::IndexDip),
    ],
    [
        None,
        Some(GloveSensor::MiddleMcp),
        Some(GloveSensor::MiddlePip),
        Some(GloveSensor::MiddleDip),
    ],
    [
        None,
        Some(GloveSensor::RingMcp),
        Some(GloveSensor::RingPip),
        Some(GloveSensor::RingDip),
    ],
    [
        None,
        Some(GloveSensor::LittleMcp),
        Some(GloveSensor::LittlePip),
        Some(GloveSensor::LittleDip),
    ],
];
/// Abductions between neighbours, and the fingers whose splays make them.
const BETWEEN: [(GloveSensor, usize, usize); 3] = [
    (GloveSensor::MiddleIndexAbduction, 1, 2),
    (GloveSensor::RingMiddleAbduction, 2, 3),
    (GloveSensor::LittleRingAbduction, 3, 4),
];

/// The sensors of a finger by joint from the base.
pub(crate) const fn sensors_of(finger: usize) -> [Option<GloveSensor>; N_JOINTS] {
    match finger {
        0 => THUMB,
        finger => FINGERS[finger - 1],
    }
}

/// Which numbers a line has. Splay, stick and trigger are no part of it: firmware cuts off the one and leaves out the
/// others while they rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shape {
    encoding: Encoding,
    curls: [bool; N_FINGERS],
    joints: [[bool; N_JOINTS]; N_FINGERS],
}

impl Shape {
    pub(super) fn of(sample: &Sample) -> Self {
        Self {
            encoding: sample.encoding,
            curls: sample.curls.map(|curl| curl.is_some()),
            joints: sample
                .joints
                .map(|joints| joints.map(|joint| joint.is_some())),
        }
    }
}

/// The newest number of everything: what a line leaves out stays as it was.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Posture {
    newest: Sample,
    has_stick: bool,
    has_trigger: bool,
}

impl Posture {
    pub(super) fn take(&mut self, sample: &Sample) {
        let before = self.newest;
        self.newest = *sample;
        for (curl, before) in self.newest.curls.iter_mut().zip(before.curls) {
            *curl = curl.or(before);
        }
        for (splay, before) in self.newest.splays.iter_mut().zip(before.splays) {
            *splay = splay.or(before);
        }
        self.has_stick |= sample.stick.iter().any(Option::is_some);
        self.has_trigger |= sample.trigger.is_some();
    }

    pub(super) const fn encoding(&self) -> Encoding {
        self.newest.encoding
    }

    /// Counts by wire slot. A joint without a number of its own has its finger's curl. An abduction between two fingers
    /// is half of the greatest number where both point the same way; a thumb without splay stands in the middle.
    pub(super) fn raw(&self, max: u16) -> [Option<f64>; GloveSensor::N_SLOTS] {
        let mut raw = [None; GloveSensor::N_SLOTS];
        let sample = &self.newest;
        for finger in 0..N_FINGERS {
            let joints = sensors_of(finger).into_iter().zip(sample.joints[finger]);
            for (sensor, own) in joints {
                if let Some(sensor) = sensor {
                    raw[sensor.slot()] = own.or(sample.curls[finger]).map(f64::from);
                }
            }
        }
        let middle = 0.5 * f64::from(max);
        let splay = |finger: usize| sample.splays[finger].map(f64::from);
        for (sensor, first, second) in BETWEEN {
            let (first, second) = (splay(first), splay(second));
            let is_there = first.is_some() || second.is_some();
            let swing = first.unwrap_or(middle) - second.unwrap_or(middle);
            raw[sensor.slot()] = is_there.then_some(0.5 * swing + middle);
        }
        raw[GloveSensor::ThumbAbduction.slot()] =
            sample.curls[0].map(|_| splay(0).unwrap_or(middle));
        raw
    }

    /// How many sensors the glove itself has.
    pub(super) fn n_sensors(&self) -> usize {
        let sample = &self.newest;
        let joints = sample.joints.iter().flatten().flatten().count();
        let splays = sample.splays.iter().flatten().count();
        sample.curls.iter().flatten().count() + joints + splays
    }

    /// Buttons, stick and trigger. A stick that was seen once and is left out rests.
    pub(super) fn controls(&self, max: u16) -> Controls {
        let sample = &self.newest;
        let mut axes = [None; 4];
        let max = f64::from(max);
        if self.has_stick {
            for (axis, value) in axes[AXIS_STICK_X..].iter_mut().zip(sample.stick) {
                let value = value.map_or(0.0, |value| 2.0 * f64::from(value) / max - 1.0);
                *axis = Some(value.min(1.0));
            }
        }
        if self.has_trigger {
            let value = sample.trigger.map_or(0.0, |value| f64::from(value) / max);
            axes[AXIS_TRIGGER] = Some(value.min(1.0));
        }
        Controls {
            buttons: sample.buttons,
            axes,
        }
    }
}
