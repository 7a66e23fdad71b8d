//! Liberty, Patriot and Latus: the example of the reference, the emulator's bytes, start-up and the counters.

use nalgebra::{Point3, UnitQuaternion};
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::liberty::LibertyEmulator;
use tsukamu_devices::session::{DeviceEvent, DeviceInfo, Session, SessionState};
use tsukamu_devices::tracker::liberty::decode::{FrameFault, FrameFormat, decode_frame};
use tsukamu_devices::tracker::liberty::protocol::Model;
use tsukamu_devices::tracker::liberty::session::LibertySession;
use tsukamu_devices::tracker::liberty::settings::{Counter, LibertySettings};

use crate::support::{Bench, MS, S, bytes};

const L1: &str = "4C 59 01 43 20 00 21 00 00 00 20 41 00 00 80 C0 00 00 20 40 86 D9 75 3F 39 1D 84 3D 40 37 95 BD \
                  FD C3 85 3E D2 04 00 00 20";
const INCHES: FrameFormat = FrameFormat {
    counter: Some(Counter::Time),
    stylus: false,
    metres_per_unit: 0.0254,
};

fn example_pose() -> (Point3<f64>, UnitQuaternion<f64>) {
    let degrees = [5.0_f64, -10.0, 30.0].map(f64::to_radians);
    let rotation = UnitQuaternion::from_euler_angles(degrees[0], degrees[1], degrees[2]);
    (Point3::new(10.0, -4.0, 2.5) * 0.0254, rotation)
}

fn bench(model: Model, settings: LibertySettings) -> Bench<LibertySession, LibertyEmulator> {
    let mut emulator = LibertyEmulator::new(model);
    let (position, rotation) = example_pose();
    emulator.set_pose(1, position, rotation);
    emulator.set_pose(16, position * 2.0, rotation);
    Bench::new(LibertySession::new(settings), emulator)
}

fn running(bench: &Bench<LibertySession, LibertyEmulator>) -> bool {
    bench.session.state() == SessionState::Running
}

fn last_info(bench: &Bench<LibertySession, LibertyEmulator>) -> DeviceInfo {
    let mut infos = bench.events.iter().filter_map(|event| match event {
        DeviceEvent::Identified(info) => Some(info.clone()),
        _ => None,
    });
    infos.next_back().unwrap()
}

#[test]
fn l1_decodes() {
    assert_eq!((INCHES.length(), INCHES.payload_length()), (41, 33));
    assert_eq!(INCHES.items(), [2, 7, 8, 0]);
    let (model, record) = decode_frame(&bytes(L1), &INCHES).unwrap();
    assert_eq!(model, Some(Model::Liberty));
    assert_eq!((record.station, record.error), (1, None));
    assert_eq!((record.ticks, record.pressed), (Some(1234), None));
    let (position, _) = example_pose();
    assert!((record.position.unwrap() - position).amax() < 1e-12);
    let q = record.rotation.unwrap();
    let expected = [0.960_350, 0.064_509, -0.072_859, 0.261_261];
    for (found, expected) in [q.w, q.i, q.j, q.k].into_iter().zip(expected) {
        assert!((found - expected).abs() < 1e-6, "{q}");
    }
}

#[test]
fn bad_frames_are_refused_by_name() {
    let altered = |index: usize, byte: u8| {
        let mut frame = bytes(L1);
        frame[index] = byte;
        decode_frame(&frame, &INCHES)
    };
    for (index, byte, expected) in [
        (0, b'l', FrameFault::Header),
        (2, 0, FrameFault::Header),
        (2, 17, FrameFault::Header),
        (3, b'V', FrameFault::Header),
        (6, 0x22, FrameFault::Header),
        (7, 1, FrameFault::Header),
        (40, 0, FrameFault::Trailer),
        (23, 0x41, FrameFault::Number),
    ] {
        assert_eq!(altered(index, byte), Err(expected), "{index}");
    }
    assert!(matches!(
        decode_frame(&bytes(L1)[1..], &INCHES),
        Err(FrameFault::Length { found: 40, .. })
    ));
    // Letters that are not known and a reserved space are let through; an error byte excuses the rotation.
    let (model, _) = altered(0, b'Z').unwrap();
    assert_eq!(model, None);
    assert!(altered(5, b' ').is_ok());
    let (_, suspect) = altered(4, b'I').unwrap();
    assert_eq!((suspect.error, suspect.usable), (Some('I'), false));
}

#[test]
fn the_emulator_sends_the_example() {
    let mut emulator = LibertyEmulator::new(Model::Liberty);
    let (position, rotation) = example_pose();
    emulator.set_pose(1, position, rotation);
    emulator.push(0, b"o*,2,7,8,0\rf1\rq0\r");
    emulator.push(1234 * MS, b"P");
    let mut expected = bytes(L1);
    expected[3] = b'P';
    assert_eq!(emulator.poll(1234 * MS), expected);
    emulator.push(1234 * MS, b"\x16\r");
    let who = emulator.poll(1234 * MS);
    assert!((196..=247).contains(&who.len()) && who[0] == b'0');
    // Unknown items leave the list as it was.
    emulator.push(1234 * MS, b"O1,2,99\rP");
    assert_eq!(emulator.poll(1234 * MS), expected);
}

