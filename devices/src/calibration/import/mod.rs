//! Calibration files of other programs. Text in, a calibration and what is doubtful about it out.
//!
//! None of these formats says for which firmware or wearer it is, and one of them is known from readers alone: look at the
//! angles in `Imported::sensors` before they are used.

/// A line per sensor through two points.
pub mod two_point;

/// Piecewise-linear YAML as the Shadow Robot company's glove node reads it.
pub mod shadow;

/// `.cal` of the VirtualHand device configuration utility.
pub mod virtual_hand;

use thiserror::Error;

use crate::calibration::scale::with_room;
use crate::glove::calibrate::{GloveCalibration, SensorCalibration};
use crate::glove::sensor::GloveSensor;

/// Counts at which an imported sensor is shown: the ends and the middle of 8 bits.
pub const SHOWN_COUNTS: [f64; 3] = [1.0, 128.0, 254.0];
/// Longest file, bytes; a real one has a few thousand.
const FILE_BYTES_MAX: usize = 1 << 20;

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// As our own.
    pub calibration: GloveCalibration,
    /// Each sensor, for people to look at.
    pub sensors: Vec<ImportedSensor>,
    /// What is doubtful, in words.
    pub notes: Vec<String>,
}

/// One sensor of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImportedSensor {
    /// The sensor.
    pub sensor: GloveSensor,
    /// Angles at [`SHOWN_COUNTS`], degrees, before any range.
    pub angles_deg: [f64; 3],
    /// How far the line is off what the file says at most, degrees; 0 where the file holds a line.
    pub error_deg: f64,
}

/// Why a file cannot be imported. Lines are counted from 1.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ImportFault {
    /// Too long for such a file.
    #[error("has {0} bytes: no such file has more than a megabyte")]
    TooLong(usize),
    /// Too few lines.
    #[error("has {found} lines where {wanted} are needed")]
    TooShort {
        /// Lines found.
        found: usize,
        /// Lines needed.
        wanted: usize,
    },
    /// A value is missing, or is no number.
    #[error("line {line}: {wanted} is missing or no number")]
    NoNumber {
        /// The line.
        line: usize,
        /// What should be there.
        wanted: &'static str,
    },
    /// A sensor has no line: gain 0, or two equal raw values.
    #[error("line {line}: {sensor:?} has no slope")]
    NoSlope {
        /// The line.
        line: usize,
        /// The sensor.
        sensor: GloveSensor,
    },
    /// Nothing in it.
    #[error("names no sensor that is known, such as G_IndexMPJ")]
    NoSensor,
}

/// Reads a file of that format.
///
/// # Errors
/// See [`ImportFault`].
pub fn import(format: ImportFormat, text: &str) -> Result<Imported, ImportFault> {
    if text.len() > FILE_BYTES_MAX {
        return Err(ImportFault::TooLong(text.len()));
    }
    match format {
        ImportFormat::VirtualHand => virtual_hand::read(text),
        ImportFormat::Shadow => shadow::read(text),
        ImportFormat::TwoPoint => two_point::read(text),
    }
}

/// A format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImportFormat {
    /// See [`virtual_hand`].
    VirtualHand,
    /// See [`shadow`].
    Shadow,
    /// See [`two_point`].
    TwoPoint,
}

impl Imported {
    fn new() -> Self {
        Self {
            calibration: GloveCalibration::default(),
            sensors: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Takes angle = gain · (raw − `raw_at_zero`), in degrees, with a range of our own; false where there is no slope.
    fn add(
        &mut self,
        sensor: GloveSensor,
        raw_at_zero: f64,
        gain_deg: f64,
        error_deg: f64,
    ) -> bool {
        if !(raw_at_zero.is_finite() && gain_deg.is_finite() && gain_deg != 0.0) {
            return false;
        }
        let line = SensorCalibration {
            raw_at_zero,
            gain_deg_per_count: gain_deg,
            ..SensorCalibration::default_of(sensor)
        };
        self.calibration
            .sensors
            .insert(sensor, with_room(line, sensor));
        self.sensors.push(ImportedSensor {
            sensor,
            angles_deg: SHOWN_COUNTS.map(|raw| gain_deg * (raw - raw_at_zero)),
            error_deg,
        });
        self.sensors.sort_by_key(|imported| imported.sensor);
        true
    }
}
