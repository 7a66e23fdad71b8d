//! What a driver reports: one decoded report of one device, in SI units, with time and validity.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

use crate::glove::calibrate::Handedness;
use crate::glove::sensor::GloveSensor;
use crate::tracker::space::TrackerSpace;

/// One sensor of a glove at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorReading {
    /// The value as the glove sent it, in counts or whatever unit it uses, kept so that calibration can be redone later.
    pub raw: f64,
    /// Calibrated angle in rad; flexion and abduction are positive.
    pub angle_rad: f64,
    /// Whether the angle was outside the wearer's range and has been clamped to it.
    pub clamped: bool,
}

/// One sample of a glove.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GloveReading {
    /// Monotonic time in ns at which the last byte of the record was read; the sample itself is older by at least
    /// the record's transmission time.
    pub stamp_ns: u64,
    /// Counts the readings of this session from 0.
    pub sequence: u64,
    /// By wire slot, see [`GloveSensor::slot`]; `None` where the glove has no such sensor.
    pub sensors: [Option<SensorReading>; GloveSensor::N_SLOTS],
    /// Whether the angles may be used; false while the glove is not plugged into its box.
    pub angles_valid: bool,
    /// Whether the glove is plugged into its box; `None` when the device does not say.
    pub plugged_in: Option<bool>,
    /// The wrist switch; `None` when the device does not say.
    pub switch_on: Option<bool>,
    /// The device's own time counter, unwrapped by the driver so that it never goes back while the device runs on; its
    /// unit is [`DeviceInfo::tick_ns`](crate::session::DeviceInfo::tick_ns) where that is known. `None` when it is not sent.
    pub device_ticks: Option<u64>,
    /// Which hand the sample is of; `None` when the device says nothing, as a glove that is only ever worn on one.
    pub hand: Option<Handedness>,
    /// Buttons and sticks on the glove.
    pub controls: Controls,
    /// Condition letter that the device added to the sample, such as `g` (not plugged in) or `s` (sampling too fast).
    pub error: Option<char>,
}

impl GloveReading {
    /// A sample without sensors, for a device that only reports a condition.
    #[must_use]
    pub const fn empty(stamp_ns: u64, sequence: u64) -> Self {
        Self {
            stamp_ns,
            sequence,
            sensors: [None; GloveSensor::N_SLOTS],
            angles_valid: false,
            plugged_in: None,
            switch_on: None,
            device_ticks: None,
            hand: None,
            controls: Controls::NONE,
            error: None,
        }
    }

    /// The reading of one sensor, whether or not the angles are valid.
    #[must_use]
    pub fn sensor(&self, sensor: GloveSensor) -> Option<SensorReading> {
        self.sensors[sensor.slot()]
    }

    /// The angle of one sensor in rad; `None` when the glove lacks the sensor or the angles are not valid.
    #[must_use]
    pub fn angle_rad(&self, sensor: GloveSensor) -> Option<f64> {
        self.sensor(sensor)
            .filter(|_| self.angles_valid)
            .map(|reading| reading.angle_rad)
    }
}

/// Buttons, sticks and triggers on a glove.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Controls {
    /// Pressed buttons, one bit each; the driver says which bit is which.
    pub buttons: u32,
    /// Sticks (-1 to 1) and triggers (0 to 1); the driver says which is which, and `None` is one that is not there.
    pub axes: [Option<f64>; 4],
}

impl Controls {
    /// Nothing pressed, no axis.
    pub const NONE: Self = Self {
        buttons: 0,
        axes: [None; 4],
    };
}

/// One record of one tracker station.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackerReading {
    /// Monotonic time in ns at which the last byte of the record was read; the sample itself is older by at least
    /// the record's transmission time.
    pub stamp_ns: u64,
    /// Counts the readings of this station in this session from 0.
    pub sequence: u64,
    /// Station (receiver, bird, sensor), numbered from 1.
    pub station: u16,
    /// Which way the axes of position and rotation point.
    pub space: TrackerSpace,
    /// Position of the sensor in transmitter space, m; `None` when it was not sent or is not a number.
    pub position: Option<Point3<f64>>,
    /// Rotation that takes sensor coordinates to transmitter space; `None` when it was not sent or is not a rotation.
    pub rotation: Option<UnitQuaternion<f64>>,
    /// Whether the position may be used; false when the device flagged the record.
    pub position_valid: bool,
    /// Whether the rotation may be used; false when the device flagged the record.
    pub rotation_valid: bool,
    /// Error letter of the record, such as `j` (saturated) or `k` (out of range or unplugged); `None` when good.
    pub error: Option<char>,
    /// The device's own time counter, as in [`GloveReading::device_ticks`].
    pub device_ticks: Option<u64>,
    /// Stylus switch; `None` when it is not part of the record.
    pub stylus_pressed: Option<bool>,
}

impl TrackerReading {
    /// The sensor's pose in transmitter space (m); `None` unless position and rotation are both valid.
    #[must_use]
    pub fn transmitter_from_sensor(&self) -> Option<Isometry3<f64>> {
        let position = self.position.filter(|_| self.position_valid)?;
        let rotation = self.rotation.filter(|_| self.rotation_valid)?;
        Some(Isometry3::from_parts(
            Translation3::from(position.coords),
            rotation,
        ))
    }

    /// The sensor's pose in the y-up world that has its origin in the transmitter (m); `None` unless position and
    /// rotation are both valid. See [`TrackerSpace::to_world`].
    #[must_use]
    pub fn world_from_sensor(&self) -> Option<Isometry3<f64>> {
        self.transmitter_from_sensor()
            .map(|pose| self.space.to_world(&pose))
    }
}
