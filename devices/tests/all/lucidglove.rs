//! The worked examples G1 to G6 of the protocol reference, and lines that are none.

use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::lucidglove::{LucidGloveBuild, LucidGloveEmulator};
use tsukamu_devices::feedback::Vibration;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::lucidglove::decode::{LineFault, Sample, decode_line};
use tsukamu_devices::glove::lucidglove::protocol::{
    AXIS_STICK_X, AXIS_STICK_Y, AXIS_TRIGGER, BUTTON_CALIBRATE, BUTTON_GRAB, BUTTON_MENU,
    BUTTON_PINCH, BUTTON_STICK, BUTTON_TRIGGER, Encoding, limits_line, vibration_line,
};
use tsukamu_devices::glove::lucidglove::session::LucidGloveSession;
use tsukamu_devices::glove::lucidglove::settings::LucidGloveSettings;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::GloveReading;
use tsukamu_devices::session::{DeviceEvent, Session};

use crate::support::{S, bytes};

const G1: &str = "41 30 42 32 30 34 37 43 34 30 39 35 44 31 30 32 33 45 33 30 37 31 46 32 30 34 37 47 32 30 34 37 50 30 0A";
const G2: &[u8] = b"A1023(AB)2047(AAB)2047(AAC)3071(AAD)4095B0C0D0E0F2047G2047H\n";
const G3: &[u8] = b"A819B3500C3400D3300E3600F2047G2047P2906ILM\n";
const G4: &[u8] = b"(ZV)5(ZG)0(ZH)1\n";
const G6: &[u8] = b"0&2047&4095&1023&3071&2047&2047&0&1&0&0&1&0\n";

fn sample(line: &[u8]) -> Sample {
    decode_line(line).unwrap().sample.unwrap()
}

/// What a session with a maximum of 4095 reads from one line behind the end of another.
fn reading(line: &[u8]) -> GloveReading {
    let settings = LucidGloveSettings {
        max: Some(4095),
        ..LucidGloveSettings::default()
    };
    let mut session = LucidGloveSession::new(settings, GloveCalibration::default());
    session.port_opened(0);
    session.push(1, &[b"E17\n", line].concat());
    let events = std::iter::from_fn(|| session.next_event());
    let readings: Vec<GloveReading> = events
        .filter_map(|event| match event {
            DeviceEvent::Glove(reading) => Some(reading),
            _ => None,
        })
        .collect();
    assert_eq!(readings.len(), 1);
    readings[0]
}

#[track_caller]
fn near(value: f64, expected: f64) {
    assert!((value - expected).abs() < 6e-5, "{value}, not {expected}");
}

/// The share of the range at each sensor.
fn share(reading: &GloveReading, sensor: GloveSensor) -> f64 {
    reading.sensor(sensor).unwrap().raw / 4095.0
}

#[track_caller]
fn check_curls(reading: &GloveReading, expected: [f64; 5]) {
    use GloveSensor as S;
    let joints = [
        [S::ThumbRotation, S::ThumbMcp, S::ThumbIp],
        [S::IndexMcp, S::IndexPip, S::IndexDip],
        [S::MiddleMcp, S::MiddlePip, S::MiddleDip],
        [S::RingMcp, S::RingPip, S::RingDip],
        [S::LittleMcp, S::LittlePip, S::LittleDip],
    ];
    for (joints, expected) in joints.iter().zip(expected) {
        for sensor in joints {
            near(share(reading, *sensor), expected);
        }
    }
}

