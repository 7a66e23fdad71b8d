//! The worked examples F1 to F4 of the protocol reference.

use nalgebra::{Matrix3, Point3};
use tsukamu_devices::tracker::fastrak::decode::{
    Encoding, Item, LengthUnit, RecordFault, RecordFormat, Sample, decode_record,
};
use tsukamu_devices::tracker::fastrak::status::{ControlRecord, parse_control};
use tsukamu_devices::tracker::space::TrackerSpace;

use crate::support::bytes;

const F1: &str = "30 31 20 20 20 31 30 2E 30 30 20 20 2D 34 2E 30 30 20 20 20 32 2E 35 30 20 20 33 30 2E 30 30 20 \
                  2D 31 30 2E 30 30 20 20 20 35 2E 30 30 0D 0A";
const F2: &str = "30 31 20 00 00 20 41 00 00 80 C0 00 00 20 40 86 D9 75 3F 39 1D 84 3D 40 37 95 BD FD C3 85 3E 20";
const F3: &str = "30 31 20 B6 05 6B 7D 2D 01 3A 3D 10 04 2B 7B 5C 10 20";

fn format(items: &[Item], encoding: Encoding) -> RecordFormat {
    RecordFormat {
        items: items.to_vec(),
        encoding,
        unit: LengthUnit::Inches,
    }
}

fn binary() -> RecordFormat {
    format(
        &[Item::Position, Item::Quaternion, Item::Space],
        Encoding::Binary,
    )
}

fn check_pose(sample: &Sample, metres: [f64; 3], wxyz: [f64; 4], tolerance: (f64, f64)) {
    let offset = sample.position.unwrap() - Point3::from(metres);
    assert!(offset.amax() < tolerance.0, "{offset}");
    let q = sample.rotation.unwrap();
    for (found, expected) in [q.w, q.i, q.j, q.k].into_iter().zip(wxyz) {
        assert!((found - expected).abs() < tolerance.1, "{q}");
    }
    assert_eq!((sample.station, sample.error), (1, None));
}

const METRES: [f64; 3] = [0.2540, -0.1016, 0.0635];
const WXYZ: [f64; 4] = [0.960_35, 0.064_509, -0.072_859, 0.261_261];

#[test]
fn f1_ascii_with_angles() {
    let format = format(&[Item::Position, Item::Euler, Item::CrLf], Encoding::Ascii);
    assert_eq!(format.length(), 47);
    let sample = decode_record(&bytes(F1), &format).unwrap();
    check_pose(&sample, METRES, WXYZ, (1e-12, 1e-5));
    // The check matrix of section 2.4.
    let expected = Matrix3::new(
        0.85287, -0.51120, -0.10623, 0.49240, 0.85516, -0.16197, 0.17365, 0.08583, 0.98106,
    );
    let found = sample.rotation.unwrap().to_rotation_matrix();
    assert!((found.matrix() - expected).amax() < 1e-5);
}

#[test]
fn f2_binary_with_a_quaternion() {
    assert_eq!(binary().length(), 32);
    let sample = decode_record(&bytes(F2), &binary()).unwrap();
    check_pose(&sample, METRES, WXYZ, (1e-12, 1e-6));
}

#[test]
fn f3_packed() {
    let format = format(
        &[Item::PackedPosition, Item::PackedQuaternion, Item::Space],
        Encoding::Binary,
    );
    assert_eq!(format.length(), 18);
    let sample = decode_record(&bytes(F3), &format).unwrap();
    check_pose(
        &sample,
        [0.25415, -0.10144, 0.06335],
        [0.9602, 0.0645, -0.0729, 0.2612],
        (1e-5, 2e-4),
    );
}

#[test]
fn f4_status() {
    let line = format!("21S3F1    F31  3.1.00{:<32}\r\n", "MY TRACKER");
    assert_eq!(line.len(), 55);
    let Some(ControlRecord::Status(status)) = parse_control(line.as_bytes()) else {
        panic!("not a status");
    };
    assert!(status.binary() && !status.centimetres() && !status.continuous());
    assert_eq!(status.test_code, "");
    assert_eq!(status.firmware, "3.1.00");
    assert_eq!(status.identity, "MY TRACKER");
    let refusal = b"2  E*ERROR*O9,2*ERROR* EC-3*PS1*FL1*ST1\r\n";
    assert!(matches!(
        parse_control(refusal),
        Some(ControlRecord::Refusal(text)) if text.contains("EC-3")
    ));
}

#[test]
fn touching_columns_are_cut_by_width() {
    let format = format(&[Item::Position, Item::CrLf], Encoding::Ascii);
    let sample = decode_record(b"02  -10.00-123.45 100.00\r\n", &format).unwrap();
    let expected = Point3::new(-10.0, -123.45, 100.0) * 0.0254;
    assert!((sample.position.unwrap() - expected).amax() < 1e-12);
    // 25 m, which no unit reaches.
    assert_eq!(
        decode_record(b"02  -10.00-123.45 999.99\r\n", &format),
        Err(RecordFault::Number)
    );
}

#[test]
fn bad_records_are_refused_by_name() {
    let good = bytes(F2);
    let cases: [(&str, usize, u8, RecordFault); 5] = [
        ("header", 0, b'1', RecordFault::Header),
        ("station", 1, b'5', RecordFault::Header),
        ("error byte", 2, b'*', RecordFault::Header),
        ("trailer", 31, b'!', RecordFault::Constant),
        ("quaternion", 18, 0x41, RecordFault::Number),
    ];
    for (name, index, byte, expected) in cases {
        let mut record = good.clone();
        record[index] = byte;
        assert_eq!(decode_record(&record, &binary()), Err(expected), "{name}");
    }
    let mut flagged = good;
    flagged[2] = b'k';
    flagged[3..7].copy_from_slice(&f32::NAN.to_le_bytes());
    let sample = decode_record(&flagged, &binary()).unwrap();
    assert_eq!((sample.error, sample.position), (Some(b'k'), None));
}

#[test]
fn world_axes_are_a_rotation() {
    let matrix = TrackerSpace::ZDown.world_from_axes().to_rotation_matrix();
    assert!((matrix.matrix().determinant() - 1.0).abs() < 1e-12);
}
