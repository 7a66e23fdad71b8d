//! One record: 17 bytes, packed into 20 of which only the first has bit 7.

use thiserror::Error;

use crate::tracker::dialect::TrackerRecord;
use crate::tracker::fastrak::protocol::{DATA, GOOD, data_usable};
use crate::tracker::isotrak::protocol::{
    BUTTON_DOWN, BUTTON_UP, Model, N_STATIONS, QUATERNION_SCALE, RECORD_LENGTH,
};
use crate::tracker::numbers::{from_wxyz, position};
use crate::tracker::packed::unpack_sevens;

/// Why bytes are not a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum RecordFault {
    /// The length, the phase bit or a spare bit is wrong.
    #[error("not a packed record")]
    Packing,
    /// The first three bytes are not `0`, a station, and a button, an error letter or a space.
    #[error("not the header of a record")]
    Header,
    /// The rotation of a record that claims to be good is none.
    #[error("the rotation of the record makes no sense")]
    Rotation,
}

/// Decodes one record as it comes over the line.
///
/// # Errors
/// A [`RecordFault`] that names the first check that failed.
pub fn decode_record(wire: &[u8], model: Model) -> Result<TrackerRecord, RecordFault> {
    let bytes: [u8; RECORD_LENGTH] = unpack_sevens(wire).ok_or(RecordFault::Packing)?;
    let station = bytes[1].wrapping_sub(b'0');
    let pressed = match bytes[2] {
        BUTTON_DOWN => Some(true),
        BUTTON_UP => Some(false),
        _ => None,
    };
    let letter = Some(bytes[2]).filter(|byte| *byte != GOOD && pressed.is_none());
    let is_header = bytes[0] == DATA
        && (1..=N_STATIONS).contains(&usize::from(station))
        && letter.is_none_or(|byte| byte.is_ascii_alphabetic());
    if !is_header {
        return Err(RecordFault::Header);
    }
    let number = |index: usize| {
        let at = 3 + 2 * index;
        f64::from(i16::from_le_bytes([bytes[at], bytes[at + 1]]))
    };
    let metres: [f64; 3] = std::array::from_fn(|index| number(index) * model.metres_per_step());
    let wxyz: [f64; 4] = std::array::from_fn(|index| number(3 + index) / QUATERNION_SCALE);
    let rotation = from_wxyz(wxyz, model.quaternion_slack());
    if rotation.is_none() && letter.is_none() {
        return Err(RecordFault::Rotation);
    }
    Ok(TrackerRecord {
        station: station.into(),
        position: position(metres),
        rotation,
        error: letter.map(char::from),
        usable: letter.is_none_or(data_usable),
        ticks: None,
        pressed,
    })
}
