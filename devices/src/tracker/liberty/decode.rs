//! One binary frame: 8 bytes of header, then the items of the list.

use thiserror::Error;

use crate::tracker::dialect::TrackerRecord;
use crate::tracker::liberty::protocol::{
    CONTINUOUS, GOOD, HEADER_LENGTH, Model, N_STATIONS, POLL, TRAILER,
};
use crate::tracker::liberty::settings::Counter;
use crate::tracker::numbers::{from_wxyz, position};

/// How far the length of a sent quaternion may be from 1.
const QUATERNION_SLACK: f64 = 0.02;

/// What the frames of every station look like: position, quaternion, counter, switch, a space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameFormat {
    /// The counter, if any.
    pub counter: Option<Counter>,
    /// Whether the switch of the stylus is there.
    pub stylus: bool,
    /// Metres in one of the unit in which positions are sent.
    pub metres_per_unit: f64,
}

impl FrameFormat {
    /// The numbers by which the items are asked for.
    #[must_use]
    pub fn items(&self) -> Vec<u8> {
        let counter = self.counter.map(|counter| match counter {
            Counter::Time => 8,
            Counter::Frames => 9,
        });
        let stylus = self.stylus.then_some(10);
        [Some(2), Some(7), counter, stylus, Some(0)]
            .into_iter()
            .flatten()
            .collect()
    }

    /// Bytes after the header.
    #[must_use]
    pub const fn payload_length(&self) -> usize {
        12 + 16 + 4 * (self.counter.is_some() as usize) + 4 * (self.stylus as usize) + 1
    }

    /// Bytes of a frame.
    #[must_use]
    pub const fn length(&self) -> usize {
        HEADER_LENGTH + self.payload_length()
    }
}

/// Why bytes are not a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum FrameFault {
    /// Fewer or more bytes than a frame has.
    #[error("frame has {found} bytes, not {expected}")]
    Length {
        /// Bytes found.
        found: usize,
        /// Bytes of the list.
        expected: usize,
    },
    /// The header is none, or announces another length.
    #[error("not the header of a frame")]
    Header,
    /// The last byte is not the space that our lists end with.
    #[error("the last byte is no space")]
    Trailer,
    /// A number is beyond what a unit sends, in a frame that claims to be good.
    #[error("a number of the frame makes no sense")]
    Number,
}

/// Whether bytes can be the beginning of a frame of that payload; fewer can if what is there fits. Letters of models
/// that are not known are let through, and the reserved byte may be anything.
#[must_use]
pub fn is_header(bytes: &[u8], payload_length: usize) -> bool {
    let [low, high] = (payload_length as u16).to_le_bytes();
    let fits = |index: usize, byte: u8| match index {
        0 | 1 => byte.is_ascii_uppercase(),
        2 => (1..=N_STATIONS).contains(&usize::from(byte)),
        3 => byte == POLL || byte == CONTINUOUS[0],
        6 => byte == low,
        7 => byte == high,
        _ => true,
    };
    bytes
        .iter()
        .take(HEADER_LENGTH)
        .enumerate()
        .all(|(index, byte)| fits(index, *byte))
}

/// Decodes one frame; its model is `None` where the letters are not known.
///
/// # Errors
/// A [`FrameFault`] that names the first check that failed.
pub fn decode_frame(
    bytes: &[u8],
    format: &FrameFormat,
) -> Result<(Option<Model>, TrackerRecord), FrameFault> {
    let expected = format.length();
    if bytes.len() != expected {
        return Err(FrameFault::Length {
            found: bytes.len(),
            expected,
        });
    }
    if !is_header(bytes, format.payload_length()) {
        return Err(FrameFault::Header);
    }
    if bytes[expected - 1] != TRAILER {
        return Err(FrameFault::Trailer);
    }
    let word = |index: usize| {
        let at = HEADER_LENGTH + 4 * index;
        [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]
    };
    let float = |index: usize| f64::from(f32::from_le_bytes(word(index)));
    let place = position(std::array::from_fn(|index| {
        float(index) * format.metres_per_unit
    }));
    let rotation = from_wxyz(
        std::array::from_fn(|index| float(3 + index)),
        QUATERNION_SLACK,
    );
    let good = bytes[4] == GOOD;
    // Nonsense is allowed in a frame that carries an error, and is then absent.
    if good && (place.is_none() || rotation.is_none()) {
        return Err(FrameFault::Number);
    }
    let after_counter = 7 + usize::from(format.counter.is_some());
    let record = TrackerRecord {
        station: bytes[2].into(),
        position: place,
        rotation,
        error: (!good).then_some(char::from(bytes[4])),
        usable: good,
        ticks: format.counter.map(|_| u32::from_le_bytes(word(7))),
        pressed: format
            .stylus
            .then(|| u32::from_le_bytes(word(after_counter)) != 0),
    };
    Ok((Model::from_preamble([bytes[0], bytes[1]]), record))
}
