//! One record: numbers of two 7-bit bytes, of which only the first has bit 7; then the buttons and, in a group, the
//! address.

use thiserror::Error;

use crate::tracker::dialect::TrackerRecord;
use crate::tracker::flock::protocol::{BUTTON_BITS, FULL_RANGE};
use crate::tracker::numbers::{from_euler, from_wxyz, position};
use crate::tracker::packed::{is_one_phase, number_from_pair};

/// How far the length of a sent quaternion may be from 1.
const QUATERNION_SLACK: f64 = 0.05;

/// What a record says of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Output {
    /// Position, and w, x, y, z.
    #[default]
    PositionQuaternion,
    /// Position, and the angles about z, y and x.
    PositionAngles,
}

impl Output {
    /// Numbers of a record.
    #[must_use]
    pub const fn n_numbers(self) -> usize {
        match self {
            Self::PositionQuaternion => 7,
            Self::PositionAngles => 6,
        }
    }
}

/// What the records of every bird look like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordFormat {
    /// The numbers.
    pub output: Output,
    /// Whether a byte of buttons follows.
    pub buttons: bool,
    /// Highest address of a group, whose records end with an address; `None` for one bird alone.
    pub n_units: Option<u8>,
    /// Position at full range, m.
    pub range_m: f64,
}

impl RecordFormat {
    /// Bytes of a record.
    #[must_use]
    pub const fn length(&self) -> usize {
        2 * self.output.n_numbers() + self.buttons as usize + self.n_units.is_some() as usize
    }
}

/// Why bytes are not a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum RecordFault {
    /// Not the length of the format.
    #[error("record has {found} bytes, not {expected}")]
    Length {
        /// Bytes found.
        found: usize,
        /// Bytes of the format.
        expected: usize,
    },
    /// Bit 7 is not on the first byte alone.
    #[error("bit 7 is not on the first byte alone")]
    Phase,
    /// The byte of buttons has bits that no buttons have.
    #[error("not a byte of buttons")]
    Buttons,
    /// The address is none of the group's.
    #[error("no such address in the group")]
    Address,
    /// The rotation is none.
    #[error("the rotation of the record makes no sense")]
    Rotation,
}

/// Decodes one record. A bird alone is station 1.
///
/// # Errors
/// A [`RecordFault`] that names the first check that failed.
pub fn decode_record(bytes: &[u8], format: &RecordFormat) -> Result<TrackerRecord, RecordFault> {
    let expected = format.length();
    if bytes.len() != expected {
        return Err(RecordFault::Length {
            found: bytes.len(),
            expected,
        });
    }
    if !is_one_phase(bytes) {
        return Err(RecordFault::Phase);
    }
    let station = match format.n_units {
        None => 1,
        Some(n_units) if (1..=n_units).contains(&bytes[expected - 1]) => bytes[expected - 1],
        Some(_) => return Err(RecordFault::Address),
    };
    let buttons = format.buttons.then(|| bytes[2 * format.output.n_numbers()]);
    if buttons.is_some_and(|buttons| buttons & !BUTTON_BITS != 0) {
        return Err(RecordFault::Buttons);
    }
    let fraction = |index: usize| {
        let number = number_from_pair(bytes[2 * index], bytes[2 * index + 1]);
        f64::from(number) / FULL_RANGE
    };
    let metres = std::array::from_fn(|index| fraction(index) * format.range_m);
    let rotation = match format.output {
        Output::PositionQuaternion => from_wxyz(
            std::array::from_fn(|index| fraction(3 + index)),
            QUATERNION_SLACK,
        ),
        Output::PositionAngles => {
            from_euler(std::array::from_fn(|index| fraction(3 + index) * 180.0))
        }
    };
    Ok(TrackerRecord {
        station: station.into(),
        position: position(metres),
        rotation: Some(rotation.ok_or(RecordFault::Rotation)?),
        error: None,
        usable: true,
        ticks: None,
        pressed: buttons.map(|buttons| buttons != 0),
    })
}
