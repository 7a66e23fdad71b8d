//! The emulators against the reference's bytes: what is pushed, and exactly what is said.

use nalgebra::{Point3, UnitQuaternion};
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::glove::calibrate::Handedness;
use tsukamu_devices::glove::cyberglove::settings::SensorCount;

use crate::support::{MS, S, bytes};

const C1: &str = "47 01 4C 5D 71 59 2A 14 4D 62 6A 75 51 3E 17 34 3C 22 44 39 FE 5C 1A 00";
const EIGHTEEN: &str = "78 40 47 82 5C 3C 5A 3A 6E 5F 3D 69 63 42 70 58 8C 7F";

fn glove(sensors: SensorCount, raw: &str) -> CyberGloveEmulator {
    let mut glove = CyberGloveEmulator::new(sensors, Handedness::Right);
    glove.set_sensors(&bytes(raw));
    glove
}

#[track_caller]
fn check(emulator: &mut impl Emulator, said_to_it: &[u8], expected: &[u8]) {
    emulator.push(0, said_to_it);
    let answer = emulator.poll(0);
    assert_eq!(answer, expected, "{said_to_it:02X?}");
}

#[test]
fn a_glove_answers_every_question() {
    let mut twenty_two = glove(SensorCount::TwentyTwo, &C1[3..68]);
    let mut eighteen = glove(SensorCount::Eighteen, EIGHTEEN);
    // The examples of C6.
    check(&mut twenty_two, b"?G", b"?G\x03\0");
    check(&mut twenty_two, b"?S", b"?S\x16\0");
    check(&mut eighteen, b"?K", b"?K\x3F\xBB\x7B\0");
    check(&mut twenty_two, b"?T", b"?T\x04\x80\0\x01\0");
    check(&mut twenty_two, b"?B", b"?B\0\0");
    eighteen.set_switch(true);
    check(&mut eighteen, b"?W", b"?W\x01\0");
    check(&mut twenty_two, b"T\x04\x80\0\x01", b"T\0");
    // And the others.
    check(&mut twenty_two, b"?R", b"?R\x01\0");
    check(&mut twenty_two, b"?N", b"?N\x16\0");
    check(&mut twenty_two, b"?M", b"?M\x7F\xFF\x7F\0");
    check(&mut twenty_two, b"?V", b"?V\x01\0\x02\0\0");
    check(&mut twenty_two, b"?P", b"?P\0\0\0\0");
    check(&mut twenty_two, b"\x03", b"\x03\0");
    check(&mut twenty_two, b"\x09", b"\x09\r\n\0");
    // A known mistake of two open drivers, and bad operands.
    check(&mut twenty_two, b"^", b"e?\0");
    check(&mut twenty_two, b"U\x07", b"en\0");
    check(&mut twenty_two, b"?Z", b"e?\0");
    // The ASCII forms.
    check(&mut twenty_two, b"t 2560 1\r", b"t\r\n\0");
    check(&mut twenty_two, b"?T", b"?T\x0A\0\0\x01\0");
    check(&mut twenty_two, b"t 99999 1\r", b"en\0");
    check(&mut twenty_two, b"?s", b"?s 22\r\n\0");
    let ascii = b"g 1 76 93 113 89 42 20 77 98 106 117 81 62 23 52 60 34 68 57 254 92 26\r\n\0";
    check(&mut twenty_two, b"g", ascii);
    // A command may come in pieces.
    check(&mut twenty_two, b"T\x04", b"");
    check(&mut twenty_two, b"\x80\0", b"");
    check(&mut twenty_two, b"\x01", b"T\0");
}

