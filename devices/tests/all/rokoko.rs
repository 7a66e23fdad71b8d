//! Rokoko: JSON made by hand, plain and compressed, and what hands it is.

use nalgebra::{Isometry3, Vector3};
use tsukamu_devices::emulate::source::{SentHand, SourceEmulator, SourceKind};
use tsukamu_devices::fault::Fault;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::{GloveReading, TrackerReading};
use tsukamu_devices::session::{DeviceEvent, Session};
use tsukamu_devices::source::rokoko::settings::RokokoSettings;
use tsukamu_devices::source::session::SourceSession;

use crate::support::{Bench, MS, S};

/// The joints of a right hand at a place in Unity's space, palm down, fingers to the front (+z), the ring finger bent
/// by a right angle at the knuckle.
fn body(x: f64) -> String {
    let mut joints = vec![("rightHand".to_owned(), [x, 1.0, 0.5])];
    let names = ["Proximal", "Medial", "Distal", "Tip"];
    for (finger, aside) in [
        ("Index", -0.02),
        ("Middle", 0.0),
        ("Ring", 0.02),
        ("Little", 0.04),
    ] {
        for (name, along) in names.iter().zip([0.0, 0.04, 0.07, 0.09]) {
            let place = if finger == "Ring" {
                [x + aside, 1.0 - along, 0.59]
            } else {
                [x + aside, 1.0, 0.59 + along]
            };
            joints.push((format!("right{finger}{name}"), place));
        }
    }
    for (name, along) in names.iter().zip([0.0, 0.03, 0.06, 0.08]) {
        joints.push((
            format!("rightThumb{name}"),
            [x - 0.03 - along, 1.0, 0.53 + along],
        ));
    }
    let joints: Vec<String> = joints
        .iter()
        .map(|(name, [x, y, z])| {
            format!(
                r#""{name}":{{"position":{{"x":{x},"y":{y},"z":{z}}},"rotation":{{"x":0,"y":0,"z":0,"w":1}}}}"#
            )
        })
        .collect();
    format!("{{{}}}", joints.join(","))
}

fn actor(name: &str, x: f64, meta: &str) -> String {
    format!(
        r#"{{"name":"{name}","meta":{{{meta}}},"body":{}}}"#,
        body(x)
    )
}

fn frame(actors: &[String]) -> Vec<u8> {
    let actors = actors.join(",");
    let text = format!(
        r#"{{"version":"3,0","fps":60.0,"scene":{{"timestamp":12.5,"actors":[{actors}],"props":[{{"name":"p"}}]}}}}"#
    );
    text.into_bytes()
}

fn read(settings: &RokokoSettings, datagram: &[u8]) -> (Vec<GloveReading>, Vec<TrackerReading>) {
    let mut session = SourceSession::rokoko(settings, GloveCalibration::default());
    session.port_opened(0);
    session.push(MS, datagram);
    let (mut gloves, mut trackers) = (Vec::new(), Vec::new());
    while let Some(event) = session.next_event() {
        match event {
            DeviceEvent::Glove(reading) => gloves.push(reading),
            DeviceEvent::Tracker(reading) => trackers.push(reading),
            _ => {}
        }
    }
    (gloves, trackers)
}

fn check(gloves: &[GloveReading], trackers: &[TrackerReading], x: f64) {
    assert_eq!((gloves.len(), trackers.len()), (1, 1));
    let reading = &gloves[0];
    assert_eq!(reading.hand, Some(Handedness::Right));
    assert_eq!(reading.device_ticks, Some(12_500_000));
    for sensor in GloveSensor::ALL {
        let expected = match sensor {
            GloveSensor::RingMcp => 90.0,
            GloveSensor::ThumbAbduction => 45.0,
            GloveSensor::ThumbRotation => -0.7_f64.to_degrees(),
            _ => 0.0,
        };
        if let Some(found) = reading.angle_rad(sensor) {
            assert!(
                (found.to_degrees() - expected).abs() < 1e-6,
                "{sensor:?} {found}"
            );
        }
    }
    assert_eq!(trackers[0].station, 2);
    let pose = trackers[0].world_from_sensor().unwrap();
    assert!((pose.translation.vector - Vector3::new(x, 1.0, -0.5)).norm() < 1e-9);
    assert!(pose.rotation.angle() < 1e-6);
}

#[test]
fn a_frame_is_a_hand_and_its_wrist() {
    let (gloves, trackers) = read(&RokokoSettings::default(), &frame(&[actor("a", 0.25, "")]));
    check(&gloves, &trackers, 0.25);
}

#[test]
fn the_actor_that_is_named_is_taken() {
    let both = frame(&[actor("a", 0.25, ""), actor("b", -0.75, "\"hasFace\":true")]);
    let (gloves, trackers) = read(&RokokoSettings::default(), &both);
    check(&gloves, &trackers, 0.25);
    let named = |name: &str| RokokoSettings {
        actor: Some(name.to_owned()),
    };
    let (gloves, trackers) = read(&named("b"), &both);
    check(&gloves, &trackers, -0.75);
    assert_eq!(read(&named("c"), &both), (Vec::new(), Vec::new()));
}

