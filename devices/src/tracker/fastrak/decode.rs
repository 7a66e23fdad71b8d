//! One data record of a Fastrak, whose length and content follow from the list that was asked for.

use nalgebra::{Point3, UnitQuaternion};
use thiserror::Error;

use crate::tracker::fastrak::protocol::{
    DATA, GOOD, HEADER_LENGTH, METRES_PER_PACKED_RANGE, N_STATIONS,
};
use crate::tracker::numbers::{from_euler, from_wxyz, position};
use crate::tracker::packed::{is_one_phase, number_from_pair};
use crate::tracker::space::{METRES_PER_CENTIMETRE, METRES_PER_INCH};

/// How far the length of a sent quaternion may be from 1; the four decimals of ASCII give 1e-4.
const QUATERNION_SLACK: f64 = 0.02;

/// One item of an output list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Item {
    /// One space: the trailer of binary records.
    Space,
    /// CR LF: the trailer of ASCII records.
    CrLf,
    /// Position x, y, z.
    Position,
    /// Azimuth, elevation, roll in degrees.
    Euler,
    /// Quaternion w, x, y, z.
    Quaternion,
    /// Stylus switch: a space and a digit.
    Stylus,
    /// Position in the packed 16-bit form of older firmware; binary lists only.
    PackedPosition,
    /// Azimuth, elevation, roll in the packed form.
    PackedEuler,
    /// Quaternion in the packed form.
    PackedQuaternion,
}

impl Item {
    /// The number by which the item is asked for.
    #[must_use]
    pub const fn number(self) -> u8 {
        match self {
            Self::Space => 0,
            Self::CrLf => 1,
            Self::Position => 2,
            Self::Euler => 4,
            Self::Quaternion => 11,
            Self::Stylus => 16,
            Self::PackedPosition => 18,
            Self::PackedEuler => 19,
            Self::PackedQuaternion => 20,
        }
    }

    /// The item of a number; `None` for those that this driver does not read.
    #[must_use]
    pub const fn from_number(number: u8) -> Option<Self> {
        Some(match number {
            0 => Self::Space,
            1 => Self::CrLf,
            2 => Self::Position,
            4 => Self::Euler,
            11 => Self::Quaternion,
            16 => Self::Stylus,
            18 => Self::PackedPosition,
            19 => Self::PackedEuler,
            20 => Self::PackedQuaternion,
            _ => return None,
        })
    }

    /// Bytes of the item.
    #[must_use]
    pub const fn length(self, encoding: Encoding) -> usize {
        match (self, encoding) {
            (Self::Space, _) => 1,
            (Self::CrLf | Self::Stylus, _) => 2,
            (Self::Position | Self::Euler, Encoding::Ascii) => 21,
            (Self::Quaternion, Encoding::Ascii) => 28,
            (Self::Position | Self::Euler, Encoding::Binary) => 12,
            (Self::Quaternion, Encoding::Binary) => 16,
            (Self::PackedPosition | Self::PackedEuler, _) => 6,
            (Self::PackedQuaternion, _) => 8,
        }
    }
}

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Encoding {
    /// Seven characters for each number.
    Ascii,
    /// IEEE 754 single precision, least significant byte first.
    #[default]
    Binary,
}

/// In what positions are sent; the packed form is in centimetres always.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LengthUnit {
    /// Inches.
    Inches,
    /// Centimetres.
    Centimetres,
}

impl LengthUnit {
    /// Metres in one of the unit.
    #[must_use]
    pub const fn metres(self) -> f64 {
        match self {
            Self::Inches => METRES_PER_INCH,
            Self::Centimetres => METRES_PER_CENTIMETRE,
        }
    }
}

/// What the records of every station look like.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordFormat {
    /// The items in the order of the list; the last is the trailer.
    pub items: Vec<Item>,
    /// How numbers are written.
    pub encoding: Encoding,
    /// In what positions are sent.
    pub unit: LengthUnit,
}

impl RecordFormat {
    /// Length of a record in bytes.
    #[must_use]
    pub fn length(&self) -> usize {
        let items = self.items.iter().map(|item| item.length(self.encoding));
        HEADER_LENGTH + items.sum::<usize>()
    }
}

/// One decoded record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Station, 1 to 4.
    pub station: u8,
    /// Error letter; `None` when good.
    pub error: Option<u8>,
    /// Position in transmitter space, m.
    pub position: Option<Point3<f64>>,
    /// Rotation from sensor coordinates to transmitter space.
    pub rotation: Option<UnitQuaternion<f64>>,
    /// Stylus switch.
    pub stylus_pressed: Option<bool>,
}

/// Why bytes are not a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum RecordFault {
    /// The first three bytes are not `0`, a station, and an error letter or a space.
    #[error("not the header of a record")]
    Header,
    /// Not the length of the list.
    #[error("record has {found} bytes, not {expected}")]
    Length {
        /// Bytes found.
        found: usize,
        /// Bytes of the list.
        expected: usize,
    },
    /// A constant part (trailer, stylus' space, phase bit) is not what it has to be.
    #[error("a constant part of the record is wrong")]
    Constant,
    /// A number is no number, or is beyond what a unit sends, in a record that claims to be good.
    #[error("a number of the record makes no sense")]
    Number,
}

