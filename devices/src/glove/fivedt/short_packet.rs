//! The record of a glove of five: 9 bytes over a cable, 10 by radio. Flexures run from 0 (straight) to 255.

use crate::glove::calibrate::Handedness;
use crate::glove::fivedt::checksum::Parts;

/// The first byte. It may be a value too.
pub const HEADER: u8 = 0x80;
/// The answer to a reset; some gloves end every record in it.
pub const DONE: u8 = 0x55;
/// Length over a cable.
pub const WIRED_LENGTH: usize = 9;
/// Length by radio.
pub const WIRELESS_LENGTH: usize = 10;
/// Initialises the glove, which answers [`DONE`].
pub const RESET: u8 = b'A';
/// Asks for one record.
pub const SAMPLE: u8 = b'C';
/// Starts the stream.
pub const STREAM: u8 = b'D';
/// Asks for the information block.
pub const INFORMATION: u8 = b'G';
/// Length of the information block.
pub const INFORMATION_LENGTH: usize = 32;
/// The first bytes of the information block.
pub const INFORMATION_HEADER: [u8; 2] = [0x42, 0x52];
/// Last byte of a wireless record of a right glove.
const RIGHT: u8 = 0x01;
/// Last byte of a wireless record of a left glove.
const LEFT: u8 = 0x40;

/// One record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShortPacket {
    /// Flexures in the order of the record.
    pub flexures: [u8; 5],
    /// Pitch.
    pub pitch: u8,
    /// Roll.
    pub roll: u8,
    /// The byte that may be a checksum.
    pub check: u8,
}

impl ShortPacket {
    /// From the 9 bytes that both kinds of record begin with; `None` without the header.
    #[must_use]
    pub const fn decode(bytes: [u8; WIRED_LENGTH]) -> Option<Self> {
        let [HEADER, a, b, c, d, e, pitch, roll, check] = bytes else {
            return None;
        };
        Some(Self {
            flexures: [a, b, c, d, e],
            pitch,
            roll,
            check,
        })
    }
}

/// The parts of a record of at least 9 bytes.
#[must_use]
pub fn parts(bytes: &[u8]) -> Parts<'_> {
    Parts {
        header: &bytes[..1],
        body: &bytes[1..WIRED_LENGTH - 1],
        check: bytes[WIRED_LENGTH - 1],
    }
}

/// The hand that the last byte of a wireless record means; `None` for a byte that cannot stand there.
#[must_use]
pub const fn hand_of(capability: u8) -> Option<Handedness> {
    match capability {
        RIGHT => Some(Handedness::Right),
        LEFT => Some(Handedness::Left),
        _ => None,
    }
}

/// The last byte of a wireless record of that hand.
#[must_use]
pub const fn capability_of(hand: Handedness) -> u8 {
    match hand {
        Handedness::Right => RIGHT,
        Handedness::Left => LEFT,
    }
}

/// What a wired glove says about itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Information {
    /// Hardware version and revision.
    pub version: [u8; 2],
    /// Which hand it is made for.
    pub hand: Handedness,
    /// Whether pitch and roll are measured.
    pub has_tilt: bool,
    /// Its name; may be empty.
    pub name: String,
}

impl Information {
    /// From the 32 bytes; `None` without the header.
    #[must_use]
    pub fn decode(bytes: &[u8; INFORMATION_LENGTH]) -> Option<Self> {
        if bytes[..2] != INFORMATION_HEADER {
            return None;
        }
        let name = bytes[16..].split(|byte| *byte == 0).next();
        Some(Self {
            version: [bytes[2], bytes[3]],
            hand: if bytes[4] & 1 == 1 {
                Handedness::Right
            } else {
                Handedness::Left
            },
            has_tilt: bytes[5] & 0x10 != 0,
            name: printable(name.unwrap_or_default()),
        })
    }
}

fn printable(bytes: &[u8]) -> String {
    bytes
        .iter()
        .filter(|byte| byte.is_ascii_graphic() || **byte == b' ')
        .map(|byte| char::from(*byte))
        .collect::<String>()
        .trim()
        .to_owned()
}
