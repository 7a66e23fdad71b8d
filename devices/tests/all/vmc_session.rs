//! VMC: frames over several datagrams, losses, silence, and the emulator.

use nalgebra::{Isometry3, Vector3};
use tsukamu_devices::emulate::source::{SentHand, SourceEmulator, SourceKind};
use tsukamu_devices::fault::Fault;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::session::{Session, SessionState};
use tsukamu_devices::source::session::SourceSession;

use crate::support::{Bench, MS, S};
use crate::vmc::{bundle, events, hand, opened, time};

#[test]
fn a_frame_over_several_datagrams_is_one_reading() {
    let mut session = opened(GloveCalibration::default());
    let frame: Vec<Vec<u8>> = [hand("Left", &[]), hand("Right", &[])].concat();
    for k in 0..10 {
        for (part, messages) in frame.chunks(5).enumerate() {
            session.push((k * 16 + part as u64) * MS, &bundle(messages));
        }
    }
    let said = events(&mut session);
    assert_eq!((said.gloves.len(), said.trackers.len()), (20, 20));
    let left: Vec<u64> = said
        .gloves
        .iter()
        .filter(|reading| reading.hand == Some(Handedness::Left))
        .map(|reading| reading.stamp_ns)
        .collect();
    // Each has the stamp of its own last datagram: the fourth has the left hand's sixteenth bone.
    let expected: Vec<u64> = (0..10).map(|k| (k * 16 + 3) * MS).collect();
    assert_eq!(left, expected);
    assert_eq!(session.stats().dropped_records, 0);
}

#[test]
fn a_lost_datagram_costs_its_frame_alone() {
    let mut session = opened(GloveCalibration::default());
    let frame = hand("Left", &[]);
    for k in 0..20_u64 {
        for (part, messages) in frame.chunks(5).enumerate() {
            if k != 10 || part != 3 {
                session.push((k * 16 + part as u64) * MS, &bundle(messages));
            }
        }
    }
    let said = events(&mut session);
    let stamps: Vec<u64> = said.gloves.iter().map(|reading| reading.stamp_ns).collect();
    let late: Vec<u64> = stamps
        .iter()
        .copied()
        .filter(|stamp_ns| stamp_ns % (16 * MS) != 3 * MS)
        .collect();
    // What that frame had is given out when the next begins, with the stamp of its last datagram.
    assert_eq!(late, [(10 * 16 + 2) * MS]);
    assert_eq!(stamps.len(), 20);
}

#[test]
fn the_emulator_is_read_as_it_was_posed() {
    let mut emulator = SourceEmulator::new(SourceKind::Vmc);
    let mut sent = SentHand::flat();
    for (sensor, degrees) in [
        (GloveSensor::ThumbRotation, 20.0),
        (GloveSensor::ThumbAbduction, 35.0),
        (GloveSensor::ThumbMcp, 25.0),
        (GloveSensor::ThumbIp, 40.0),
        (GloveSensor::IndexMcp, 80.0),
        (GloveSensor::IndexPip, 95.0),
        (GloveSensor::IndexDip, 50.0),
        (GloveSensor::MiddleIndexAbduction, 8.0),
        (GloveSensor::RingMiddleAbduction, 6.0),
        (GloveSensor::LittleRingAbduction, 12.0),
        (GloveSensor::LittlePip, 33.0),
    ] {
        sent.angles[sensor.slot()] = Some(f64::to_radians(degrees));
    }
    sent.world_from_wrist =
        Isometry3::new(Vector3::new(0.2, 1.1, -0.4), Vector3::new(0.3, -0.8, 0.5));
    let mut left = sent;
    left.world_from_wrist.translation.vector.x = -0.2;
    emulator.set_hand(Handedness::Left, Some(left));
    emulator.set_hand(Handedness::Right, Some(sent));
    let mut bench = Bench::new(SourceSession::vmc(GloveCalibration::default()), emulator);
    bench.open();
    bench.run_for(S);
    let gloves = bench.gloves();
    assert!(gloves.len() > 100, "{}", gloves.len());
    for reading in &gloves {
        for sensor in GloveSensor::ALL {
            if let Some(found) = reading.sensor(sensor) {
                let expected = sent.angles[sensor.slot()].unwrap_or(0.0);
                assert!((found.angle_rad - expected).abs() < 1e-4, "{sensor:?}");
            }
        }
    }
    for reading in bench.trackers() {
        let expected = if reading.station == 1 { left } else { sent };
        let found = reading.world_from_sensor().unwrap();
        let off = expected.world_from_wrist.inverse() * found;
        assert!(
            off.translation.vector.norm() < 1e-5 && off.rotation.angle() < 1e-3,
            "{off}"
        );
    }
}

#[test]
fn silence_and_junk_and_faces_are_told_apart() {
    let mut session = SourceSession::vmc(GloveCalibration::default());
    session.port_opening(0);
    session.port_opened(0);
    assert_eq!(session.state(), SessionState::Querying);
    session.handle_timeout(S);
    assert_eq!(session.state(), SessionState::Stalled);
    assert_eq!(
        session.fault(),
        Some(&Fault::NothingArrives { device: "VMC" })
    );
    session.push(S + MS, b"{\"not\": 1}");
    session.handle_timeout(2 * S);
    assert_eq!(
        session.fault(),
        Some(&Fault::Undecodable {
            device: "VMC",
            detail: "no OSC address".to_owned(),
            first_bytes: "7B 22 6E 6F 74 22 3A 20 31 7D".to_owned(),
        })
    );
    session.push(2 * S + MS, &time(1.0));
    session.handle_timeout(3 * S);
    assert_eq!(session.fault(), Some(&Fault::NoHand { device: "VMC" }));
    let frame = bundle(&hand("Left", &[]));
    session.push(3 * S + MS, &frame);
    session.push(3 * S + 2 * MS, &frame);
    assert_eq!(
        (session.state(), session.fault()),
        (SessionState::Running, None)
    );
    assert_eq!(session.stats().dropped_records, 1);
}

#[test]
fn a_sender_that_comes_back_is_heard_from_its_second_frame_on() {
    let mut emulator = SourceEmulator::new(SourceKind::Vmc);
    emulator.set_hand(Handedness::Right, Some(SentHand::flat()));
    let mut bench = Bench::new(SourceSession::vmc(GloveCalibration::default()), emulator);
    bench.open();
    bench.run_until(S, |bench| bench.session.state() == SessionState::Running);
    bench.emulator.faults.freeze();
    bench.run_until(2 * S, |bench| {
        bench.session.state() == SessionState::Stalled
    });
    bench.emulator.faults.thaw();
    let took_ns = bench.run_until(S, |bench| bench.session.state() == SessionState::Running);
    assert!(took_ns <= 40 * MS, "{took_ns}");
}
