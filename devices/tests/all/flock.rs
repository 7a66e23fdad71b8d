//! Flock of Birds: the examples of the reference, the emulator's bytes, start-up alone and in a group.

use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

use nalgebra::{Point3, UnitQuaternion};
use tsukamu_devices::clock::Clock;
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::flock::FlockEmulator;
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::fault::Fault;
use tsukamu_devices::port::{PortEvent, PortSettings};
use tsukamu_devices::port_thread::PortThread;
use tsukamu_devices::session::{DeviceEvent, PortRequest, Session, SessionState};
use tsukamu_devices::tracker::flock::decode::{Output, RecordFault, RecordFormat, decode_record};
use tsukamu_devices::tracker::flock::protocol::rate_hz;
use tsukamu_devices::tracker::flock::session::FlockSession;
use tsukamu_devices::tracker::flock::settings::{FlockSettings, Hemisphere, Scale};
use tsukamu_devices::tracker::packed::number_from_pair;

use crate::support::{Bench, MS, S, bytes};

const B1: &str = "AA 15 2A 75 0E 07 3A 3D 10 04 2B 7B 5C 10 01";
const B2: &str = "AA 15 2A 75 0E 07 55 0A 39 7C 63 01 01";

type FlockBench = Bench<FlockSession, FlockEmulator>;

const fn group_of_two(output: Output) -> RecordFormat {
    RecordFormat {
        output,
        buttons: false,
        n_units: Some(2),
        range_m: 36.0 * 0.0254,
    }
}

fn example_pose() -> (Point3<f64>, UnitQuaternion<f64>) {
    let degrees = [5.0_f64, -10.0, 30.0].map(f64::to_radians);
    let rotation = UnitQuaternion::from_euler_angles(degrees[0], degrees[1], degrees[2]);
    (Point3::new(12.0, -6.0, 4.0) * 0.0254, rotation)
}

fn placed(mut emulator: FlockEmulator) -> FlockEmulator {
    let (position, rotation) = example_pose();
    for bird in 1..=14 {
        emulator.set_pose(bird, position * (1.0 / f64::from(bird)), rotation);
    }
    emulator
}

fn group(birds: &[u8]) -> FlockSettings {
    FlockSettings {
        birds: birds.to_vec(),
        group: true,
        ..FlockSettings::default()
    }
}

fn bench(settings: FlockSettings, emulator: FlockEmulator) -> FlockBench {
    Bench::new(FlockSession::new(settings), placed(emulator))
}

fn running(bench: &FlockBench) -> bool {
    bench.session.state() == SessionState::Running
}

#[test]
fn b1_a_record_of_a_group_with_a_quaternion() {
    let format = group_of_two(Output::PositionQuaternion);
    assert_eq!(format.length(), 15);
    let record = decode_record(&bytes(B1), &format).unwrap();
    let expected = Point3::new(0.30473, -0.15247, 0.10158);
    assert!((record.position.unwrap() - expected).amax() < 1e-4);
    let q = record.rotation.unwrap();
    let expected = [0.96021, 0.06445, -0.07288, 0.26123];
    for (found, expected) in [q.w, q.i, q.j, q.k].into_iter().zip(expected) {
        // As they were sent, not quite of unit length.
        assert!((found - expected).abs() < 2e-4, "{q}");
    }
    assert_eq!(record.station, 1);
}

#[test]
fn b2_a_record_of_a_group_with_angles() {
    let format = group_of_two(Output::PositionAngles);
    assert_eq!(format.length(), 13);
    let record = decode_record(&bytes(B2), &format).unwrap();
    let inches = record.position.unwrap() / 0.0254;
    assert!((inches - Point3::new(11.997, -6.003, 3.999)).amax() < 1e-3);
    let (x, y, z) = record.rotation.unwrap().euler_angles();
    for (found, expected) in [z, y, x].into_iter().zip([29.993, -9.998, 4.988]) {
        assert!((found.to_degrees() - expected).abs() < 1e-3);
    }
    // Without group mode the address is absent.
    let alone = RecordFormat {
        n_units: None,
        ..format
    };
    let same = decode_record(&bytes(B2)[..12], &alone).unwrap();
    assert_eq!((same.position, same.station), (record.position, 1));
}

