//! The worked examples C1 to C7 of the protocol reference.

use tsukamu_devices::glove::calibrate::SensorCalibration;
use tsukamu_devices::glove::cyberglove::decode::{
    RecordFault, RecordLayout, Sample, Status, decode_record,
};
use tsukamu_devices::glove::cyberglove::high_resolution::{self, HighResolutionFault};
use tsukamu_devices::glove::sensor::{GloveSensor, SensorMask};

use crate::support::bytes;

const EIGHTEEN: &str = "78 40 47 82 5C 3C 5A 3A 6E 5F 3D 69 63 42 70 58 8C 7F";
const EIGHTEEN_RAW: [u16; 18] = [
    120, 64, 71, 130, 92, 60, 90, 58, 110, 95, 61, 105, 99, 66, 112, 88, 140, 127,
];

fn layout(letter: u8, mask: SensorMask) -> RecordLayout {
    RecordLayout {
        letter,
        mask,
        stamp: false,
        status: false,
    }
}

/// Decodes a record given with its NUL.
fn decode(hex: &str, layout: &RecordLayout) -> Result<Sample, RecordFault> {
    let record = bytes(hex);
    let (nul, body) = record.split_last().unwrap();
    assert_eq!(*nul, 0);
    decode_record(body, layout)
}

fn raw(sample: &Sample) -> Vec<u16> {
    sample.raw.iter().flatten().copied().collect()
}

#[test]
fn c1_22_sensors_polled() {
    let sample = decode(
        "47 01 4C 5D 71 59 2A 14 4D 62 6A 75 51 3E 17 34 3C 22 44 39 FE 5C 1A 00",
        &layout(b'G', SensorMask::TWENTY_TWO),
    )
    .unwrap();
    let expected = [
        1, 76, 93, 113, 89, 42, 20, 77, 98, 106, 117, 81, 62, 23, 52, 60, 34, 68, 57, 254, 92, 26,
    ];
    assert_eq!(raw(&sample), expected);
    assert_eq!(sample.raw[GloveSensor::IndexMcp.slot()], Some(89));
    assert_eq!(sample.raw[GloveSensor::PalmArch.slot()], Some(254));
    assert_eq!((sample.status, sample.error), (None, None));
}

#[test]
fn c2_18_sensors_streaming_with_status() {
    let sample = decode(
        &format!("53 {EIGHTEEN} 83 00"),
        &RecordLayout {
            status: true,
            ..layout(b'S', SensorMask::EIGHTEEN)
        },
    )
    .unwrap();
    assert_eq!(raw(&sample), EIGHTEEN_RAW);
    assert_eq!(
        sample.raw[GloveSensor::MiddleIndexAbduction.slot()],
        Some(110)
    );
    assert_eq!(sample.raw[GloveSensor::IndexDip.slot()], None);
    let status = Status {
        plugged_in: true,
        switch_on: true,
        light_on: false,
    };
    assert_eq!(sample.status, Some(status));
}

#[test]
fn c3_unplugged() {
    let sample = decode(
        &format!("47 {EIGHTEEN} 65 67 00"),
        &layout(b'G', SensorMask::EIGHTEEN),
    )
    .unwrap();
    assert_eq!(raw(&sample), EIGHTEEN_RAW);
    assert_eq!(sample.error, Some(b'g'));
}

#[test]
fn c4_time_stamp_and_status() {
    let sample = decode(
        &format!("47 {EIGHTEEN} 8A 34 02 01 08 81 00"),
        &RecordLayout {
            stamp: true,
            status: true,
            ..layout(b'G', SensorMask::EIGHTEEN)
        },
    )
    .unwrap();
    assert_eq!(sample.device_ticks, Some(65_588));
    let status = sample.status.unwrap();
    assert!(status.plugged_in && !status.switch_on && !status.light_on);
}

#[test]
fn c5_high_resolution() {
    let mut record: [u8; high_resolution::LENGTH] = bytes(
        "31 30 3A 32 32 3A 30 35 3A 31 37 3A 31 53 00 11 04 C0 05 D0 07 10 05 90 02 A0 01 40 04 D0 06 20 06 A0 07 50 \
         05 10 03 E0 01 70 03 40 03 C0 02 20 04 40 03 90 0F E0 05 C0 01 A0 0D 0A 00",
    )
    .try_into()
    .unwrap();
    let sample = high_resolution::decode(&record).unwrap();
    assert_eq!(sample.time_of_day, [10, 22, 5]);
    assert_eq!((sample.frame, sample.sub_frame), (17, 1));
    assert_eq!(sample.raw[..5], [17, 1216, 1488, 1808, 1424]);
    record[58] = 0;
    assert_eq!(
        high_resolution::decode(&record),
        Err(HighResolutionFault::Terminator)
    );
}

// C6, the questions, are in `reply.rs`, whose cases they are.

#[test]
fn c7_two_point_calibration() {
    let first = (62.0, 0.0_f64.to_degrees());
    let second = (199.0, (-1.7_f64).to_degrees());
    let line = SensorCalibration::from_two_points(first, second).unwrap();
    let gain_rad = line.gain_deg_per_count.to_radians();
    assert!((gain_rad + 0.012_408_8).abs() < 1e-7, "{gain_rad}");
    assert!((line.raw_at_zero - 62.0).abs() < 1e-9);
    let angle_deg = line.gain_deg_per_count * (130.0 - line.raw_at_zero);
    assert!((angle_deg + 48.346).abs() < 1e-3, "{angle_deg}");
    assert!(SensorCalibration::from_two_points(first, first).is_none());
}

#[test]
fn records_with_a_lost_byte_are_refused() {
    let with_status = RecordLayout {
        status: true,
        ..layout(b'S', SensorMask::EIGHTEEN)
    };
    let whole = bytes(&format!("53 {EIGHTEEN} 83"));
    assert!(decode_record(&whole, &with_status).is_ok());
    for lost in 0..whole.len() {
        let mut record = whole.clone();
        record.remove(lost);
        assert!(
            decode_record(&record, &with_status).is_err(),
            "byte {lost} lost"
        );
    }
    // What has the right length is still checked.
    let cases = [
        ("53", "03", RecordFault::Status),
        ("47", "83", RecordFault::Letter),
    ];
    for (letter, status, expected) in cases {
        let record = bytes(&format!("{letter} {EIGHTEEN} {status}"));
        assert_eq!(decode_record(&record, &with_status), Err(expected));
    }
}
