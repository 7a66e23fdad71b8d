//! The 12-bit record of a CyberGlove III (`1S`), decoded for recordings; no session asks for it yet.

use thiserror::Error;

/// Length of the record in bytes, without a leading letter.
pub const LENGTH: usize = 61;
/// Sensors in the record.
pub const N_SENSORS: usize = 22;

/// One 12-bit record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HighResolutionSample {
    /// The glove's clock: hours, minutes, seconds.
    pub time_of_day: [u8; 3],
    /// Frame in the second, 1 to 30.
    pub frame: u8,
    /// Sub-frame, from 0.
    pub sub_frame: u8,
    /// Counts in the order of a 22-sensor record, 1 to 4094.
    pub raw: [u16; N_SENSORS],
}

/// Why bytes are not a 12-bit record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum HighResolutionFault {
    /// The terminator CR LF NUL is not at the expected distance.
    #[error("no CR LF NUL at byte 58 of 61")]
    Terminator,
    /// The time text is not `HH:MM:SS:ff:nS`.
    #[error("the time text is malformed")]
    TimeText,
    /// A value is beyond 12 bits.
    #[error("sensor value {0} is beyond 12 bits")]
    Range(u16),
}

/// Decodes one 12-bit record. NUL occurs inside it, so it has to be cut by length and checked at its end.
///
/// # Errors
/// A [`HighResolutionFault`] that names the check that failed.
pub fn decode(bytes: &[u8; LENGTH]) -> Result<HighResolutionSample, HighResolutionFault> {
    if bytes[58..] != [0x0D, 0x0A, 0x00] {
        return Err(HighResolutionFault::Terminator);
    }
    let separators = [2, 5, 8, 11].iter().all(|&index| bytes[index] == b':');
    if !separators || bytes[13] != b'S' || !bytes[12].is_ascii_digit() {
        return Err(HighResolutionFault::TimeText);
    }
    let mut raw = [0; N_SENSORS];
    for (value, pair) in raw.iter_mut().zip(bytes[14..58].chunks_exact(2)) {
        *value = u16::from_be_bytes([pair[0], pair[1]]);
        if *value > 0x0FFF {
            return Err(HighResolutionFault::Range(*value));
        }
    }
    Ok(HighResolutionSample {
        time_of_day: [
            two_digits(bytes[0], bytes[1])?,
            two_digits(bytes[3], bytes[4])?,
            two_digits(bytes[6], bytes[7])?,
        ],
        frame: two_digits(bytes[9], bytes[10])?,
        sub_frame: bytes[12] - b'0',
        raw,
    })
}

const fn two_digits(tens: u8, ones: u8) -> Result<u8, HighResolutionFault> {
    if tens.is_ascii_digit() && ones.is_ascii_digit() {
        Ok(10 * (tens - b'0') + (ones - b'0'))
    } else {
        Err(HighResolutionFault::TimeText)
    }
}