#[test]
fn b3_full_scale_and_b4_the_rate() {
    assert_eq!(number_from_pair(0x80, 0x40), -32_768);
    assert_eq!(number_from_pair(0xFF, 0x3F), 32_764);
    let mut record = bytes(B1);
    record[..4].copy_from_slice(&[0x80, 0x40, 0x7F, 0x3F]);
    let found = decode_record(&record, &group_of_two(Output::PositionQuaternion)).unwrap();
    let inches = found.position.unwrap() / 0.0254;
    assert!((inches.x + 36.0).abs() < 1e-9 && (inches.y - 35.9956).abs() < 1e-4);
    let rate = rate_hz(u16::from_le_bytes([0xB4, 0x2D]), 40).unwrap();
    assert!((rate - 103.52).abs() < 5e-3, "{rate}");
    assert_eq!((rate_hz(0, 40), rate_hz(1, 0)), (None, None));
}

#[test]
fn bad_records_are_refused_by_name() {
    let format = group_of_two(Output::PositionQuaternion);
    let altered = |index: usize, byte: u8| {
        let mut record = bytes(B1);
        record[index] = byte;
        decode_record(&record, &format)
    };
    assert_eq!(altered(0, 0x2A), Err(RecordFault::Phase));
    assert_eq!(altered(9, 0x84), Err(RecordFault::Phase));
    assert_eq!(altered(14, 0), Err(RecordFault::Address));
    assert_eq!(altered(14, 3), Err(RecordFault::Address));
    assert_eq!(altered(7, 0x00), Err(RecordFault::Rotation));
    assert!(matches!(
        decode_record(&bytes(B1)[..14], &format),
        Err(RecordFault::Length { found: 14, .. })
    ));
    let with_buttons = RecordFormat {
        buttons: true,
        ..format
    };
    let mut record = bytes(B1);
    record.insert(14, 0x30);
    assert_eq!(
        decode_record(&record, &with_buttons).unwrap().pressed,
        Some(true)
    );
    record[14] = 0x01;
    assert_eq!(
        decode_record(&record, &with_buttons),
        Err(RecordFault::Buttons)
    );
}

#[test]
fn the_emulator_obeys_the_other_drivers_conversation() {
    let mut emulator = placed(FlockEmulator::group(2));
    let at = |step: u64| step * 400 * MS;
    emulator.push(0, &bytes("42"));
    emulator.poll(0);
    emulator.push(at(1), &bytes("50 32 02"));
    emulator.push(
        at(2),
        &bytes("50 23 01 F1 5D F2 5D F1 4C 00 00 F2 4C 00 00"),
    );
    assert_eq!(emulator.poll(at(2)), b"");
    emulator.push(at(2), &bytes("4F 24"));
    let bus = emulator.poll(at(2));
    assert_eq!((bus.len(), &bus[..3]), (14, &[0xE0, 0xE0, 0][..]));
    emulator.push(at(2), &bytes("4F 02 4F 06"));
    assert_eq!(emulator.poll(at(2)), bytes("28 00 B4 2D"));
    emulator.push(at(2), &bytes("42"));
    let round = emulator.poll(at(2));
    assert_eq!((&round[..15], round.len()), (&bytes(B1)[..], 30));
    assert_eq!(round[29], 2);
    emulator.push(at(2), &bytes("F1 59 42"));
    assert_eq!(emulator.poll(at(2))[..13], bytes(B2));
    emulator.push(at(2), &bytes("40"));
    let mut n_bytes = 0;
    for millisecond in 0..1000 {
        n_bytes += emulator.poll(at(2) + millisecond * MS).len();
    }
    assert!(n_bytes.abs_diff(28 * 103) <= 28, "{n_bytes}");
    // A command that is none is kept for the question about errors, which clears it.
    emulator.push(at(5), &bytes("42 50 77 00"));
    emulator.poll(at(5));
    emulator.push(at(5), &bytes("4F 0A 4F 0A"));
    assert_eq!(emulator.poll(at(5)), [6, 0]);
}

