//! The records and answers of a Flock of Birds, written out: the inverse of its `decode.rs` and `status.rs`.

use crate::emulate::flock::Bird;
use crate::tracker::flock::protocol::{
    BUS, CRYSTAL, ERROR, FIRMWARE, FULL_RANGE, MODEL, N_ADDRESSES, POSITION_ANGLES,
    POSITION_QUATERNION, RATE,
};
use crate::tracker::packed::{PHASE, pair_from_number};

/// What a record holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FlockForm {
    Position,
    Angles,
    Quaternion,
    PositionAngles,
    PositionQuaternion,
}

impl FlockForm {
    pub(crate) const fn from_command(letter: u8) -> Option<Self> {
        Some(match letter {
            b'V' => Self::Position,
            b'W' => Self::Angles,
            b'\\' => Self::Quaternion,
            POSITION_ANGLES => Self::PositionAngles,
            POSITION_QUATERNION => Self::PositionQuaternion,
            _ => return None,
        })
    }
}

/// One bird's record; `address` is `None` where it is alone.
pub(crate) fn bird_record(bird: &Bird, address: Option<u8>, range_m: f64) -> Vec<u8> {
    let position: [f64; 3] = (bird.sensor.pose.translation.vector / range_m).into();
    let (x, y, z) = bird.sensor.pose.rotation.euler_angles();
    let angles = [z, y, x].map(|angle| angle.to_degrees() / 180.0);
    let rotation = bird.sensor.pose.rotation;
    let wxyz = [rotation.w, rotation.i, rotation.j, rotation.k];
    let (position, angles, wxyz) = (&position[..], &angles[..], &wxyz[..]);
    let fractions = match bird.form {
        FlockForm::Position => position.to_vec(),
        FlockForm::Angles => angles.to_vec(),
        FlockForm::Quaternion => wxyz.to_vec(),
        FlockForm::PositionAngles => [position, angles].concat(),
        FlockForm::PositionQuaternion => [position, wxyz].concat(),
    };
    let mut record: Vec<u8> = fractions
        .into_iter()
        // Full range is the greatest number that fits, and a float to integer cast saturates.
        .flat_map(|fraction| pair_from_number((fraction * (FULL_RANGE - 1.0)) as i16))
        .collect();
    record[0] |= PHASE;
    record.extend(bird.sends_buttons.then_some(bird.buttons & 0x7F));
    record.extend(address);
    record
}

/// The answer to examining a parameter; `None` for those that are not emulated.
pub(crate) fn answer_to_examine(
    parameter: u8,
    bus: &[u8; N_ADDRESSES],
    error: u8,
) -> Option<Vec<u8>> {
    Some(match parameter {
        FIRMWARE => vec![67, 3],
        CRYSTAL => vec![40, 0],
        // 11700, which at 40 MHz is 103.52 Hz.
        RATE => vec![0xB4, 0x2D],
        ERROR => vec![error],
        MODEL => b"EMULATED  ".to_vec(),
        BUS => bus.to_vec(),
        _ => return None,
    })
}
