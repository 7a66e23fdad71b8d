//! The Fastrak's start-up and recovery, by hand-advanced time.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::fault::Fault;
use tsukamu_devices::session::{DeviceEvent, PortRequest, Session, SessionState};
use tsukamu_devices::tracker::fastrak::decode::Encoding;
use tsukamu_devices::tracker::fastrak::session::FastrakSession;
use tsukamu_devices::tracker::fastrak::settings::FastrakSettings;

use crate::support::{Bench, Loss, MS, S};

type TrackerBench = Bench<FastrakSession, FastrakEmulator>;

fn position() -> Point3<f64> {
    Point3::new(0.31, -0.12, 0.05)
}

fn rotation() -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.3, 1.1))
}

fn bench(settings: FastrakSettings) -> TrackerBench {
    let mut emulator = FastrakEmulator::new();
    for station in 1..=4 {
        emulator.set_pose(station, position() * f64::from(station), rotation());
    }
    Bench::new(FastrakSession::new(settings), emulator)
}

fn running(bench: &TrackerBench) -> bool {
    bench.session.state() == SessionState::Running
}

#[test]
fn starts_within_a_second_in_both_encodings() {
    for (encoding, tolerance_m) in [(Encoding::Binary, 1e-6), (Encoding::Ascii, 1e-4)] {
        let mut bench = bench(FastrakSettings {
            encoding,
            hemisphere: Some([0.0, 0.0, 1.0]),
            position_filter: Some([0.2, 0.2, 0.8, 0.8]),
            attitude_filter: Some([0.2, 0.2, 0.8, 0.8]),
            ..FastrakSettings::default()
        });
        // A host that crashed left it streaming.
        bench.emulator.push(0, b"C");
        bench.open();
        let took_ns = bench.run_until(S, running);
        assert!(took_ns < 300 * MS, "{took_ns}");
        assert!(bench.events.iter().any(|event| matches!(
            event,
            DeviceEvent::Identified(info) if info.firmware == "3.1.00" && info.identity == "EMULATED TRACKER"
        )));
        bench.run_for(S);
        let readings = bench.trackers();
        assert!((118..=123).contains(&readings.len()), "{}", readings.len());
        let pose = readings[60].transmitter_from_sensor().unwrap();
        assert!((pose.translation.vector - position().coords).amax() < tolerance_m);
        assert!(pose.rotation.angle_to(&rotation()) < 1e-3);
        let world = readings[60].world_from_sensor().unwrap().translation.vector;
        assert!(
            (world - Vector3::new(-0.12, -0.05, -0.31)).amax() < tolerance_m,
            "{world}"
        );
        let stats = bench.session.stats();
        assert_eq!(
            (stats.resyncs, stats.device_errors, stats.restarts),
            (0, 0, 0)
        );
    }
}

#[test]
fn a_half_given_command_does_not_hide_the_unit() {
    for begun in [&b"G"[..], b"CG15,0", b"CO1,2", b"l", b"Cx0.2,0.2", b"f"] {
        let mut bench = bench(FastrakSettings::default());
        bench.emulator.push(0, begun);
        bench.open();
        let took_ns = bench.run_until(S, running);
        assert!(took_ns < 300 * MS, "{begun:?}: {took_ns}");
        bench.run_for(100 * MS);
        let stats = bench.session.stats();
        assert_eq!((stats.resyncs, stats.restarts), (0, 0), "{begun:?}");
        let last = *bench.trackers().last().unwrap();
        assert!((last.position.unwrap() - position()).amax() < 1e-6);
    }
}

#[test]
fn stations_share_the_rate_and_keep_apart() {
    let mut bench = bench(FastrakSettings {
        stations: [true, false, true, false],
        ..FastrakSettings::default()
    });
    bench.open();
    bench.run_until(S, running);
    bench.emulator.set_connected(3, false);
    bench.events.clear();
    bench.run_for(S);
    let readings = bench.trackers();
    for (station, valid) in [(1, true), (3, false)] {
        let own: Vec<_> = readings
            .iter()
            .filter(|reading| reading.station == station)
            .collect();
        assert!((59..=61).contains(&own.len()), "{station}: {}", own.len());
        let last = own.last().unwrap();
        assert_eq!((last.position_valid, last.rotation_valid), (valid, valid));
        assert_eq!(last.error, (!valid).then_some('k'));
        assert_eq!(last.world_from_sensor().is_some(), valid);
        assert!(
            own.windows(2)
                .all(|pair| pair[0].sequence + 1 == pair[1].sequence)
        );
    }
    assert!(
        readings
            .iter()
            .all(|reading| [1, 3].contains(&reading.station))
    );
    // An error letter keeps the link healthy.
    assert_eq!(bench.session.state(), SessionState::Running);
}

