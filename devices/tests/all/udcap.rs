//! UDCAP: JSON made by hand, and what angles it is.

use tsukamu_devices::emulate::source::{SentHand, SourceEmulator, SourceKind};
use tsukamu_devices::fault::Fault;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::GloveReading;
use tsukamu_devices::session::{DeviceEvent, Session, SessionState};
use tsukamu_devices::source::session::SourceSession;

use crate::support::{Bench, MS, S};

fn readings(datagram: &[u8]) -> Vec<GloveReading> {
    let mut session = SourceSession::udcap(GloveCalibration::default());
    session.port_opened(0);
    session.push(MS, datagram);
    std::iter::from_fn(|| session.next_event())
        .filter_map(|event| match event {
            DeviceEvent::Glove(reading) => Some(reading),
            _ => None,
        })
        .collect()
}

fn degrees(reading: &GloveReading, sensor: GloveSensor) -> Option<f64> {
    reading.angle_rad(sensor).map(f64::to_degrees)
}

#[test]
fn an_object_behind_other_bytes_decodes() {
    let datagram = br#"junk{x}{"Parameter":[{"Name":"l6","Value":-60.0},{"Name":"l5","Value":-45},
        {"Name":"l4","Value":-1.5e1},{"Name":"l7","Value":-10},{"Name":"l11","Value":2},
        {"Name":"l20","Value":30},{"Name":"l2","Value":-20},{"Name":"battery","Value":88},
        {"Name":"l99","Value":1},{"Name":"l8","Value":1e9}],"Other":{}}trailing"#;
    let found = readings(datagram);
    assert_eq!(found.len(), 1);
    let reading = &found[0];
    assert_eq!(reading.hand, Some(Handedness::Left));
    for (sensor, raw, angle) in [
        (GloveSensor::IndexMcp, -60.0, 60.0),
        (GloveSensor::IndexPip, -45.0, 45.0),
        (GloveSensor::IndexDip, -15.0, 15.0),
        (GloveSensor::MiddleIndexAbduction, -12.0, 12.0),
        (GloveSensor::ThumbRotation, 30.0, 30.0),
        (GloveSensor::ThumbAbduction, -20.0, 25.0),
    ] {
        assert_eq!(reading.sensor(sensor).unwrap().raw, raw, "{sensor:?}");
        let found = degrees(reading, sensor).unwrap();
        assert!((found - angle).abs() < 1e-9, "{sensor:?} {found}");
    }
    assert_eq!(degrees(reading, GloveSensor::RingMcp), None, "not sent");
    assert_eq!(degrees(reading, GloveSensor::MiddleDip), None, "no angle");
}

#[test]
fn both_hands_come_in_one_object() {
    let datagram = br#"{"Parameter":[{"Name":"r16","Value":-5},{"Name":"l16","Value":-7}]}"#;
    let found = readings(datagram);
    let hands: Vec<_> = found
        .iter()
        .map(|reading| {
            (
                reading.hand,
                degrees(reading, GloveSensor::LittleDip).map(f64::round),
            )
        })
        .collect();
    assert_eq!(
        hands,
        [
            (Some(Handedness::Left), Some(7.0)),
            (Some(Handedness::Right), Some(5.0))
        ]
    );
}

#[test]
fn what_is_no_message_is_counted_and_named() {
    let mut session = SourceSession::udcap(GloveCalibration::default());
    session.port_opened(0);
    for junk in [
        &b""[..],
        b"hello",
        b"{\"Parameter\":[{\"Name\":\"l0\"}]}",
        b"{\"Parameter\":[{\"Name\":\"l0\",\"Value\":NaN}]}",
        b"{\"Parameter\":3}",
        b"{\"",
    ] {
        session.push(MS, junk);
    }
    assert_eq!(session.stats().dropped_records, 6);
    assert_eq!(session.stats().resyncs, 1, "one run of bad ones");
    session.handle_timeout(S);
    assert_eq!(session.state(), SessionState::Stalled);
    assert!(matches!(session.fault(), Some(Fault::Undecodable { .. })));
    session.push(S, b"{\"Parameter\":[]}");
    session.handle_timeout(2 * S);
    assert_eq!(session.fault(), Some(&Fault::NoHand { device: "UDCAP" }));
}

#[test]
fn the_emulator_is_read_as_it_was_posed() {
    let mut emulator = SourceEmulator::new(SourceKind::Udcap);
    let mut sent = SentHand::flat();
    for (k, sensor) in GloveSensor::ALL.into_iter().enumerate() {
        sent.angles[sensor.slot()] = Some(0.02 * k as f64);
    }
    emulator.set_hand(Handedness::Right, Some(sent));
    let mut bench = Bench::new(SourceSession::udcap(GloveCalibration::default()), emulator);
    bench.open();
    bench.run_for(S);
    let gloves = bench.gloves();
    assert!(gloves.len() > 50, "{}", gloves.len());
    for reading in &gloves {
        assert_eq!(reading.hand, Some(Handedness::Right));
        assert_eq!(reading.sensors.iter().flatten().count(), 19);
        for sensor in GloveSensor::ALL {
            if let Some(found) = reading.sensor(sensor) {
                let expected = sent.angles[sensor.slot()].unwrap();
                assert!((found.angle_rad - expected).abs() < 1e-9, "{sensor:?}");
            }
        }
    }
}
