//! VMC: datagrams made by hand, and what angles and wrists they are.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{UnitQuaternion, Vector3};
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness, SensorCalibration};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::{GloveReading, TrackerReading};
use tsukamu_devices::session::{DeviceEvent, DeviceInfo, Session};
use tsukamu_devices::source::session::SourceSession;

use crate::support::MS;

/// Text padded as OSC has it.
fn padded(text: &str) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize((bytes.len() + 1).next_multiple_of(4), 0);
    bytes
}

/// `/VMC/Ext/Bone/Pos` or `/VMC/Ext/Root/Pos`, in Unity's space.
fn pose(address: &str, name: &str, position: [f32; 3], rotation_xyzw: [f32; 4]) -> Vec<u8> {
    let mut bytes = [padded(address), padded(",sfffffff"), padded(name)].concat();
    for number in position.iter().chain(&rotation_xyzw) {
        bytes.extend(number.to_be_bytes());
    }
    bytes
}

fn bone(name: &str, rotation_xyzw: [f32; 4]) -> Vec<u8> {
    pose("/VMC/Ext/Bone/Pos", name, [0.0; 3], rotation_xyzw)
}

pub(crate) fn time(seconds: f32) -> Vec<u8> {
    let mut bytes = [padded("/VMC/Ext/T"), padded(",f")].concat();
    bytes.extend(seconds.to_be_bytes());
    bytes
}

pub(crate) fn bundle(messages: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = b"#bundle\0\0\0\0\0\0\0\0\x01".to_vec();
    for message in messages {
        bytes.extend((message.len() as u32).to_be_bytes());
        bytes.extend(message);
    }
    bytes
}

const NO_TURN: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// A turn in Unity's space by degrees.
fn turn(axis: [f32; 3], degrees: f32) -> [f32; 4] {
    let (sin, cos) = (0.5 * degrees.to_radians()).sin_cos();
    [axis[0] * sin, axis[1] * sin, axis[2] * sin, cos]
}

/// The bones of a hand in T-pose, those of the list turned otherwise.
pub(crate) fn hand(side: &str, turned: &[(&str, [f32; 4])]) -> Vec<Vec<u8>> {
    let mut names = vec!["Hand".to_owned()];
    for finger in ["Thumb", "Index", "Middle", "Ring", "Little"] {
        for link in ["Proximal", "Intermediate", "Distal"] {
            names.push(format!("{finger}{link}"));
        }
    }
    let rotation = |name: &String| {
        let found = turned.iter().find(|(turned, _)| turned == name);
        found.map_or(NO_TURN, |(_, rotation)| *rotation)
    };
    names
        .iter()
        .map(|name| bone(&format!("{side}{name}"), rotation(name)))
        .collect()
}

pub(crate) fn opened(calibration: GloveCalibration) -> SourceSession {
    let mut session = SourceSession::vmc(calibration);
    session.port_opening(0);
    session.port_opened(0);
    session
}

pub(crate) struct Said {
    pub(crate) gloves: Vec<GloveReading>,
    pub(crate) trackers: Vec<TrackerReading>,
    info: Option<DeviceInfo>,
}

pub(crate) fn events(session: &mut SourceSession) -> Said {
    let mut said = Said {
        gloves: Vec::new(),
        trackers: Vec::new(),
        info: None,
    };
    while let Some(event) = session.next_event() {
        match event {
            DeviceEvent::Glove(reading) => said.gloves.push(reading),
            DeviceEvent::Tracker(reading) => said.trackers.push(reading),
            DeviceEvent::Identified(info) => said.info = Some(info),
            DeviceEvent::State(_) => {}
        }
    }
    said
}

/// What a session makes of two equal frames, the first of which tells what a frame has.
fn said_of(messages: &[Vec<u8>]) -> Said {
    let mut session = opened(GloveCalibration::default());
    session.push(MS, &bundle(messages));
    session.push(2 * MS, &bundle(messages));
    events(&mut session)
}

fn degrees(reading: &GloveReading, sensor: GloveSensor) -> f64 {
    reading.angle_rad(sensor).unwrap().to_degrees()
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-3, "{found} is not {expected}");
}

