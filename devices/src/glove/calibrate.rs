//! The map from raw sensor counts to joint angles for one wearer, and the tracker's place on the hand.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::glove::sensor::GloveSensor;
use crate::reading::SensorReading;

/// Resolution of the glove in the 1998 paper (section 5.1): 8 bits at half a degree.
pub const DEFAULT_GAIN_DEG_PER_COUNT: f64 = 0.5;
/// Counts of a straight joint when nothing is known about the wearer; leaves -19.5 to 107 degrees.
pub const DEFAULT_FLEXION_RAW_AT_ZERO: f64 = 40.0;
/// Counts of fingers held together when nothing is known about the wearer.
pub const DEFAULT_ABDUCTION_RAW_AT_ZERO: f64 = 100.0;
/// Counts of a sensor that bends both ways (wrist, thumb rotation) in its middle.
pub const DEFAULT_CENTRED_RAW_AT_ZERO: f64 = 128.0;

/// Which hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Handedness {
    /// The left hand.
    Left,
    /// The right hand.
    Right,
}

/// A second sensor that bends with this one, as thumb rotation and thumb abduction do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coupling {
    /// The other sensor.
    pub sensor: GloveSensor,
    /// Degrees added per count of the other sensor above its own `raw_at_zero`.
    pub gain_deg_per_count: f64,
}

/// One sensor: `angle = gain · (raw − raw_at_zero)`, plus the coupling, clamped to the range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorCalibration {
    /// Counts at angle 0.
    pub raw_at_zero: f64,
    /// Degrees per count; negative when counts fall as the joint bends.
    pub gain_deg_per_count: f64,
    /// Least angle of this wearer, degrees.
    pub min_deg: f64,
    /// Greatest angle of this wearer, degrees.
    pub max_deg: f64,
    /// A second sensor that this angle depends on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coupling: Option<Coupling>,
}

impl SensorCalibration {
    /// The line through two points (counts, degrees), with the two angles as the range.
    /// `None` when both points have the same counts.
    #[must_use]
    pub fn from_two_points(first: (f64, f64), second: (f64, f64)) -> Option<Self> {
        let gain_deg_per_count = (second.1 - first.1) / (second.0 - first.0);
        (gain_deg_per_count.is_finite() && gain_deg_per_count != 0.0).then(|| Self {
            raw_at_zero: first.0 - first.1 / gain_deg_per_count,
            gain_deg_per_count,
            min_deg: first.1.min(second.1),
            max_deg: first.1.max(second.1),
            coupling: None,
        })
    }

    /// What is used for a sensor that the wearer's file does not name.
    #[must_use]
    pub const fn default_of(sensor: GloveSensor) -> Self {
        let (raw_at_zero, min_deg, max_deg) = match sensor {
            GloveSensor::ThumbRotation
            | GloveSensor::WristFlexion
            | GloveSensor::WristAbduction => (DEFAULT_CENTRED_RAW_AT_ZERO, -70.0, 70.0),
            GloveSensor::ThumbAbduction
            | GloveSensor::MiddleIndexAbduction
            | GloveSensor::RingMiddleAbduction
            | GloveSensor::LittleRingAbduction => (DEFAULT_ABDUCTION_RAW_AT_ZERO, -20.0, 77.0),
            _ => (DEFAULT_FLEXION_RAW_AT_ZERO, -20.0, 107.5),
        };
        Self {
            raw_at_zero,
            gain_deg_per_count: DEFAULT_GAIN_DEG_PER_COUNT,
            min_deg,
            max_deg,
            coupling: None,
        }
    }

    /// The angle in degrees before the coupling and the range.
    fn free_deg(&self, raw: f64) -> f64 {
        self.gain_deg_per_count * (raw - self.raw_at_zero)
    }
}

/// The tracker's sensor relative to the wrist.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MountOffset {
    /// Position of the tracker's sensor in wrist space, m.
    pub position_m: [f64; 3],
    /// Rotation that takes sensor coordinates to wrist space: x, y, z, w.
    pub rotation_xyzw: [f64; 4],
}

impl Default for MountOffset {
    /// The sensor sits in the wrist, with the wrist's axes.
    fn default() -> Self {
        Self {
            position_m: [0.0; 3],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        }
    }
}

