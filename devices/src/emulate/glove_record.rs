//! The CyberGlove's records, written out: the inverse of its `decode.rs`.

use crate::glove::cyberglove::protocol::{
    ALWAYS_ONE, ERROR, ERROR_NO_GLOVE, STATUS_LIGHT, STATUS_PLUGGED_IN, STATUS_SWITCH, TERMINATOR,
};

/// What goes into one record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RecordParts<'a> {
    pub(crate) sensors: &'a [u8],
    pub(crate) stamp: Option<u32>,
    pub(crate) status: Option<u8>,
    pub(crate) error: Option<u8>,
}

pub(crate) fn binary_record(letter: u8, parts: &RecordParts<'_>) -> Vec<u8> {
    let mut bytes = vec![letter];
    // 0 never occurs among the sensors, whatever the caller's motion says.
    bytes.extend(parts.sensors.iter().map(|value| (*value).max(1)));
    if let Some(stamp) = parts.stamp {
        bytes.extend(stamp_bytes(stamp));
    }
    bytes.extend(parts.status);
    if let Some(code) = parts.error {
        bytes.extend([ERROR, code]);
    }
    bytes.push(TERMINATOR);
    bytes
}

pub(crate) fn ascii_record(letter: u8, parts: &RecordParts<'_>) -> Vec<u8> {
    let mut text = char::from(letter.to_ascii_lowercase()).to_string();
    for value in parts.sensors {
        text.push_str(&format!(" {}", (*value).max(1)));
    }
    for number in [parts.stamp, parts.status.map(u32::from)]
        .into_iter()
        .flatten()
    {
        text.push_str(&format!(" {number}"));
    }
    if let Some(code) = parts.error {
        text.push_str(&format!(" e{}", char::from(code)));
    }
    text.push_str("\r\n\0");
    text.into_bytes()
}

/// The mask byte, then four bytes, least significant first; a byte that is 0 is filled and marked in the mask.
fn stamp_bytes(stamp: u32) -> [u8; 5] {
    let mut bytes = [ALWAYS_ONE; 5];
    for (index, byte) in stamp.to_le_bytes().into_iter().enumerate() {
        let mark = 1 << index;
        if byte == 0 {
            bytes[0] |= mark;
        }
        bytes[index + 1] = if byte == 0 { mark } else { byte };
    }
    bytes
}

pub(crate) const fn status_byte(plugged_in: bool, switch_light: (bool, bool)) -> u8 {
    let (switch_on, light_on) = switch_light;
    let mut byte = ALWAYS_ONE;
    if plugged_in {
        byte |= STATUS_PLUGGED_IN;
    }
    if switch_on {
        byte |= STATUS_SWITCH;
    }
    if light_on {
        byte |= STATUS_LIGHT;
    }
    byte
}

pub(crate) const fn condition(plugged_in: bool) -> Option<u8> {
    if plugged_in {
        None
    } else {
        Some(ERROR_NO_GLOVE)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::{any, prop_assert_eq, proptest};

    use super::{RecordParts, binary_record};
    use crate::glove::cyberglove::decode::{RecordLayout, decode_record, decode_status};
    use crate::glove::sensor::SensorMask;

    proptest! {
        #[test]
        fn what_is_written_is_read(
            sensors in proptest::array::uniform22(1_u8..=255),
            stamp in any::<Option<u32>>(),
            status in proptest::option::of(128_u8..=255),
            unplugged in any::<bool>(),
        ) {
            let parts = RecordParts {
                sensors: &sensors,
                stamp,
                status,
                error: unplugged.then_some(b'g'),
            };
            let layout = RecordLayout {
                letter: b'G',
                mask: SensorMask::TWENTY_TWO,
                stamp: stamp.is_some(),
                status: status.is_some(),
            };
            let bytes = binary_record(b'G', &parts);
            let nul = bytes.iter().position(|byte| *byte == 0);
            prop_assert_eq!(nul, Some(bytes.len() - 1));
            let sample = decode_record(&bytes[..bytes.len() - 1], &layout).unwrap();
            let raw: Vec<u8> = sample.raw.iter().flatten().map(|value| *value as u8).collect();
            prop_assert_eq!(raw, sensors.to_vec());
            prop_assert_eq!(sample.device_ticks, stamp);
            prop_assert_eq!(sample.status, status.map(|byte| decode_status(byte).unwrap()));
            prop_assert_eq!(sample.error, parts.error);
        }
    }
}