#[test]
fn g1_five_curls_and_a_resting_stick() {
    let line = bytes(G1);
    assert_eq!(line, b"A0B2047C4095D1023E3071F2047G2047P0\n");
    assert_eq!(line.len(), 35);
    let decoded = sample(&line);
    assert_eq!(decoded.encoding, Encoding::Alpha);
    assert_eq!(decoded.curls, [0, 2047, 4095, 1023, 3071].map(Some));
    assert_eq!(decoded.stick, [Some(2047); 2]);
    assert_eq!((decoded.trigger, decoded.buttons), (Some(0), 0));
    let reading = reading(&line);
    check_curls(&reading, [0.0, 0.4999, 1.0, 0.2498, 0.7499]);
    let axes = reading.controls.axes;
    assert!(axes[AXIS_STICK_X].unwrap().abs() < 1e-3 && axes[AXIS_STICK_Y].unwrap().abs() < 1e-3);
    assert_eq!(axes[AXIS_TRIGGER], Some(0.0));
    assert_eq!(reading.controls.buttons, 0);
    // The default calibration: half a curl is half of each joint's range.
    near(
        reading
            .angle_rad(GloveSensor::IndexMcp)
            .unwrap()
            .to_degrees()
            / 90.0,
        0.4999,
    );
    near(
        reading
            .angle_rad(GloveSensor::MiddlePip)
            .unwrap()
            .to_degrees(),
        100.0,
    );
    // The firmware sends just that.
    let mut glove = LucidGloveEmulator::new(LucidGloveBuild::default());
    glove.set_curls([0, 2047, 4095, 1023, 3071]);
    assert_eq!(glove.poll(0), line);
}

#[test]
fn g2_splay_and_single_joints_of_the_thumb() {
    assert_eq!(G2.len(), 60);
    let reading = reading(G2);
    near(share(&reading, GloveSensor::ThumbRotation), 0.2498);
    near(share(&reading, GloveSensor::ThumbMcp), 0.4999);
    near(share(&reading, GloveSensor::ThumbIp), 0.7499);
    assert_eq!(
        sample(G2).joints[0],
        [None, Some(2047), Some(3071), Some(4095)]
    );
    let splay = 2.0 * share(&reading, GloveSensor::ThumbAbduction) - 1.0;
    assert!(splay.abs() < 1e-3, "{splay}");
    assert_eq!(share(&reading, GloveSensor::IndexMcp), 0.0);
    // No splay of the other fingers, no sensor between them.
    assert_eq!(reading.sensor(GloveSensor::MiddleIndexAbduction), None);
    assert_eq!(reading.controls.buttons, BUTTON_STICK);
}

#[test]
fn g3_trigger_grab_and_pinch() {
    assert_eq!(G3.len(), 43);
    let reading = reading(G3);
    near(share(&reading, GloveSensor::ThumbMcp), 0.2);
    near(share(&reading, GloveSensor::IndexPip), 0.8547);
    let trigger = reading.controls.axes[AXIS_TRIGGER].unwrap();
    near(trigger * 4095.0, 2906.0);
    assert_eq!(
        reading.controls.buttons,
        BUTTON_TRIGGER | BUTTON_GRAB | BUTTON_PINCH
    );
    let mut glove = LucidGloveEmulator::new(LucidGloveBuild::default());
    glove.set_curls([819, 3500, 3400, 3300, 3600]);
    glove.set_controls([2047; 2], BUTTON_TRIGGER | BUTTON_GRAB | BUTTON_PINCH);
    assert_eq!(glove.poll(0), G3);
}

#[test]
fn g4_information() {
    assert_eq!(G4.len(), 16);
    let line = decode_line(G4).unwrap();
    assert_eq!(line.sample, None);
    let info = line.info.unwrap();
    assert_eq!((info.firmware, info.device_type), (Some(5), Some(0)));
    assert_eq!(info.hand, Some(Handedness::Right));
    let build = LucidGloveBuild {
        info: Some(Handedness::Right),
        ..LucidGloveBuild::default()
    };
    assert!(LucidGloveEmulator::new(build).poll(0).starts_with(G4));
}

#[test]
fn g5_limits_turn_the_servos() {
    let line = limits_line(Encoding::Alpha, [0, 500, 1000, 0, 0]);
    assert_eq!(line, b"A0B500C1000D0E0\n");
    let mut glove = LucidGloveEmulator::new(LucidGloveBuild::default());
    glove.poll(0);
    glove.push(1, &line);
    glove.poll(1);
    assert_eq!(glove.limits(), [0, 500, 1000, 0, 0]);
    assert_eq!(glove.servos_deg(), [0.0, 90.0, 180.0, 0.0, 0.0]);
    let mut now_ns = 0;
    // A negative limit leaves its servo alone, and one that is missing frees it; a short line is ignored.
    for (line, limits) in [
        (&b"A-1B-1C-1D7E-1\n"[..], [0, 500, 1000, 7, 0]),
        (b"A9\n", [0, 500, 1000, 7, 0]),
        (b"\n", [0, 500, 1000, 7, 0]),
        (b"A100B1\n", [100, 1, 0, 0, 0]),
    ] {
        now_ns += S;
        glove.poll(now_ns);
        glove.push(now_ns, line);
        glove.poll(now_ns);
        assert_eq!(glove.limits(), limits, "{line:?}");
    }
    let legacy = limits_line(Encoding::Legacy, [0, 500, 1000, 0, 0]);
    assert_eq!(legacy, b"0&500&1000&0&0\n");
}