#[test]
fn every_model_starts_within_a_second() {
    for (model, rate_hz) in [
        (Model::Liberty, 240),
        (Model::Patriot, 60),
        (Model::Latus, 100),
    ] {
        let mut bench = bench(
            model,
            LibertySettings {
                hemisphere: Some([0.0, 0.0, 1.0]),
                attitude_filter: Some([0.0, 1.0, 0.0, 0.0]),
                ..LibertySettings::default()
            },
        );
        // A host that crashed left it streaming, with echo.
        bench.emulator.set_echo(true);
        bench.emulator.push(0, b"F1\rC\r");
        bench.open();
        let took_ns = bench.run_until(2 * S, running);
        assert!(took_ns < S, "{took_ns}");
        bench
            .events
            .retain(|event| !matches!(event, DeviceEvent::Tracker(_)));
        bench.run_for(S);
        let readings = bench.trackers();
        assert!(readings.len().abs_diff(rate_hz) <= 3, "{}", readings.len());
        let pose = readings.last().unwrap().transmitter_from_sensor().unwrap();
        let (position, rotation) = example_pose();
        assert!((pose.translation.vector - position.coords).amax() < 1e-6);
        assert!(pose.rotation.angle_to(&rotation) < 1e-5);
        let info = last_info(&bench);
        assert_eq!(
            (info.family, info.firmware.as_str(), info.tick_ns),
            (model.family(), "1.2.3", Some(1.0e6))
        );
        assert!(info.identity.contains("emulated"));
        assert_eq!(info.rate_hz, model.rate_hz().map(|rate_hz| rate_hz as f64));
        assert_eq!(bench.session.stats().resyncs, 0);
    }
}

#[test]
fn the_units_counter_goes_with_the_reading() {
    for counter in [Counter::Time, Counter::Frames] {
        let settings = LibertySettings {
            counter,
            stylus: true,
            ..LibertySettings::default()
        };
        let mut bench = bench(Model::Liberty, settings);
        bench.emulator.set_switch(1, true);
        bench.open();
        bench.run_until(2 * S, running);
        bench.run_for(2 * S);
        let tick_ns = last_info(&bench).tick_ns.unwrap();
        let readings = bench.trackers();
        let (first, last) = (readings[0], *readings.last().unwrap());
        let ticks = last.device_ticks.unwrap() - first.device_ticks.unwrap();
        let (device_ns, host_ns) = (ticks as f64 * tick_ns, last.stamp_ns - first.stamp_ns);
        // A millisecond of the stamp, and one of the step of this line.
        assert!(
            (device_ns - host_ns as f64).abs() < 3.0e6,
            "{counter:?}: {device_ns} {host_ns}"
        );
        assert_eq!(last.stylus_pressed, Some(true));
    }
}

#[test]
fn sixteen_stations_keep_apart_and_an_error_is_told() {
    let mut settings = LibertySettings::default();
    settings.stations[15] = true;
    let mut bench = bench(Model::Liberty, settings);
    for station in 1..=16 {
        bench.emulator.set_connected(station, true);
    }
    bench.emulator.set_error(16, Some(b'I'));
    bench.open();
    bench.run_until(2 * S, running);
    bench.run_for(500 * MS);
    let readings = bench.trackers();
    for (station, error) in [(1, None), (16, Some('I'))] {
        let own: Vec<_> = readings
            .iter()
            .filter(|reading| reading.station == station)
            .collect();
        assert!(own.len() >= 100, "{station}: {}", own.len());
        assert!(own.iter().all(|reading| reading.error == error));
        assert!(
            own.iter()
                .all(|reading| reading.world_from_sensor().is_some() == error.is_none())
        );
    }
    assert!(
        readings
            .iter()
            .all(|reading| [1, 16].contains(&reading.station))
    );
    assert_eq!(bench.session.state(), SessionState::Running);
    assert!(bench.session.stats().device_errors >= 100);
}

#[test]
fn frames_tell_the_model_where_the_introduction_does_not() {
    let mut session = LibertySession::new(LibertySettings::default());
    session.port_opened(0);
    let mut now_ns = 0;
    let mut info = None;
    let mut streams = false;
    let mut frame = bytes(L1);
    frame[..2].copy_from_slice(b"PA");
    while info
        .as_ref()
        .is_none_or(|info: &DeviceInfo| info.family != "Patriot")
    {
        now_ns += 10 * MS;
        assert!(now_ns < 5 * S);
        session.handle_timeout(now_ns);
        while let Some(command) = session.poll_transmit() {
            streams |= command == b"C\r";
            if command == b"\x16\r" {
                session.push(
                    now_ns,
                    format!("Patriot Ready!\r\n0{:<200}\r\n", " tracker").as_bytes(),
                );
            }
        }
        if streams {
            session.push(now_ns, &frame);
        }
        while let Some(event) = session.next_event() {
            if let DeviceEvent::Identified(found) = event {
                info = Some(found);
            }
        }
    }
}
