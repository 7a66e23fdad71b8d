//! One record of a CyberGlove, from its letter to just before its NUL.
//!
//! Every byte of a record is non-zero (a time stamp marks its zeros in a mask), so records are cut at NUL and then
//! checked by letter, exact length and the bits that are always 1. A record that fails is dropped, never repaired.

use thiserror::Error;

use crate::glove::cyberglove::protocol::{
    ALWAYS_ONE, ERROR, ERROR_CODES, STAMP_LENGTH, STATUS_LIGHT, STATUS_PLUGGED_IN, STATUS_SWITCH,
};
use crate::glove::sensor::{GloveSensor, SensorMask};

/// What a record holds, as negotiated at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordLayout {
    /// The letter that caused the record: `G` or `S`.
    pub letter: u8,
    /// The sensors that are sent.
    pub mask: SensorMask,
    /// Whether a time stamp follows the sensors.
    pub stamp: bool,
    /// Whether a status byte follows.
    pub status: bool,
}

impl RecordLayout {
    /// Length in bytes without error code and without NUL.
    #[must_use]
    pub const fn length(&self) -> usize {
        let stamp = if self.stamp { STAMP_LENGTH } else { 0 };
        let status = if self.status { 1 } else { 0 };
        1 + self.mask.count() + stamp + status
    }
}

/// The status byte of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Status {
    /// A glove is plugged into the box.
    pub plugged_in: bool,
    /// The wrist switch is on.
    pub switch_on: bool,
    /// The wrist light is on.
    pub light_on: bool,
}

/// One decoded record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    /// Raw counts by wire slot; `None` for slots that are not sent.
    pub raw: [Option<u16>; GloveSensor::N_SLOTS],
    /// The device's own time counter, if the record has one.
    pub device_ticks: Option<u32>,
    /// The status byte, if the record has one.
    pub status: Option<Status>,
    /// The condition code that the device added.
    pub error: Option<u8>,
}

/// Why bytes are not a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum RecordFault {
    /// The first byte is not the letter that was sent.
    #[error("record does not begin with the command's letter")]
    Letter,
    /// The length is neither that of the layout nor that plus an error code.
    #[error("record has {found} bytes, not {expected}")]
    Length {
        /// Bytes found.
        found: usize,
        /// Bytes expected without an error code.
        expected: usize,
    },
    /// A sensor is 0, which a glove never sends.
    #[error("record has a sensor value of 0")]
    ZeroSensor,
    /// The bit that is always 1 in the status byte is 0.
    #[error("status byte without its always-one bit")]
    Status,
    /// The bit that is always 1 in the stamp's mask is 0.
    #[error("time stamp mask without its always-one bit")]
    Stamp,
    /// The two bytes at the end are not an error code.
    #[error("no error code where one has to be")]
    ErrorCode,
}

/// Decodes one record, given without its NUL.
///
/// # Errors
/// A [`RecordFault`] that names the first check that failed.
pub fn decode_record(bytes: &[u8], layout: &RecordLayout) -> Result<Sample, RecordFault> {
    let expected = layout.length();
    if bytes.first() != Some(&layout.letter) {
        return Err(RecordFault::Letter);
    }
    if bytes.len() != expected && bytes.len() != expected + 2 {
        return Err(RecordFault::Length {
            found: bytes.len(),
            expected,
        });
    }
    let (record, trailer) = bytes.split_at(expected);
    let (sensors, rest) = record[1..].split_at(layout.mask.count());
    if sensors.contains(&0) {
        return Err(RecordFault::ZeroSensor);
    }
    let mut raw = [None; GloveSensor::N_SLOTS];
    for (slot, value) in layout.mask.slots().zip(sensors) {
        raw[slot] = Some(u16::from(*value));
    }
    let (stamp, status) = rest.split_at(if layout.stamp { STAMP_LENGTH } else { 0 });
    Ok(Sample {
        raw,
        device_ticks: decode_stamp(stamp)?,
        status: status
            .first()
            .map(|byte| decode_status(*byte))
            .transpose()?,
        error: decode_error(trailer)?,
    })
}

/// Decodes the status byte.
///
/// # Errors
/// [`RecordFault::Status`] when the bit that is always 1 is not.
pub const fn decode_status(byte: u8) -> Result<Status, RecordFault> {
    if byte & ALWAYS_ONE == 0 {
        return Err(RecordFault::Status);
    }
    Ok(Status {
        plugged_in: byte & STATUS_PLUGGED_IN != 0,
        switch_on: byte & STATUS_SWITCH != 0,
        light_on: byte & STATUS_LIGHT != 0,
    })
}

fn decode_stamp(bytes: &[u8]) -> Result<Option<u32>, RecordFault> {
    let [mask, filled @ ..] = bytes else {
        return Ok(None);
    };
    if mask & ALWAYS_ONE == 0 {
        return Err(RecordFault::Stamp);
    }
    let mut stamp = 0;
    for (index, byte) in filled.iter().enumerate() {
        // Bit i of the mask says that byte i is really 0.
        if mask & (1 << index) == 0 {
            stamp |= u32::from(*byte) << (8 * index);
        }
    }
    Ok(Some(stamp))
}

fn decode_error(trailer: &[u8]) -> Result<Option<u8>, RecordFault> {
    match trailer {
        [] => Ok(None),
        [ERROR, code] if ERROR_CODES.contains(code) => Ok(Some(*code)),
        _ => Err(RecordFault::ErrorCode),
    }
}
