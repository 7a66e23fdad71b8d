//! The packets of a glove of 14 or 16: data of 36 bytes, and now and then 7 bytes about the glove. Values are 12 bits.

use crate::glove::calibrate::Handedness;
use crate::glove::fivedt::checksum::Parts;
use crate::glove::sensor::GloveSensor;

/// The first byte of every packet.
pub const OPEN: u8 = b'<';
/// The last byte of every packet.
pub const CLOSE: u8 = b'>';
/// The second byte of a data packet.
pub const DATA: u8 = b'D';
/// The second byte of a packet about the glove.
pub const ABOUT: u8 = b'I';
/// Length of a data packet.
pub const DATA_LENGTH: usize = 36;
/// Length of a packet about the glove.
pub const ABOUT_LENGTH: usize = 7;
/// Values in a data packet.
pub const N_VALUES: usize = 16;

/// The sensors of the first 14 values.
pub const SENSORS: [GloveSensor; 14] = [
    GloveSensor::ThumbMcp,
    GloveSensor::ThumbIp,
    GloveSensor::ThumbAbduction,
    GloveSensor::IndexMcp,
    GloveSensor::IndexPip,
    GloveSensor::MiddleIndexAbduction,
    GloveSensor::MiddleMcp,
    GloveSensor::MiddlePip,
    GloveSensor::RingMiddleAbduction,
    GloveSensor::RingMcp,
    GloveSensor::RingPip,
    GloveSensor::LittleRingAbduction,
    GloveSensor::LittleMcp,
    GloveSensor::LittlePip,
];
/// Those of the last two values of a glove of 16.
pub const LAST_SENSORS: [GloveSensor; 2] = [GloveSensor::ThumbRotation, GloveSensor::WristFlexion];

/// The values of a data packet; `None` when it is none: another header, or a value of more than 12 bits.
#[must_use]
pub fn decode_data(bytes: &[u8; DATA_LENGTH]) -> Option<[u16; N_VALUES]> {
    if bytes[..2] != [OPEN, DATA] {
        return None;
    }
    let mut values = [0; N_VALUES];
    for (value, pair) in values.iter_mut().zip(bytes[2..34].chunks_exact(2)) {
        *value = u16::from_be_bytes([pair[0], pair[1]]);
        if *value > 0x0FFF {
            return None;
        }
    }
    Some(values)
}

/// The parts of a data packet.
#[must_use]
pub fn parts(bytes: &[u8; DATA_LENGTH]) -> Parts<'_> {
    Parts {
        header: &bytes[..2],
        body: &bytes[2..34],
        check: bytes[34],
    }
}

/// What such a glove says about itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct About {
    /// Version, major and minor.
    pub version: [u8; 2],
    /// Which hand it is made for.
    pub hand: Handedness,
    /// Whether it hangs on a cable.
    pub wired: bool,
}

impl About {
    /// From the 7 bytes; `None` when they are none.
    #[must_use]
    pub const fn decode(bytes: [u8; ABOUT_LENGTH]) -> Option<Self> {
        let [OPEN, ABOUT, major, minor, hand, wired, CLOSE] = bytes else {
            return None;
        };
        Some(Self {
            version: [major, minor],
            hand: if hand & 1 == 1 {
                Handedness::Right
            } else {
                Handedness::Left
            },
            wired: wired & 1 == 1,
        })
    }
}