#[test]
fn survives_loss_and_counts_it() {
    for encoding in [Encoding::Binary, Encoding::Ascii] {
        let mut bench = bench(FastrakSettings {
            encoding,
            ..FastrakSettings::default()
        });
        bench.loss = Loss::one_in(300);
        bench.open();
        bench.run_until(60 * S, running);
        bench.run_for(20 * S);
        let stats = bench.session.stats();
        assert!(stats.records > 1500, "{stats:?}");
        assert!(stats.resyncs > 20, "{stats:?}");
        for reading in bench.trackers() {
            let offset = reading.position.unwrap() - position();
            assert!(offset.amax() < 1e-4, "{encoding:?}: {offset}");
        }
    }
}

#[test]
fn a_silent_unit_is_reset_ever_more_strongly() {
    let mut bench = bench(FastrakSettings::default());
    bench.open();
    bench.run_until(S, running);
    bench.emulator.faults.stop_mid_record();
    let took_ns = bench.run_until(3 * S, |bench| bench.session.fault().is_some());
    assert!(took_ns < 2_100 * MS, "{took_ns}");
    assert!(bench.states().contains(&SessionState::Stalled));
    assert_eq!(
        bench.session.fault(),
        Some(&Fault::Silent { device: "Fastrak" })
    );
    bench.run_until(60 * S, |bench| bench.requests.len() == 2);
    assert_eq!(bench.requests, [PortRequest::Reopen; 2]);
    assert!(bench.sent.contains(&b"c\r\x19".to_vec()));
    bench.emulator.faults.thaw();
    bench.run_until(60 * S, running);
    assert_eq!(bench.session.fault(), None);
}

#[test]
fn a_unit_that_lost_its_settings_gets_them_again() {
    let mut bench = bench(FastrakSettings::default());
    bench.open();
    bench.run_until(S, running);
    // A power cut: inches, ASCII, polled, and deaf for a while.
    bench.emulator.reinitialise_takes_ns = S;
    let now_ns = bench.now_ns;
    bench.emulator.push(now_ns, b"\x19");
    bench.run_until(20 * S, |bench| bench.session.stats().restarts == 1);
    assert!(bench.states().contains(&SessionState::Stalled));
    bench.run_until(20 * S, running);
    bench.run_for(100 * MS);
    let last = *bench.trackers().last().unwrap();
    assert!((last.position.unwrap() - position()).amax() < 1e-6);
}

#[test]
fn a_control_record_between_data_does_no_harm() {
    let mut bench = bench(FastrakSettings::default());
    bench.open();
    bench.run_until(S, running);
    for _ in 0..20 {
        let now_ns = bench.now_ns;
        bench.emulator.push(now_ns, b"SO9,2\r");
        bench.run_for(50 * MS);
    }
    let stats = bench.session.stats();
    assert_eq!((stats.resyncs, stats.dropped_records), (0, 0));
    assert_eq!(stats.device_errors, 20);
}

#[test]
fn a_unit_that_refuses_centimetres_is_not_believed() {
    let mut session = FastrakSession::new(FastrakSettings::default());
    session.port_opened(0);
    let inches = format!("21S3F1    F31  3.1.00{:<32}\r\n", "STUBBORN");
    let mut now_ns = 0;
    let mut streamed = false;
    let refused = |session: &FastrakSession| matches!(session.fault(), Some(Fault::Refused { setting, .. }) if setting == "centimetres");
    while !refused(&session) {
        now_ns += 10 * MS;
        assert!(now_ns < 20 * S);
        session.handle_timeout(now_ns);
        let mut asked = false;
        while let Some(command) = session.poll_transmit() {
            asked |= command == b"S";
            streamed |= command == b"C";
        }
        if asked {
            session.push(now_ns, inches.as_bytes());
        }
    }
    assert!(!streamed);
}