impl MountOffset {
    /// The pose of the tracker's sensor in wrist space, m. The rotation is normalised; a zero one is the identity.
    #[must_use]
    pub fn wrist_from_sensor(&self) -> Isometry3<f64> {
        let [x, y, z, w] = self.rotation_xyzw;
        let rotation = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9)
            .unwrap_or_else(UnitQuaternion::identity);
        Isometry3::from_parts(Translation3::from(Vector3::from(self.position_m)), rotation)
    }
}

/// The calibration file of one wearer: plain values, so that any text format can carry it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct GloveCalibration {
    /// Who wears it; free text.
    pub wearer: String,
    /// Which hand it is for; `None` to believe the glove.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hand: Option<Handedness>,
    /// Sensors that the glove reports and does not have, or that are broken: their readings are left out.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    pub absent: BTreeSet<GloveSensor>,
    /// The tracker's sensor relative to the wrist.
    pub mount: MountOffset,
    /// The sensors; one that is missing has its [`SensorCalibration::default_of`].
    pub sensors: BTreeMap<GloveSensor, SensorCalibration>,
}

/// A mistake in a calibration.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CalibrationProblem {
    /// A number is infinite or not a number, or the gain is 0.
    #[error("sensor {sensor:?}: `{field}` is {value}; it has to be finite, and a gain not 0")]
    BadNumber {
        /// The sensor.
        sensor: GloveSensor,
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// The range is empty.
    #[error("sensor {sensor:?}: min_deg {min_deg} is not below max_deg {max_deg}")]
    EmptyRange {
        /// The sensor.
        sensor: GloveSensor,
        /// Its least angle, degrees.
        min_deg: f64,
        /// Its greatest angle, degrees.
        max_deg: f64,
    },
    /// The sensor is coupled to itself.
    #[error("sensor {sensor:?}: is coupled to itself")]
    SelfCoupling {
        /// The sensor.
        sensor: GloveSensor,
    },
    /// The mount offset has a number that is not finite, or a rotation that is not of unit length within 1 %.
    #[error(
        "mount: position has to be finite and rotation_xyzw a unit quaternion, not {rotation_xyzw:?}"
    )]
    BadMount {
        /// The rotation as given: x, y, z, w.
        rotation_xyzw: [f64; 4],
    },
}

impl GloveCalibration {
    /// Every mistake in the file; empty when it can be used.
    #[must_use]
    pub fn problems(&self) -> Vec<CalibrationProblem> {
        let mut problems = Vec::new();
        for (&sensor, calibration) in &self.sensors {
            sensor_problems(sensor, calibration, &mut problems);
        }
        let length = self
            .mount
            .rotation_xyzw
            .iter()
            .map(|part| part * part)
            .sum::<f64>()
            .sqrt();
        let finite = self.mount.position_m.iter().all(|part| part.is_finite());
        // Written so that a length that is not a number fails too.
        if !(finite && (0.99..=1.01).contains(&length)) {
            problems.push(CalibrationProblem::BadMount {
                rotation_xyzw: self.mount.rotation_xyzw,
            });
        }
        problems
    }

    /// The same, with every sensor that it does not name set to `default_of`: what a driver does once with the defaults of
    /// its own device, whose counts may run from 0 to 4095 or be degrees already.
    #[must_use]
    pub fn filled(mut self, default_of: impl Fn(GloveSensor) -> SensorCalibration) -> Self {
        for sensor in GloveSensor::ALL {
            self.sensors
                .entry(sensor)
                .or_insert_with(|| default_of(sensor));
        }
        self
    }

    /// The calibration of one sensor, the default where the file does not name it.
    #[must_use]
    pub fn sensor(&self, sensor: GloveSensor) -> SensorCalibration {
        self.sensors
            .get(&sensor)
            .copied()
            .unwrap_or_else(|| SensorCalibration::default_of(sensor))
    }

