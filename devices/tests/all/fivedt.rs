//! 5DT gloves: the reference's examples, both ways, and what is read out of them.

use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::fivedt::FiveDtEmulator;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::fivedt::checksum::Rule;
use tsukamu_devices::glove::fivedt::format::FiveDtSession;
use tsukamu_devices::glove::fivedt::long_packet::{About, decode_data};
use tsukamu_devices::glove::fivedt::settings::{FiveDtSettings, FlexureOrder, Model};
use tsukamu_devices::glove::fivedt::short_packet::{Information, ShortPacket, parts};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::GloveReading;
use tsukamu_devices::session::{DeviceEvent, DeviceInfo, Session};

use crate::support::{MS, S, bytes};

const D1: &str = "80 0A 14 1E 28 FA 80 40 9E";
const D2: &str = "3C 44 00 64 01 5E 02 58 03 52 04 4C 05 46 06 40 07 3A 08 34 09 2E 0A 28 0B 22 0C 1C 0D 16 \
                  0E 10 0F 0A 00 3E";

pub(crate) fn session(model: Model) -> FiveDtSession {
    let settings = FiveDtSettings {
        model,
        ..FiveDtSettings::default()
    };
    FiveDtSession::new(settings, GloveCalibration::default())
}

/// What a session that has just been opened reads from these bytes, and what it says of the device.
fn read(mut session: FiveDtSession, said: &[u8]) -> (Vec<GloveReading>, Option<DeviceInfo>) {
    session.port_opened(0);
    session.push(MS, said);
    let mut readings = Vec::new();
    let mut info = None;
    while let Some(event) = session.next_event() {
        match event {
            DeviceEvent::Glove(reading) => readings.push(reading),
            DeviceEvent::Identified(said) => info = Some(said),
            _ => {}
        }
    }
    (readings, info)
}

fn raw(reading: &GloveReading) -> Vec<f64> {
    let sensors = reading.sensors.iter().flatten();
    sensors.map(|sensor| sensor.raw).collect()
}

#[test]
fn d1_is_five_flexures_and_a_tilt() {
    let record = bytes(D1);
    let packet = ShortPacket::decode(record.as_slice().try_into().unwrap()).unwrap();
    assert_eq!(packet.flexures, [10, 20, 30, 40, 250]);
    assert_eq!((packet.pitch, packet.roll, packet.check), (128, 64, 0x9E));
    let share = packet.flexures.map(|flexure| f64::from(flexure) / 255.0);
    for (share, expected) in share.iter().zip([0.0392, 0.0784, 0.1176, 0.1569, 0.9804]) {
        assert!((share - expected).abs() < 5.0e-5);
    }
    let parts = parts(&record);
    assert_eq!(Rule::Sum.of(parts.header, parts.body), 0x9E);
    assert_eq!(Rule::SumOfBody.of(parts.header, parts.body), 0x1E);
    assert_eq!(ShortPacket::decode([0; 9]), None);
}

#[test]
fn d1_over_a_cable_bends_the_joints() {
    // The answers to `A` and `G`, then the stream; the last record waits for the next.
    let mut information = bytes("42 52 01 02 01 1F");
    information.resize(16, 0);
    information.extend(b"Glove 5\0");
    information.resize(32, 0);
    let said = [bytes("55"), information, bytes(D1), bytes(D1), bytes("80")].concat();
    let (readings, info) = read(session(Model::Five), &said);
    assert_eq!(readings.len(), 2);
    let reading = readings[0];
    let info = info.unwrap();
    assert_eq!(
        (info.firmware.as_str(), info.identity.as_str()),
        ("1.2", "Glove 5")
    );
    assert_eq!((info.n_sensors, info.hand), (5, Some(Handedness::Right)));
    assert_eq!(reading.hand, Some(Handedness::Right));
    let deg = |sensor| reading.angle_rad(sensor).unwrap().to_degrees();
    // One flexure, two joints: 20 of 255 of 90° and of 100°.
    assert!((deg(GloveSensor::IndexMcp) - 90.0 * 20.0 / 255.0).abs() < 1e-9);
    assert!((deg(GloveSensor::IndexPip) - 100.0 * 20.0 / 255.0).abs() < 1e-9);
    assert!((deg(GloveSensor::LittleMcp) - 90.0 * 250.0 / 255.0).abs() < 1e-9);
    assert_eq!(reading.sensor(GloveSensor::IndexDip), None);
    // 128 and 64 of 255 are 90.35° and 45.18° of 180°; the axes count from the middle.
    let [pitch, roll, ..] = reading
        .controls
        .axes
        .map(|axis| axis.map(|axis| 90.0 + 90.0 * axis));
    assert!((pitch.unwrap() - 90.35).abs() < 5e-3 && (roll.unwrap() - 45.18).abs() < 5e-3);
}

