//! Isotrak II and 3SPACE Tracker: the example of the reference, the emulator's bytes, start-up and what a stream may hold.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::isotrak::IsotrakEmulator;
use tsukamu_devices::session::{DeviceEvent, Session, SessionState};
use tsukamu_devices::tracker::isotrak::decode::{RecordFault, decode_record};
use tsukamu_devices::tracker::isotrak::protocol::{Model, STATUS_LENGTH};
use tsukamu_devices::tracker::isotrak::session::IsotrakSession;
use tsukamu_devices::tracker::isotrak::settings::IsotrakSettings;
use tsukamu_devices::tracker::packed::{pack_sevens, unpack_sevens};
use tsukamu_devices::tracker::space::TrackerSpace;

use crate::support::{Bench, MS, S, bytes};

const I1: &str = "B0 31 20 08 13 48 74 48 30 04 6C 7A 42 08 2D 45 76 71 21 01";
const I1_UNPACKED: &str = "30 31 20 88 13 48 F4 B0 04 EC 7A 42 08 AD F6 71 21";

fn example_pose() -> (Point3<f64>, UnitQuaternion<f64>) {
    let position = Point3::new(5000.0, -3000.0, 1200.0) * (1.6632 / 32_767.0);
    let degrees = [5.0_f64, -10.0, 30.0].map(f64::to_radians);
    let rotation = UnitQuaternion::from_euler_angles(degrees[0], degrees[1], degrees[2]);
    (position, rotation)
}

fn bench(settings: IsotrakSettings) -> Bench<IsotrakSession, IsotrakEmulator> {
    let mut emulator = IsotrakEmulator::new(settings.model);
    let (position, rotation) = example_pose();
    emulator.set_pose(1, position, rotation);
    emulator.set_pose(2, position * 2.0, rotation);
    Bench::new(IsotrakSession::new(settings), emulator)
}

fn running(bench: &Bench<IsotrakSession, IsotrakEmulator>) -> bool {
    bench.session.state() == SessionState::Running
}

#[test]
fn i1_unpacks_and_decodes() {
    let wire = bytes(I1);
    assert_eq!(unpack_sevens::<17>(&wire).unwrap()[..], bytes(I1_UNPACKED));
    assert_eq!(pack_sevens(&bytes(I1_UNPACKED)), wire);
    let record = decode_record(&wire, Model::IsotrakTwo).unwrap();
    let expected = Point3::new(0.25379, -0.15228, 0.06091);
    assert!((record.position.unwrap() - expected).amax() < 1e-5);
    let rotation = record.rotation.unwrap();
    let found = [rotation.w, rotation.i, rotation.j, rotation.k].map(|part| part * 32_767.0);
    for (found, expected) in found.into_iter().zip([31_468.0, 2114.0, -2387.0, 8561.0]) {
        // The sent one is 1e-5 off unit length.
        assert!((found - expected).abs() < 1.0, "{found} {expected}");
    }
    assert_eq!((record.station, record.error), (1, None));
    assert_eq!((record.pressed, record.usable), (None, true));
}

#[test]
fn the_older_unit_has_another_scale() {
    let record = decode_record(&bytes(I1), Model::ThreeSpace).unwrap();
    let expected = 5000.0 * 65.48 * 0.0254 / 32_768.0;
    assert!((record.position.unwrap().x - expected).abs() < 1e-12);
}

#[test]
fn bad_records_are_refused_by_name() {
    let altered = |index: usize, byte: u8| {
        let mut plain = bytes(I1_UNPACKED);
        plain[index] = byte;
        decode_record(&pack_sevens(&plain), Model::IsotrakTwo)
    };
    assert_eq!(altered(0, b'1'), Err(RecordFault::Header));
    assert_eq!(altered(1, b'3'), Err(RecordFault::Header));
    assert_eq!(altered(2, b'!'), Err(RecordFault::Header));
    assert_eq!(altered(10, 0), Err(RecordFault::Rotation));
    let mut wire = bytes(I1);
    wire[19] |= 0x10;
    assert_eq!(
        decode_record(&wire, Model::IsotrakTwo),
        Err(RecordFault::Packing)
    );
    // The stylus, and an error letter that excuses the rotation.
    assert_eq!(altered(2, b'@').unwrap().pressed, Some(true));
    assert_eq!(altered(2, b'*').unwrap().pressed, Some(false));
    let flagged = altered(2, b'k').unwrap();
    assert_eq!((flagged.error, flagged.usable), (Some('k'), false));
}

