//! The Fastrak's records, written out: the inverse of its `decode.rs` and `status.rs`.

use nalgebra::Isometry3;

use crate::tracker::fastrak::decode::{Encoding, Item, LengthUnit};
use crate::tracker::fastrak::protocol::{DATA, FLAGS_ALWAYS, GOOD, METRES_PER_PACKED_RANGE};
use crate::tracker::packed::{PHASE, pair_from_number};

/// One station's record. `pose` is the sensor in transmitter space, m.
pub(crate) fn data_record(
    station: u8,
    error: Option<u8>,
    pose: &Isometry3<f64>,
    list: &[Item],
    form: (Encoding, LengthUnit),
) -> Vec<u8> {
    let (encoding, unit) = form;
    let mut bytes = vec![DATA, b'0' + station, error.unwrap_or(GOOD)];
    let header = bytes.len();
    let position_m = [pose.translation.x, pose.translation.y, pose.translation.z];
    let (roll, elevation, azimuth) = pose.rotation.euler_angles();
    let degrees = [azimuth, elevation, roll].map(f64::to_degrees);
    let wxyz = [
        pose.rotation.w,
        pose.rotation.i,
        pose.rotation.j,
        pose.rotation.k,
    ];
    for item in list {
        match item {
            Item::Space => bytes.push(b' '),
            Item::CrLf => bytes.extend(b"\r\n"),
            Item::Stylus => bytes.extend(b" 0"),
            Item::Position => {
                let sent = position_m.map(|metres| metres / unit.metres());
                put_numbers(&mut bytes, &sent, 2, encoding);
            }
            Item::Euler => put_numbers(&mut bytes, &degrees, 2, encoding),
            Item::Quaternion => put_numbers(&mut bytes, &wxyz, 4, encoding),
            Item::PackedPosition => {
                let sent = position_m.map(|metres| metres / METRES_PER_PACKED_RANGE);
                put_packed(&mut bytes, &sent, header);
            }
            Item::PackedEuler => {
                put_packed(&mut bytes, &degrees.map(|angle| angle / 180.0), header)
            }
            Item::PackedQuaternion => put_packed(&mut bytes, &wxyz, header),
        }
    }
    bytes
}

/// ASCII numbers have 7 columns, of which `decimals` behind the point; those that do not fit are held at the limit.
fn put_numbers(bytes: &mut Vec<u8>, values: &[f64], decimals: usize, encoding: Encoding) {
    let limit = if decimals == 2 { 999.99 } else { 9.9999 };
    for value in values {
        match encoding {
            Encoding::Binary => bytes.extend((*value as f32).to_le_bytes()),
            Encoding::Ascii => {
                let shown = value.clamp(-limit, limit);
                bytes.extend(format!("{shown:7.decimals$}").into_bytes());
            }
        }
    }
}

/// Two bytes of 7 bits for each fraction of full range, low part first; the first byte of the data has bit 7 set.
fn put_packed(bytes: &mut Vec<u8>, fractions: &[f64], header: usize) {
    for fraction in fractions {
        // 14 bits are sent, and full range is the greatest number that fits.
        let steps = (fraction.clamp(-1.0, 1.0) * 8191.0).round() as i16;
        let [low, high] = pair_from_number(steps << 2);
        let phase = if bytes.len() == header { PHASE } else { 0 };
        bytes.extend([low | phase, high]);
    }
}

/// The flags of a status: those that are always set, and of these the ones that are on.
pub(crate) fn status_flags(flags: [(u16, bool); 3]) -> u16 {
    flags
        .iter()
        .filter(|(_, on)| *on)
        .fold(FLAGS_ALWAYS, |set, (flag, _)| set | flag)
}

/// The answer to `S`, 55 bytes.
pub(crate) fn status_record(flags: u16, stations: [bool; 4]) -> Vec<u8> {
    let map = stations
        .iter()
        .rev()
        .fold(0, |map, used| 2 * map + u32::from(*used));
    format!(
        "21S{flags:03X}    F3{map:X}  3.1.00{:<32}\r\n",
        "EMULATED TRACKER"
    )
    .into_bytes()
}

/// The answer to a bad command.
pub(crate) fn refusal(command: &str, code: i32) -> Vec<u8> {
    format!("2  E*ERROR*{command}*ERROR* EC{code}*PS0*FL0*ST0\r\n").into_bytes()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion, Vector3};
    use proptest::prelude::{prop_assert, proptest};

    use super::{data_record, status_record};
    use crate::tracker::fastrak::decode::{
        Encoding, Item, LengthUnit, RecordFormat, decode_record,
    };
    use crate::tracker::fastrak::protocol::STATUS_LENGTH;
    use crate::tracker::fastrak::status::{ControlRecord, parse_control};

    #[test]
    fn a_status_is_55_bytes_and_reads_back() {
        let line = status_record(0x3F3, [true, false, true, false]);
        assert_eq!(line.len(), STATUS_LENGTH);
        let Some(ControlRecord::Status(status)) = parse_control(&line) else {
            panic!("no status: {line:?}");
        };
        assert_eq!(status.flags, 0x3F3);
        assert_eq!(status.firmware, "3.1.00");
        assert_eq!(status.identity, "EMULATED TRACKER");
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(
            position in proptest::array::uniform3(-2.0..2.0_f64),
            axis in proptest::array::uniform3(-1.0..1.0_f64),
            list_index in 0..5_usize,
            station in 1..=4_u8,
            inches in proptest::bool::ANY,
        ) {
            use Item::{CrLf, Euler, PackedPosition, PackedQuaternion, Position, Quaternion, Space};
            // Tolerances in m and rad follow from the decimals and bits of each form.
            let (items, encoding, metres, radians) = [
                (vec![Position, Quaternion, Space], Encoding::Binary, 1e-6, 1e-5),
                (vec![Position, Quaternion, CrLf], Encoding::Ascii, 2e-4, 5e-3),
                (vec![Position, Euler, CrLf], Encoding::Ascii, 2e-4, 1e-3),
                (vec![Position, Euler, Space], Encoding::Binary, 1e-6, 1e-5),
                (vec![PackedPosition, PackedQuaternion, Space], Encoding::Binary, 6e-4, 2e-2),
            ][list_index].clone();
            let unit = if inches { LengthUnit::Inches } else { LengthUnit::Centimetres };
            let pose = Isometry3::from_parts(
                Vector3::from(position).into(),
                UnitQuaternion::from_scaled_axis(Vector3::from(axis)),
            );
            let bytes = data_record(station, None, &pose, &items, (encoding, unit));
            let format = RecordFormat { items, encoding, unit };
            let sample = decode_record(&bytes, &format).unwrap();
            prop_assert!(sample.station == station);
            let offset = sample.position.unwrap().coords - pose.translation.vector;
            prop_assert!(offset.amax() <= metres, "{offset}");
            let turn = sample.rotation.unwrap().angle_to(&pose.rotation);
            prop_assert!(turn <= radians, "{turn}");
        }
    }
}