#[test]
fn a_record_may_end_in_55() {
    let said = [bytes("55"), bytes(&format!("{D1} 55 {D1} 55 {D1} 55 80"))].concat();
    let mut session = session(Model::Five);
    session.port_opened(0);
    session.push(MS, &said[..1]);
    // Nobody answers `G`.
    for step in 1..=3 {
        session.handle_timeout(step * 600 * MS);
    }
    session.push(2 * S, &said[1..]);
    assert_eq!((session.stats().records, session.stats().resyncs), (3, 0));
}

#[test]
fn d2_and_d3_are_sixteen_values_and_a_hand() {
    let record = bytes(D2);
    let values = decode_data(record.as_slice().try_into().unwrap()).unwrap();
    let expected: [u16; 16] = std::array::from_fn(|index| 100 + 250 * index as u16);
    assert_eq!(values, expected);
    let about = bytes("3C 49 01 02 01 01 3E");
    let about = About::decode(about.as_slice().try_into().unwrap()).unwrap();
    assert_eq!(
        about,
        About {
            version: [1, 2],
            hand: Handedness::Right,
            wired: true
        }
    );
    let said = bytes(&format!("3C 49 01 02 01 01 3E {D2} {D2}"));
    let (readings, info) = read(session(Model::Sixteen), &said);
    let info = info.unwrap();
    assert_eq!(
        (info.firmware.as_str(), info.hand),
        ("1.2", Some(Handedness::Right))
    );
    assert_eq!(readings.len(), 2);
    let value = |sensor| readings[0].sensor(sensor).unwrap().raw;
    assert_eq!(value(GloveSensor::ThumbMcp), 100.0);
    assert_eq!(value(GloveSensor::ThumbAbduction), 600.0);
    assert_eq!(value(GloveSensor::MiddleIndexAbduction), 1350.0);
    assert_eq!(value(GloveSensor::LittlePip), 3350.0);
    assert_eq!(value(GloveSensor::WristFlexion), 3850.0);
    assert_eq!(readings[0].controls.axes, [None; 4]);
    // The glove of 14 has tilt in the last two.
    let (readings, _) = read(session(Model::Fourteen), &said);
    assert_eq!(readings[0].sensor(GloveSensor::WristFlexion), None);
    let roll = readings[0].controls.axes[1].unwrap();
    assert!((roll - (2.0 * 3850.0 / 4095.0 - 1.0)).abs() < 1e-12);
}

#[test]
fn a_packet_with_another_end_is_believed_by_what_follows() {
    let odd = format!("{} 99 77", &D2[..D2.len() - 6]);
    let (readings, _) = read(session(Model::Fourteen), &bytes(&format!("{odd} {odd} 3C")));
    assert_eq!(readings.len(), 1, "the second waits for one more byte");
    let (readings, _) = read(
        session(Model::Fourteen),
        &bytes(&format!("{odd} {odd} 3C 49")),
    );
    assert_eq!(readings.len(), 2);
    let (readings, _) = read(session(Model::Fourteen), &bytes(&format!("{odd} 00 {D2}")));
    assert_eq!(readings.len(), 1);
}

