//! From the bodies of VRPN messages to readings.

use std::collections::BTreeMap;

use nalgebra::{Point3, Quaternion, UnitQuaternion};

use super::body::{ButtonChange, PosQuat};
use super::settings::{ChannelUnit, MAX_SENSORS, VrpnSettings};
use crate::glove::calibrate::GloveCalibration;
use crate::glove::sensor::GloveSensor;
use crate::reading::{Controls, GloveReading, SensorReading, TrackerReading};

/// Buttons that fit into [`Controls`].
const N_BUTTONS: usize = 32;
/// How far a quaternion's length may be from 1; VRPN's own servers normalise.
const UNIT_TOLERANCE: f64 = 0.1;
/// A datagram that is older than the newest by more than this does not come late: the server's clock was set back.
const CLOCK_STEP_US: u64 = 1_000_000;

/// When a message was made and when it came.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival {
    /// Monotonic time at which it was read, ns.
    pub(super) stamp_ns: u64,
    /// The server's own time, microseconds since the Unix epoch.
    pub(super) unix_us: Option<u64>,
    /// Whether it came as a datagram: those may overtake each other.
    pub(super) is_datagram: bool,
}

#[derive(Debug, Default)]
struct Station {
    sequence: u64,
    newest_us: u64,
}

/// What is known of the device so far.
#[derive(Debug)]
pub(super) struct Readings {
    stations: BTreeMap<u16, Station>,
    raw: [Option<f64>; GloveSensor::N_SLOTS],
    has_channels: bool,
    /// Pressed buttons; `None` before the device has said anything about buttons.
    buttons: Option<u32>,
    glove_sequence: u64,
}

impl Readings {
    pub(super) const fn new() -> Self {
        Self {
            stations: BTreeMap::new(),
            raw: [None; GloveSensor::N_SLOTS],
            has_channels: false,
            buttons: None,
            glove_sequence: 0,
        }
    }

    /// Forgets what the device showed; sequences go on. The connection was lost.
    pub(super) fn forget(&mut self) {
        self.raw = [None; GloveSensor::N_SLOTS];
        self.has_channels = false;
        self.buttons = None;
        for station in self.stations.values_mut() {
            station.newest_us = 0;
        }
    }

    /// A pose; `None` for a sensor out of bounds, or one that newer datagrams have overtaken.
    pub(super) fn pose(
        &mut self,
        settings: &VrpnSettings,
        at: Arrival,
        pose: &PosQuat,
    ) -> Option<TrackerReading> {
        if !(0..MAX_SENSORS).contains(&pose.sensor) {
            return None;
        }
        let number = pose.sensor as u16 + 1;
        let station = self.stations.entry(number).or_default();
        let unix_us = at.unix_us.unwrap_or(0);
        let is_late = station
            .newest_us
            .checked_sub(unix_us)
            .is_some_and(|behind| behind > 0 && behind < CLOCK_STEP_US);
        if at.is_datagram && is_late {
            return None;
        }
        station.newest_us = unix_us;
        let sequence = station.sequence;
        station.sequence += 1;
        let position = pose.position.map(|value| value * settings.scale);
        let position = position
            .iter()
            .all(|value| value.is_finite())
            .then(|| Point3::from(position));
        let rotation = rotation(pose.rotation);
        Some(TrackerReading {
            stamp_ns: at.stamp_ns,
            sequence,
            station: number,
            space: settings.space,
            position,
            rotation,
            position_valid: position.is_some(),
            rotation_valid: rotation.is_some(),
            error: None,
            device_ticks: at.unix_us,
            stylus_pressed: self.buttons.map(|buttons| buttons & 1 != 0),
        })
    }

    /// The channels of an analog; `None` when none is mapped to a sensor.
    pub(super) fn channels(
        &mut self,
        settings: &VrpnSettings,
        calibration: &GloveCalibration,
        at: Arrival,
        values: &[f64],
    ) -> Option<GloveReading> {
        if !settings.is_glove() {
            return None;
        }
        self.raw = [None; GloveSensor::N_SLOTS];
        for (sensor, value) in settings.channels.iter().zip(values) {
            if let Some(sensor) = sensor {
                self.raw[sensor.slot()] = Some(*value).filter(|value| value.is_finite());
            }
        }
        self.has_channels = true;
        self.glove(settings, calibration, at)
    }

    /// One button.
    pub(super) fn button(&mut self, change: ButtonChange) {
        if let Ok(button) = usize::try_from(change.button)
            && button < N_BUTTONS
        {
            let others = self.buttons.unwrap_or(0) & !(1 << button);
            self.buttons = Some(others | u32::from(change.state != 0) << button);
        }
    }

    /// All buttons.
    pub(super) fn buttons(&mut self, states: &[i32]) {
        let pressed = states.iter().take(N_BUTTONS).enumerate();
        self.buttons = Some(pressed.fold(0, |buttons, (index, state)| {
            buttons | u32::from(*state != 0) << index
        }));
    }

    /// The glove as it is known; `None` while it has said nothing about its channels.
    pub(super) fn glove(
        &mut self,
        settings: &VrpnSettings,
        calibration: &GloveCalibration,
        at: Arrival,
    ) -> Option<GloveReading> {
        if !self.has_channels {
            return None;
        }
        let angle = |value: f64| SensorReading {
            raw: value,
            angle_rad: match settings.unit {
                ChannelUnit::Degrees => value.to_radians(),
                ChannelUnit::Radians | ChannelUnit::Raw => value,
            },
            clamped: false,
        };
        let sensors = match settings.unit {
            ChannelUnit::Raw => calibration.angles(&self.raw),
            ChannelUnit::Degrees | ChannelUnit::Radians => self.raw.map(|raw| raw.map(angle)),
        };
        let sequence = self.glove_sequence;
        self.glove_sequence += 1;
        Some(GloveReading {
            sensors,
            angles_valid: true,
            device_ticks: at.unix_us,
            controls: Controls {
                buttons: self.buttons.unwrap_or(0),
                ..Controls::NONE
            },
            ..GloveReading::empty(at.stamp_ns, sequence)
        })
    }
}

fn rotation([x, y, z, w]: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    let (rotation, length) = UnitQuaternion::new_and_get(Quaternion::new(w, x, y, z));
    // Not a number is not within the tolerance either.
    ((length - 1.0).abs() <= UNIT_TOLERANCE).then_some(rotation)
}