#[test]
fn a_glove_sends_the_examples() {
    let mut c1 = glove(SensorCount::TwentyTwo, &C1[3..68]);
    check(&mut c1, b"G", &bytes(C1));
    let mut c2 = glove(SensorCount::Eighteen, EIGHTEEN);
    c2.set_switch(true);
    check(&mut c2, b"U\x01", b"U\0");
    check(&mut c2, b"S", &bytes(&format!("53 {EIGHTEEN} 83 00")));
    let mut c3 = glove(SensorCount::Eighteen, EIGHTEEN);
    c3.set_plugged_in(false);
    check(&mut c3, b"G", &bytes(&format!("47 {EIGHTEEN} 65 67 00")));
    check(&mut c3, b"?G", b"?G\x01\0");
    // C4: the stamp 65588, in the emulator's unit of ms.
    let mut c4 = glove(SensorCount::Eighteen, EIGHTEEN);
    check(&mut c4, b"U\x01D\x01", b"U\0D\0");
    c4.push(65_588 * MS, b"G");
    let expected = bytes(&format!("47 {EIGHTEEN} 8A 34 02 01 08 81 00"));
    assert_eq!(c4.poll(65_588 * MS), expected);
}

#[test]
fn a_glove_keeps_its_times() {
    let mut glove = glove(SensorCount::Eighteen, EIGHTEEN);
    glove.push(0, b"S");
    let mut n_bytes = 0;
    let mut now_ns = 0;
    while now_ns < S {
        n_bytes += glove.poll(now_ns).len();
        now_ns = glove.deadline().unwrap();
    }
    assert_eq!(n_bytes, 100 * 20);
    // The restart: deaf for 1.75 s, late on request, and without the stream.
    glove.push(now_ns, b"\x12?G");
    assert_eq!(glove.poll(now_ns + 1_749 * MS), b"");
    assert_eq!(glove.poll(now_ns + 1_750 * MS), b"\x12\r\n\0");
    assert_eq!(glove.poll(now_ns + 5 * S), b"");
}

fn tracker() -> FastrakEmulator {
    let mut tracker = FastrakEmulator::new();
    let degrees = [5.0_f64, -10.0, 30.0].map(f64::to_radians);
    let [roll, elevation, azimuth] = degrees;
    let inches = Point3::new(10.0, -4.0, 2.5);
    let rotation = UnitQuaternion::from_euler_angles(roll, elevation, azimuth);
    tracker.set_pose(1, inches * 0.0254, rotation);
    tracker.push(0, b"l2,0\rl3,0\rl4,0\r");
    tracker
}

#[test]
fn a_tracker_sends_the_examples() {
    let mut tracker = tracker();
    check(
        &mut tracker,
        b"P",
        b"01   10.00  -4.00   2.50  30.00 -10.00   5.00\r\n",
    );
    let f2 = "30 31 20 00 00 20 41 00 00 80 C0 00 00 20 40 86 D9 75 3F 39 1D 84 3D 40 37 95 BD FD C3 85 3E 20";
    check(&mut tracker, b"O1,2,11,0\rfP", &bytes(f2));
    let f3 = "30 31 20 B6 05 6B 7D 2D 01 3A 3D 10 04 2B 7B 5C 10 20";
    check(&mut tracker, b"O1,18,20,0\rP", &bytes(f3));
    let status = format!("21S3F1    F31  3.1.00{:<32}\r\n", "EMULATED TRACKER");
    check(&mut tracker, b"S", status.as_bytes());
    tracker.set_connected(1, false);
    let mut unplugged = bytes(f3);
    unplugged[2] = b'k';
    check(&mut tracker, b"P", &unplugged);
}

#[test]
fn a_tracker_ignores_and_refuses() {
    let mut tracker = tracker();
    check(&mut tracker, b"\x01\x02\xFF~", b"");
    check(
        &mut tracker,
        b"O7,2\r",
        b"2  E*ERROR*O7,2*ERROR* EC-3*PS0*FL0*ST0\r\n",
    );
    check(
        &mut tracker,
        b"O1,x\r",
        b"2  E*ERROR*O1,x*ERROR* EC-2*PS0*FL0*ST0\r\n",
    );
    // Suspended output is lost, not saved up.
    tracker.push(0, b"C\x13");
    assert_eq!(tracker.poll(S), b"");
    tracker.push(S, b"\x11");
    assert_eq!(tracker.poll(S + 9 * MS).len(), 47);
    // Deaf for 10 s after the re-initialisation.
    tracker.push(2 * S, b"\x19");
    tracker.push(11 * S, b"P");
    assert_eq!(tracker.poll(11 * S), b"");
    tracker.push(12 * S, b"P");
    // Every station is on again.
    assert_eq!(tracker.poll(12 * S).len(), 4 * 47);
}