/// One message, byte by byte: the left index finger's first bone turned by 60° about Unity's z.
#[test]
fn a_message_of_80_bytes_decodes() {
    let by_hand = [
        &b"/VMC/Ext/Bone/Pos\0\0\0"[..],
        b",sfffffff\0\0\0",
        b"LeftIndexProximal\0\0\0",
        &[0; 12],
        // x = y = 0, z = 0.5, w = 0.8660254.
        &[
            0, 0, 0, 0, 0, 0, 0, 0, 0x3F, 0, 0, 0, 0x3F, 0x5D, 0xB3, 0xD7,
        ],
    ]
    .concat();
    assert_eq!(by_hand.len(), 80);
    assert_eq!(
        by_hand,
        bone("LeftIndexProximal", turn([0.0, 0.0, 1.0], 60.0))
    );
    let mut messages = hand("Left", &[]);
    messages[4] = by_hand;
    let reading = said_of(&messages).gloves[0];
    near(degrees(&reading, GloveSensor::IndexMcp), 60.0);
    near(degrees(&reading, GloveSensor::IndexPip), 0.0);
}

#[test]
fn a_flat_hand_is_straight() {
    for (side, which) in [("Left", Handedness::Left), ("Right", Handedness::Right)] {
        let said = said_of(&hand(side, &[]));
        assert_eq!(said.gloves.len(), 2);
        let reading = &said.gloves[0];
        assert_eq!((reading.hand, reading.angles_valid), (Some(which), true));
        for sensor in GloveSensor::ALL {
            let expected = match sensor {
                // The T-pose has the thumbs level and 45° from the fingers.
                GloveSensor::ThumbAbduction => Some(45.0),
                GloveSensor::ThumbRotation => Some(-0.7_f64.to_degrees()),
                GloveSensor::PalmArch | GloveSensor::WristFlexion | GloveSensor::WristAbduction => {
                    None
                }
                _ => Some(0.0),
            };
            match (reading.sensor(sensor), expected) {
                (Some(found), Some(expected)) => {
                    near(found.angle_rad.to_degrees(), expected);
                    near(found.raw, expected);
                }
                (found, expected) => assert_eq!(found.is_some(), expected.is_some(), "{sensor:?}"),
            }
        }
    }
}

/// In T-pose, palms down, a left finger (along -x) bends down by a positive turn about Unity's z, a right one by a
/// negative one; it spreads by turns about y.
#[test]
fn bends_and_spreads_are_those_of_the_hand_and_mirrored() {
    for (side, sign, station) in [("Left", 1.0, 1), ("Right", -1.0, 2)] {
        let down = |degrees: f32| turn([0.0, 0.0, 1.0], sign * degrees);
        // Forward is toward the thumb.
        let forward = |degrees: f32| turn([0.0, 1.0, 0.0], sign * degrees);
        let said = said_of(&hand(
            side,
            &[
                ("IndexProximal", down(30.0)),
                ("IndexIntermediate", down(70.0)),
                ("IndexDistal", down(20.0)),
                ("MiddleProximal", down(100.0)),
                ("LittleProximal", forward(-25.0)),
                ("RingProximal", forward(-5.0)),
                ("ThumbIntermediate", forward(-35.0)),
                ("ThumbDistal", forward(-15.0)),
            ],
        ));
        let reading = &said.gloves[0];
        for (sensor, expected) in [
            (GloveSensor::IndexMcp, 30.0),
            (GloveSensor::IndexPip, 70.0),
            (GloveSensor::IndexDip, 20.0),
            (GloveSensor::MiddleMcp, 100.0),
            (GloveSensor::MiddleIndexAbduction, 0.0),
            (GloveSensor::RingMiddleAbduction, 5.0),
            (GloveSensor::LittleRingAbduction, 20.0),
            (GloveSensor::LittleMcp, 0.0),
            (GloveSensor::ThumbMcp, 35.0),
            (GloveSensor::ThumbIp, 15.0),
            (GloveSensor::ThumbAbduction, 45.0),
        ] {
            near(degrees(reading, sensor), expected);
        }
        assert_eq!(said.trackers[0].station, station);
    }
}