/// Whether bytes can be the beginning of a data record; shorter ones can if what is there fits.
#[must_use]
pub fn is_header(bytes: &[u8]) -> bool {
    let station = |byte: &u8| (b'1'..b'1' + N_STATIONS as u8).contains(byte);
    let error = |byte: &u8| *byte == GOOD || byte.is_ascii_alphabetic();
    bytes.first().is_none_or(|byte| *byte == DATA)
        && bytes.get(1).is_none_or(station)
        && bytes.get(2).is_none_or(error)
}

/// Decodes one record.
///
/// # Errors
/// A [`RecordFault`] that names the first check that failed.
pub fn decode_record(bytes: &[u8], format: &RecordFormat) -> Result<Sample, RecordFault> {
    let expected = format.length();
    if bytes.len() != expected {
        return Err(RecordFault::Length {
            found: bytes.len(),
            expected,
        });
    }
    if !is_header(bytes) {
        return Err(RecordFault::Header);
    }
    let mut sample = Sample {
        station: bytes[1] - b'0',
        error: Some(bytes[2]).filter(|letter| *letter != GOOD),
        position: None,
        rotation: None,
        stylus_pressed: None,
    };
    let mut rest = &bytes[HEADER_LENGTH..];
    for item in &format.items {
        let (field, after) = rest.split_at(item.length(format.encoding));
        let phase = rest.len() + HEADER_LENGTH == bytes.len();
        take_item(*item, field, phase, format, &mut sample)?;
        rest = after;
    }
    Ok(sample)
}

fn take_item(
    item: Item,
    field: &[u8],
    first: bool,
    format: &RecordFormat,
    sample: &mut Sample,
) -> Result<(), RecordFault> {
    let flagged = sample.error.is_some();
    match item {
        Item::Space => constant(field, b" ")?,
        Item::CrLf => constant(field, b"\r\n")?,
        Item::Stylus => {
            sample.stylus_pressed = Some(match field {
                b" 0" => false,
                b" 1" => true,
                _ => return Err(RecordFault::Constant),
            });
        }
        Item::Position => {
            let metres =
                numbers(field, format.encoding)?.map(|value: f64| value * format.unit.metres());
            sample.position = unless_flagged(position(metres), flagged)?;
        }
        Item::PackedPosition => {
            let metres = packed(field, first)?.map(|value: f64| value * METRES_PER_PACKED_RANGE);
            sample.position = unless_flagged(position(metres), flagged)?;
        }
        Item::Euler => {
            let degrees = numbers(field, format.encoding)?;
            sample.rotation = unless_flagged(from_euler(degrees), flagged)?;
        }
        Item::PackedEuler => {
            let degrees = packed(field, first)?.map(|value: f64| value * 180.0);
            sample.rotation = unless_flagged(from_euler(degrees), flagged)?;
        }
        Item::Quaternion => {
            sample.rotation = unless_flagged(
                from_wxyz(numbers(field, format.encoding)?, QUATERNION_SLACK),
                flagged,
            )?;
        }
        Item::PackedQuaternion => {
            sample.rotation =
                unless_flagged(from_wxyz(packed(field, first)?, QUATERNION_SLACK), flagged)?;
        }
    }
    Ok(())
}

fn constant(field: &[u8], expected: &[u8]) -> Result<(), RecordFault> {
    (field == expected)
        .then_some(())
        .ok_or(RecordFault::Constant)
}

/// Nonsense is allowed in a record that carries an error letter, and is then absent; elsewhere it is no record.
const fn unless_flagged<T: Copy>(
    value: Option<T>,
    flagged: bool,
) -> Result<Option<T>, RecordFault> {
    if value.is_none() && !flagged {
        return Err(RecordFault::Number);
    }
    Ok(value)
}

/// The numbers of an ASCII or IEEE item.
fn numbers<const N: usize>(field: &[u8], encoding: Encoding) -> Result<[f64; N], RecordFault> {
    let mut values = [0.0; N];
    // Fields may touch each other, so they are cut by column.
    for (value, part) in values.iter_mut().zip(field.chunks_exact(field.len() / N)) {
        *value = match (encoding, part) {
            (Encoding::Binary, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
            (Encoding::Ascii, text) if text.iter().all(is_number_part) => std::str::from_utf8(text)
                .ok()
                .and_then(|text| text.trim_start().parse().ok())
                .ok_or(RecordFault::Number)?,
            _ => return Err(RecordFault::Number),
        };
    }
    Ok(values)
}

const fn is_number_part(byte: &u8) -> bool {
    byte.is_ascii_digit() || matches!(byte, b' ' | b'-' | b'+' | b'.')
}

/// The numbers of a packed item as fractions of full range: two bytes each, 7 bits a byte, low part first; bit 7
/// is the phase, set on the first byte of a record's data alone.
fn packed<const N: usize>(field: &[u8], first: bool) -> Result<[f64; N], RecordFault> {
    let in_phase = if first {
        is_one_phase(field)
    } else {
        field.is_ascii()
    };
    if !in_phase {
        return Err(RecordFault::Constant);
    }
    let mut values = [0.0; N];
    for (value, pair) in values.iter_mut().zip(field.chunks_exact(2)) {
        *value = f64::from(number_from_pair(pair[0], pair[1])) / 32768.0;
    }
    Ok(values)
}