#[test]
fn a_bus_that_is_not_left_quiet_does_not_fly() {
    let mut emulator = FlockEmulator::group(2);
    emulator.push(0, &bytes("46 50 32 02"));
    emulator.push(400 * MS, &bytes("4F 24 4F 0A"));
    let said = emulator.poll(400 * MS);
    assert_eq!((said[0] & 0x80, said[14]), (0, 13));
}

#[test]
fn a_bird_alone_starts_within_two_seconds_in_every_output() {
    for (output, buttons) in [
        (Output::PositionQuaternion, false),
        (Output::PositionAngles, false),
        (Output::PositionQuaternion, true),
    ] {
        let settings = FlockSettings {
            output,
            buttons,
            hemisphere: Some(Hemisphere::Lower),
            ..FlockSettings::default()
        };
        let mut bench = bench(settings, FlockEmulator::alone());
        bench.emulator.set_buttons(1, 0x10);
        // A host that crashed left it streaming.
        bench.emulator.push(0, b"@");
        bench.open();
        let took_ns = bench.run_until(3 * S, running);
        assert!(took_ns < S, "{took_ns}");
        assert_eq!(bench.requests, [PortRequest::SetRts(false)]);
        bench.run_for(S);
        let readings = bench.trackers();
        assert!((100..=108).contains(&readings.len()), "{}", readings.len());
        let last = readings.last().unwrap();
        let pose = last.transmitter_from_sensor().unwrap();
        let (position, rotation) = example_pose();
        assert!((pose.translation.vector - position.coords).amax() < 2.5e-4);
        assert!(pose.rotation.angle_to(&rotation) < 1e-3);
        assert_eq!(last.stylus_pressed, buttons.then_some(true));
        assert!(bench.events.iter().any(|event| matches!(
            event,
            DeviceEvent::Identified(info) if info.identity == "EMULATED, 103.52 Hz" && info.firmware == "3.67"
                && info.rate_hz.is_some_and(|rate_hz| (rate_hz - 103.52).abs() < 5e-3)
        )));
        assert!(bench.sent.contains(&b"Q".to_vec()));
        assert_eq!(bench.session.stats().resyncs, 0);
    }
}

#[test]
fn a_group_is_configured_once_and_flies() {
    let mut bench = bench(group(&[1, 2]), FlockEmulator::group(2));
    bench.open();
    let took_ns = bench.run_until(5 * S, running);
    assert!(took_ns < 3 * S, "{took_ns}");
    assert!(bench.sent.contains(&bytes("50 32 02")));
    bench.run_for(S);
    let readings = bench.trackers();
    for station in [1_u16, 2] {
        let own: Vec<_> = readings
            .iter()
            .filter(|reading| reading.station == station)
            .collect();
        assert!((100..=108).contains(&own.len()), "{}", own.len());
        let expected = example_pose().0 * (1.0 / f64::from(station));
        assert!((own[50].position.unwrap() - expected).amax() < 2.5e-4);
    }
    // A port that comes back finds the bus as it was.
    bench.sent.clear();
    bench.session.port_lost(
        bench.now_ns,
        Fault::Unplugged {
            path: String::new(),
        },
    );
    bench.open();
    let took_ns = bench.run_until(5 * S, running);
    assert!(took_ns < S, "{took_ns}");
    assert!(!bench.sent.contains(&bytes("50 32 02")));
}