#[test]
fn a_body_without_gloves_has_wrists_and_no_fingers() {
    let frame = frame(&[actor(
        "a",
        0.0,
        "\"hasLeftGlove\":false,\"hasRightGlove\":false",
    )]);
    let (gloves, trackers) = read(&RokokoSettings::default(), &frame);
    assert_eq!((gloves.len(), trackers.len()), (0, 1));
}

/// Made by `lz4 -z` 1.9.4 from "{\"scene\":{\"actors\":[]}}" and 200 blanks: a frame with content size and checksum, and
/// a match that overlaps itself.
const LZ4_BY_TOOL: &str = "04 22 4D 18 6C 40 DF 00 00 00 00 00 00 00 B2 23 00 00 00 FF 09 7B 22 73 63 65 6E 65 22 3A 7B 22 61 63 74 6F 72 73 22 3A 5B 5D 7D 7D 20 01 00 AF 50 20 20 20 20 20 00 00 00 00 34 07 03 73";

#[test]
fn a_frame_of_another_program_is_unpacked() {
    let bytes = crate::support::bytes(LZ4_BY_TOOL);
    let mut session =
        SourceSession::rokoko(&RokokoSettings::default(), GloveCalibration::default());
    session.port_opened(0);
    session.push(MS, &bytes);
    assert_eq!(session.stats().dropped_records, 0);
    session.handle_timeout(S);
    // It is read, and has no actor.
    assert_eq!(session.fault(), Some(&Fault::NoHand { device: "Rokoko" }));
    for cut in 0..bytes.len() - 8 {
        session.push(2 * S, &bytes[..cut]);
    }
    assert_eq!(session.stats().dropped_records, bytes.len() as u64 - 8);
}

/// A bare block by hand: a token for 15 + n literals and no match.
#[test]
fn a_bare_block_is_unpacked() {
    let json = frame(&[actor("a", 0.25, "")]);
    let mut block = vec![0xF0];
    let mut rest = json.len() - 15;
    while rest >= 255 {
        block.push(255);
        rest -= 255;
    }
    block.push(rest as u8);
    block.extend(&json);
    let (gloves, trackers) = read(&RokokoSettings::default(), &block);
    check(&gloves, &trackers, 0.25);
}

/// A block that grows without end stops at a bound: 1 literal, then matches of 64 KiB and more.
#[test]
fn a_bomb_does_not_go_off() {
    let mut block = vec![0x1F, b'{', 1, 0];
    block.extend([255; 60_000]);
    block.extend([0, 0x00]);
    let mut session =
        SourceSession::rokoko(&RokokoSettings::default(), GloveCalibration::default());
    session.port_opened(0);
    session.push(MS, &block);
    assert_eq!(session.stats().dropped_records, 1);
}

#[test]
fn the_emulator_is_read_as_it_was_posed() {
    for kind in [SourceKind::Rokoko, SourceKind::RokokoLz4] {
        let mut emulator = SourceEmulator::new(kind);
        let mut sent = SentHand::flat();
        for (sensor, degrees) in [
            (GloveSensor::ThumbRotation, 20.0),
            (GloveSensor::ThumbAbduction, 35.0),
            (GloveSensor::ThumbMcp, 25.0),
            (GloveSensor::ThumbIp, 40.0),
            (GloveSensor::IndexMcp, 80.0),
            (GloveSensor::IndexPip, 95.0),
            (GloveSensor::MiddleIndexAbduction, 8.0),
            (GloveSensor::LittleRingAbduction, 12.0),
            (GloveSensor::LittlePip, 33.0),
        ] {
            sent.angles[sensor.slot()] = Some(f64::to_radians(degrees));
        }
        sent.world_from_wrist =
            Isometry3::new(Vector3::new(0.2, 1.1, -0.4), Vector3::new(0.3, -0.8, 0.5));
        emulator.set_hand(Handedness::Left, Some(sent));
        emulator.set_hand(Handedness::Right, Some(sent));
        let settings = RokokoSettings::default();
        let session = SourceSession::rokoko(&settings, GloveCalibration::default());
        let mut bench = Bench::new(session, emulator);
        bench.open();
        bench.run_for(S);
        let gloves = bench.gloves();
        assert!(gloves.len() > 100, "{}", gloves.len());
        for reading in &gloves {
            for sensor in GloveSensor::ALL {
                if let Some(found) = reading.sensor(sensor) {
                    let expected = sent.angles[sensor.slot()].unwrap_or(0.0);
                    assert!((found.angle_rad - expected).abs() < 1e-6, "{sensor:?}");
                }
            }
        }
        for reading in bench.trackers() {
            let off = sent.world_from_wrist.inverse() * reading.world_from_sensor().unwrap();
            assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-6);
        }
    }
}

#[test]
fn junk_says_what_to_choose_in_the_sender() {
    let mut session =
        SourceSession::rokoko(&RokokoSettings::default(), GloveCalibration::default());
    session.port_opened(0);
    session.push(MS, &[0xFF; 40]);
    session.handle_timeout(S);
    let fault = session.fault().unwrap().to_string();
    assert!(fault.contains("choose JSON v3 in the sender"), "{fault}");
}