#[test]
fn g6_legacy() {
    let decoded = sample(G6);
    assert_eq!(decoded.encoding, Encoding::Legacy);
    let read = reading(G6);
    check_curls(&read, [0.0, 0.4999, 1.0, 0.2498, 0.7499]);
    assert_eq!(read.controls.buttons, BUTTON_TRIGGER | BUTTON_GRAB);
    assert_eq!(read.controls.axes[AXIS_TRIGGER], None);
    // Commas and few fields are tolerated.
    let commas: Vec<u8> = G6
        .iter()
        .map(|byte| if *byte == b'&' { b',' } else { *byte })
        .collect();
    assert_eq!(sample(&commas), decoded);
    let five = sample(b"0&2047&4095&1023&3071\r\n");
    assert_eq!((five.curls, five.stick), (decoded.curls, [None; 2]));
    let mut glove = LucidGloveEmulator::new(LucidGloveBuild {
        encoding: Encoding::Legacy,
        ..LucidGloveBuild::default()
    });
    glove.set_curls([0, 2047, 4095, 1023, 3071]);
    glove.set_controls([2047; 2], BUTTON_TRIGGER | BUTTON_GRAB);
    assert_eq!(glove.poll(0), G6);
}

#[test]
fn keys_count_not_places() {
    let decoded = sample(b"  E5D4(QQQ)77C3Q9B2A1(ZA)NO(EB)6 \r");
    assert_eq!(decoded.curls, [1, 2, 3, 4, 5].map(Some));
    assert_eq!(decoded.splays, [None, None, None, None, Some(6)]);
    assert_eq!(decoded.buttons, BUTTON_MENU | BUTTON_CALIBRATE);
    assert_eq!(sample(b"A1H0I1").buttons, BUTTON_TRIGGER);
    assert_eq!(sample(b"B2").curls, [None, Some(2), None, None, None]);
}

#[test]
fn lines_that_are_none_are_refused() {
    let cases: [(&[u8], LineFault); 16] = [
        (b"", LineFault::NoFinger),
        (b"F2047G2047P0", LineFault::NoFinger),
        (b"A", LineFault::NoNumber),
        (b"AB2", LineFault::NoNumber),
        (b"A1B70000", LineFault::Number(70_000)),
        (b"A99999999999999999999", LineFault::Number(u32::MAX)),
        (b"A1A2", LineFault::Twice),
        (b"A1HH", LineFault::Twice),
        (b"A1H7", LineFault::Number(7)),
        (b"A-1B2", LineFault::NoNumber),
        (b"A1(AB2", LineFault::Bracket),
        (b"A1(ABCD)2", LineFault::Bracket),
        (b"ets Jun  8 2016 00:22:57", LineFault::Byte(b'e')),
        (b"1&2&3&4", LineFault::Fields(4)),
        (b"1&2&3&4&", LineFault::NoNumber),
        (b"1&2&3&4&5&6&7&8", LineFault::Number(8)),
    ];
    for (line, fault) in cases {
        assert_eq!(decode_line(line), Err(fault), "{line:?}");
    }
    assert_eq!(decode_line(&[b'A'; 513]), Err(LineFault::Length(513)));
    let fields = [b"1&".repeat(13), b"1".to_vec()].concat();
    assert_eq!(decode_line(&fields), Err(LineFault::Fields(14)));
}

#[test]
fn a_vibration_is_written_with_two_digits() {
    let vibration = Vibration {
        frequency_hz: 150.0,
        duration_s: 0.05,
        amplitude: 0.755,
    };
    let line = vibration_line(&vibration);
    assert!(line == b"F150.00G0.05H0.76\n" || line == b"F150.00G0.05H0.75\n");
}