#[test]
fn the_emulator_sends_the_example() {
    let mut emulator = IsotrakEmulator::new(Model::IsotrakTwo);
    let (position, rotation) = example_pose();
    emulator.set_pose(1, position, rotation);
    emulator.push(0, b"O2,11\rufP");
    assert_eq!(emulator.poll(0), bytes(I1));
    emulator.push(0, b"S");
    let status = emulator.poll(0);
    assert_eq!((status.len(), status[0]), (STATUS_LENGTH, b'2'));
    emulator.push(0, b"O9\r");
    assert!(emulator.poll(0).starts_with(b"2  E*ERROR*O9"));
    // 10 s of deafness, and nothing is kept of what was said in it.
    emulator.push(0, b"\x19P");
    assert_eq!(emulator.poll(9 * S), b"");
    emulator.push(11 * S, b"P");
    assert_eq!(emulator.poll(11 * S).len(), 47);
}

#[test]
fn starts_within_a_second_and_tells_the_truth() {
    for (model, tolerance_m) in [(Model::IsotrakTwo, 3e-5), (Model::ThreeSpace, 3e-5)] {
        let mut bench = bench(IsotrakSettings {
            model,
            hemisphere: Some([0.0, 0.0, 1.0]),
            position_filter: Some([0.2, 0.2, 0.8, 0.8]),
            ..IsotrakSettings::default()
        });
        // A host that crashed left it streaming text, a command half given.
        bench.emulator.push(0, b"CO1");
        bench.open();
        let took_ns = bench.run_until(4 * S, running);
        assert!(took_ns < 2 * S, "{took_ns}");
        bench.run_for(S);
        let readings = bench.trackers();
        assert!((58..=64).contains(&readings.len()), "{}", readings.len());
        let last = readings.last().unwrap();
        assert_eq!((last.station, last.space), (1, TrackerSpace::ZDown));
        let pose = last.transmitter_from_sensor().unwrap();
        let (position, rotation) = example_pose();
        assert!((pose.translation.vector - position.coords).amax() < tolerance_m);
        assert!(pose.rotation.angle_to(&rotation) < 1e-3);
        assert!(
            readings
                .windows(2)
                .all(|pair| pair[0].sequence + 1 == pair[1].sequence)
        );
        assert!(bench.events.iter().any(|event| matches!(
            event,
            DeviceEvent::Identified(info) if info.family == model.family() && info.identity.contains("EMULATED")
        )));
        assert!(bench.sent.contains(&b"O2,11\r".to_vec()));
        let is_newer = model == Model::IsotrakTwo;
        for command in [&b"R1\r"[..], b"b1\r", b"x0.20,0.20,0.80,0.80\r", b"u"] {
            assert_eq!(bench.sent.contains(&command.to_vec()), is_newer);
        }
        assert_eq!(bench.session.stats().resyncs, 0);
    }
}

#[test]
fn two_stations_share_the_rate_and_one_is_left_out() {
    let mut bench = bench(IsotrakSettings {
        stations: [false, true],
        ..IsotrakSettings::default()
    });
    bench.emulator.set_connected(2, true);
    bench.emulator.set_button(2, Some(true));
    bench.open();
    bench.run_until(2 * S, running);
    bench.run_for(S);
    let readings = bench.trackers();
    assert!((28..=33).contains(&readings.len()), "{}", readings.len());
    assert!(readings.iter().all(|reading| reading.station == 2));
    let last = readings.last().unwrap();
    assert_eq!(last.stylus_pressed, Some(true));
    let world = last.world_from_sensor().unwrap().translation.vector;
    let (position, _) = example_pose();
    let expected = Vector3::new(position.y, -position.z, -position.x) * 2.0;
    assert!((world - expected).amax() < 3e-5, "{world}");
}

#[test]
fn answers_between_records_do_no_harm() {
    let mut bench = bench(IsotrakSettings::default());
    bench.open();
    bench.run_until(2 * S, running);
    for _ in 0..20 {
        let now_ns = bench.now_ns;
        bench.emulator.push(now_ns, b"SO9\r");
        bench.run_for(50 * MS);
    }
    let stats = bench.session.stats();
    assert_eq!((stats.resyncs, stats.dropped_records), (0, 0));
}