#[test]
fn d4_tells_the_hand_by_radio() {
    for (capability, hand) in [("01", Handedness::Right), ("40", Handedness::Left)] {
        let record = format!("{D1} {capability}");
        let (readings, info) = read(
            session(Model::FiveWireless),
            &bytes(&[record.as_str(); 3].join(" ")),
        );
        assert_eq!(readings.last().unwrap().hand, Some(hand));
        assert_eq!(info.unwrap().hand, Some(hand));
        let mut values = [10.0, 20.0, 30.0, 40.0, 250.0];
        if hand == Handedness::Left {
            values.reverse();
        }
        let twice: Vec<f64> = values.iter().flat_map(|value| [*value; 2]).collect();
        assert_eq!(raw(&readings[0]), twice);
    }
    let other = bytes(&format!("{D1} 02 {D1} 02 {D1} 02"));
    assert!(read(session(Model::FiveWireless), &other).0.is_empty());
}

#[test]
fn d5_is_what_a_glove_says_about_itself() {
    let mut block = bytes("42 52 01 02 01 1F");
    block.resize(32, 0);
    let information = Information::decode(block.as_slice().try_into().unwrap()).unwrap();
    assert_eq!(information.version, [1, 2]);
    assert_eq!(
        (information.hand, information.has_tilt),
        (Handedness::Right, true)
    );
    block[5] = 0x0F;
    let information = Information::decode(block.as_slice().try_into().unwrap()).unwrap();
    assert!(!information.has_tilt);
    block[0] = 0;
    assert_eq!(
        Information::decode(block.as_slice().try_into().unwrap()),
        None
    );
}

#[test]
fn the_order_of_the_fingers_can_be_chosen() {
    for (order, first) in [
        (FlexureOrder::ByHand, 250.0),
        (FlexureOrder::ThumbFirst, 10.0),
        (FlexureOrder::LittleFirst, 250.0),
    ] {
        let settings = FiveDtSettings {
            model: Model::FiveWireless,
            order,
            ..FiveDtSettings::default()
        };
        let left = bytes(&[&format!("{D1} 40"); 3].map(String::as_str).join(" "));
        let (readings, _) = read(
            FiveDtSession::new(settings, GloveCalibration::default()),
            &left,
        );
        assert_eq!(raw(&readings[0])[0], first, "{order:?}");
    }
}

#[test]
fn the_emulator_sends_the_examples() {
    let check = |emulator: &mut FiveDtEmulator, command: &[u8], expected: &str| {
        emulator.push(0, command);
        assert_eq!(emulator.poll(0), bytes(expected), "{command:02X?}");
    };
    let mut five = FiveDtEmulator::new(Model::Five, Handedness::Right);
    five.set_flexures([10, 20, 30, 40, 250]);
    five.set_tilt(128, 64);
    check(&mut five, b"A", "55");
    check(&mut five, b"C", D1);
    five.checksum = Some(Rule::SumOfBody);
    check(&mut five, b"C", "80 0A 14 1E 28 FA 80 40 1E");
    five.appends_done = true;
    check(&mut five, b"D", "80 0A 14 1E 28 FA 80 40 1E 55");
    check(&mut five, b"AH?", "55");
    assert_eq!(five.deadline(), None, "a reset ends the stream");
    five.push(0, b"G");
    let block = five.poll(0);
    assert_eq!(
        (block.len(), &block[..6]),
        (32, bytes("42 52 01 02 01 1F").as_slice())
    );

    let mut radio = FiveDtEmulator::new(Model::FiveWireless, Handedness::Right);
    radio.set_flexures([10, 20, 30, 40, 250]);
    radio.set_tilt(128, 64);
    check(&mut radio, b"ACDG", &format!("{D1} 01"));

    let mut sixteen = FiveDtEmulator::new(Model::Sixteen, Handedness::Right);
    let mut slots = [0; GloveSensor::N_SLOTS];
    let order = [1, 2, 3, 4, 5, 11, 8, 9, 15, 12, 13, 19, 16, 17, 0, 21];
    for (index, slot) in order.into_iter().enumerate() {
        slots[slot] = 100 + 250 * index as u16;
    }
    sixteen.set_slots(&slots);
    check(&mut sixteen, b"", &format!("3C 49 01 02 01 01 3E {D2}"));
}