#[test]
fn a_controller_uses_an_address_up_and_a_bird_that_is_not_used_is_left_out() {
    let mut bench = bench(group(&[3]), FlockEmulator::group(3));
    bench.emulator.set_connected(1, false);
    bench.open();
    bench.run_until(5 * S, running);
    bench.run_for(S);
    assert_eq!(bench.session.fault(), None);
    let readings = bench.trackers();
    assert!(readings.len() > 90);
    assert!(readings.iter().all(|reading| reading.station == 3));
    assert_eq!(bench.session.stats().resyncs, 0);
}

#[test]
fn a_bird_that_is_missing_is_named_and_the_others_fly() {
    let mut bench = bench(group(&[1, 2]), FlockEmulator::group(2));
    bench.emulator.set_connected(2, false);
    bench.open();
    bench.run_until(8 * S, running);
    bench.run_for(S);
    assert!(bench.trackers().len() > 90);
    let named = |fault: &Fault| matches!(fault, Fault::Reported { code, .. } if code == "bird 2");
    assert!(bench.session.fault().is_some_and(named));
}

#[test]
fn directions_and_scales_are_as_they_are_set() {
    let settings = FlockSettings {
        invert_quaternion: true,
        scale: Scale::Inches144,
        ..FlockSettings::default()
    };
    let mut bench = bench(settings, FlockEmulator::alone());
    bench.emulator.scale = Scale::Inches144;
    bench.open();
    bench.run_until(3 * S, running);
    let last = *bench.trackers().last().unwrap();
    let (position, rotation) = example_pose();
    assert!((last.position.unwrap() - position).amax() < 1e-3);
    assert!(last.rotation.unwrap().angle_to(&rotation.inverse()) < 1e-3);
}

#[test]
fn a_unit_that_rts_has_just_let_go_is_waited_for() {
    let mut bench = bench(FlockSettings::default(), FlockEmulator::alone());
    bench.emulator.restart(0);
    bench.open();
    let took_ns = bench.run_until(10 * S, running);
    assert!(took_ns < 4 * S, "{took_ns}");
    assert!(!bench.requests.contains(&PortRequest::Reopen));
}

#[test]
fn only_a_silent_unit_is_reset_by_rts() {
    let mut bench = bench(FlockSettings::default(), FlockEmulator::alone());
    bench.open();
    bench.run_until(3 * S, running);
    bench.emulator.faults.freeze();
    bench.run_until(30 * S, |bench| {
        bench.requests.contains(&PortRequest::SetRts(true))
    });
    bench.run_for(2 * S);
    assert_eq!(bench.requests.last(), Some(&PortRequest::SetRts(false)));
    bench.emulator.faults.thaw();
    let now_ns = bench.now_ns;
    bench.emulator.restart(now_ns);
    let took_ns = bench.run_until(10 * S, running);
    assert!(took_ns < 5 * S, "{took_ns}");
}

/// The line RTS of a pseudo-terminal is none, and nobody minds.
#[test]
fn a_group_flies_on_a_terminal() {
    let emulator = placed(FlockEmulator::group(2));
    let emulated = PtyEmulator::spawn(emulator, PtySettings::default(), |_, _| {}).unwrap();
    let (sender, events) = sync_channel(10_000);
    let settings = PortSettings {
        path: emulated.path().to_str().unwrap().to_owned(),
        bauds: vec![115_200],
        raw: false,
    };
    let session = Box::new(FlockSession::new(group(&[1, 2])));
    let port = PortThread::spawn(
        settings,
        session,
        Clock::new(Instant::now()),
        move |event| {
            if let PortEvent::Device(DeviceEvent::Tracker(reading)) = event {
                let _ = sender.try_send(reading);
            }
        },
    )
    .unwrap();
    let mut seen = [0; 2];
    while seen.iter().any(|n_readings| *n_readings < 10) {
        let reading = events.recv_timeout(Duration::from_secs(20)).unwrap();
        seen[usize::from(reading.station) - 1] += 1;
        let expected = example_pose().0 * (1.0 / f64::from(reading.station));
        assert!((reading.position.unwrap() - expected).amax() < 2.5e-4);
    }
    port.stop();
}