    /// Angles for raw counts by slot; a slot without a name or without counts, or of an absent sensor, stays `None`.
    #[must_use]
    pub fn angles(
        &self,
        raw: &[Option<f64>; GloveSensor::N_SLOTS],
    ) -> [Option<SensorReading>; GloveSensor::N_SLOTS] {
        let mut readings = [None; GloveSensor::N_SLOTS];
        for sensor in GloveSensor::ALL {
            if self.absent.contains(&sensor) {
                continue;
            }
            readings[sensor.slot()] = raw[sensor.slot()].map(|counts| {
                let calibration = self.sensor(sensor);
                let coupled_deg = calibration
                    .coupling
                    .map_or(0.0, |coupling| self.coupled_deg(coupling, raw));
                bounded_reading(&calibration, counts, coupled_deg)
            });
        }
        readings
    }

    /// The whole counts from `least` to `greatest` by slot at which the sensors read `angles_rad`, as near as counts can:
    /// the inverse of [`GloveCalibration::angles`], for emulators. A slot without an angle gets the counts of angle 0.
    #[must_use]
    pub fn counts(
        &self,
        angles_rad: &[Option<f64>; GloveSensor::N_SLOTS],
        least: u16,
        greatest: u16,
    ) -> [u16; GloveSensor::N_SLOTS] {
        // A coupling to a coupled sensor needs that one first; a few rounds settle any chain of weak ones.
        const ROUNDS: usize = 4;
        let mut counts = [least.midpoint(greatest); GloveSensor::N_SLOTS];
        for _ in 0..ROUNDS {
            let raw = counts.map(|value| Some(f64::from(value)));
            for sensor in GloveSensor::ALL {
                let calibration = self.sensor(sensor);
                let coupled_deg = calibration
                    .coupling
                    .map_or(0.0, |coupling| self.coupled_deg(coupling, &raw));
                let own_deg = angles_rad[sensor.slot()].unwrap_or(0.0).to_degrees() - coupled_deg;
                let value = calibration.raw_at_zero + own_deg / calibration.gain_deg_per_count;
                // `max` then `min`, for `clamp` keeps what is not a number and panics on bounds the wrong way round.
                let bounded = value.round().max(f64::from(least)).min(f64::from(greatest));
                counts[sensor.slot()] = bounded as u16;
            }
        }
        counts
    }

    /// What the other sensor adds, degrees; nothing when it is not there.
    fn coupled_deg(&self, coupling: Coupling, raw: &[Option<f64>; GloveSensor::N_SLOTS]) -> f64 {
        raw[coupling.sensor.slot()].map_or(0.0, |other| {
            let zero = self.sensor(coupling.sensor).raw_at_zero;
            coupling.gain_deg_per_count * (other - zero)
        })
    }
}

fn bounded_reading(calibration: &SensorCalibration, raw: f64, coupled_deg: f64) -> SensorReading {
    let free_deg = calibration.free_deg(raw) + coupled_deg;
    // `max` then `min` instead of `clamp`, which panics on a range that nobody validated.
    let angle_deg = free_deg.max(calibration.min_deg).min(calibration.max_deg);
    SensorReading {
        raw,
        angle_rad: angle_deg.to_radians(),
        clamped: (angle_deg - free_deg).abs() > 0.0,
    }
}

fn sensor_problems(
    sensor: GloveSensor,
    calibration: &SensorCalibration,
    problems: &mut Vec<CalibrationProblem>,
) {
    let coupling_gain = calibration
        .coupling
        .map_or(1.0, |coupling| coupling.gain_deg_per_count);
    let fields = [
        ("raw_at_zero", calibration.raw_at_zero, true),
        (
            "gain_deg_per_count",
            calibration.gain_deg_per_count,
            calibration.gain_deg_per_count != 0.0,
        ),
        ("min_deg", calibration.min_deg, true),
        ("max_deg", calibration.max_deg, true),
        ("coupling.gain_deg_per_count", coupling_gain, true),
    ];
    for (field, value, _) in fields
        .into_iter()
        .filter(|(_, value, good)| !(value.is_finite() && *good))
    {
        problems.push(CalibrationProblem::BadNumber {
            sensor,
            field,
            value,
        });
    }
    if calibration.min_deg >= calibration.max_deg {
        problems.push(CalibrationProblem::EmptyRange {
            sensor,
            min_deg: calibration.min_deg,
            max_deg: calibration.max_deg,
        });
    }
    if calibration
        .coupling
        .is_some_and(|coupling| coupling.sensor == sensor)
    {
        problems.push(CalibrationProblem::SelfCoupling { sensor });
    }
}