/// The avatar stands at (1, 0, 2) in Unity's space and looks along +z; its right upper arm points to the front, the
/// rest of it goes on straight.
#[test]
fn a_wrist_is_at_the_end_of_its_arm() {
    let at = |name: &str, position: [f32; 3], rotation: [f32; 4]| {
        pose("/VMC/Ext/Bone/Pos", name, position, rotation)
    };
    let mut messages = vec![
        time(2.5),
        pose("/VMC/Ext/Root/Pos", "root", [1.0, 0.0, 2.0], NO_TURN),
        at("Hips", [0.0, 1.0, 0.0], NO_TURN),
        at("Spine", [0.0, 0.4, 0.0], NO_TURN),
        // In Unity a negative turn about y takes right (x) to the front (z).
        at(
            "RightUpperArm",
            [0.2, 0.0, 0.0],
            turn([0.0, 1.0, 0.0], -90.0),
        ),
        at("RightLowerArm", [0.3, 0.0, 0.0], NO_TURN),
    ];
    messages.extend(hand("Right", &[]));
    messages[6] = at("RightHand", [0.25, 0.0, 0.0], NO_TURN);
    let said = said_of(&messages);
    let reading = &said.trackers[0];
    let pose = reading.world_from_sensor().unwrap();
    // x right, y up, -z forward.
    let expected = Vector3::new(1.2, 1.4, -(2.0 + 0.55));
    assert!((pose.translation.vector - expected).norm() < 1e-6, "{pose}");
    // The fingers point to the front and the palm down: the wrist's axes are the world's.
    assert!(pose.rotation.angle() < 1e-6, "{}", pose.rotation);
    assert_eq!(reading.device_ticks, Some(2_500_000));
    assert_eq!(said.gloves[0].device_ticks, Some(2_500_000));
    let info = said.info.unwrap();
    assert_eq!(
        (info.hand, info.tick_ns),
        (Some(Handedness::Right), Some(1000.0))
    );
    assert_eq!(info.identity, "right hand, placed by the bones of its arm");
}

#[test]
fn a_hand_without_an_arm_says_so() {
    // Turned up by a right angle: the fingers of the left hand point up.
    let mut messages = hand("Left", &[]);
    messages[0] = pose(
        "/VMC/Ext/Bone/Pos",
        "LeftHand",
        [0.1, 0.2, 0.3],
        turn([0.0, 0.0, 1.0], -90.0),
    );
    let said = said_of(&messages);
    let info = said.info.unwrap();
    assert!(
        info.identity.starts_with("left hand, not placed"),
        "{}",
        info.identity
    );
    let pose = said.trackers[0].world_from_sensor().unwrap();
    assert!((pose.translation.vector - Vector3::new(0.1, 0.2, -0.3)).norm() < 1e-6);
    assert!((pose.rotation * -Vector3::z() - Vector3::y()).norm() < 1e-6);
}

#[test]
fn a_wearer_s_calibration_holds_for_a_source_too() {
    let mut calibration = GloveCalibration::default();
    let half = SensorCalibration {
        raw_at_zero: 10.0,
        gain_deg_per_count: 0.5,
        min_deg: -20.0,
        max_deg: 90.0,
        coupling: None,
    };
    calibration.sensors.insert(GloveSensor::IndexPip, half);
    let mut session = opened(calibration);
    let bent = hand(
        "Left",
        &[("IndexIntermediate", turn([0.0, 0.0, 1.0], 70.0))],
    );
    session.push(MS, &bundle(&bent));
    session.push(2 * MS, &bundle(&bent));
    let reading = events(&mut session).gloves[0];
    near(reading.sensor(GloveSensor::IndexPip).unwrap().raw, 70.0);
    near(degrees(&reading, GloveSensor::IndexPip), 30.0);
    near(degrees(&reading, GloveSensor::MiddlePip), 0.0);
}

#[test]
fn quaternions_that_are_none_leave_the_bone_out() {
    let mut messages = hand("Left", &[]);
    messages[5] = bone("LeftIndexIntermediate", [0.0; 4]);
    messages[8] = bone("LeftMiddleIntermediate", [f32::NAN; 4]);
    let reading = said_of(&messages).gloves[0];
    assert_eq!(reading.sensor(GloveSensor::IndexMcp), None);
    assert_eq!(reading.sensor(GloveSensor::MiddlePip), None);
    assert!(reading.sensor(GloveSensor::RingPip).is_some());
    // A rotation written with few digits is one.
    let reading = said_of(&hand("Left", &[("RingProximal", [0.0, 0.0, 0.71, 0.71])])).gloves[0];
    near(
        degrees(&reading, GloveSensor::RingMcp),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2)
            .angle()
            .to_degrees(),
    );
}
