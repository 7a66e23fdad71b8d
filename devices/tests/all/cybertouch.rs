//! The vibrators of a CyberTouch: set by what the fingers are to feel, and still for any other glove.

use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::fault::Fault;
use tsukamu_devices::feedback::Feedback;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::cyberglove::session::CyberGloveSession;
use tsukamu_devices::glove::cyberglove::settings::{CyberGloveSettings, Sampling, SensorCount};
use tsukamu_devices::session::{Session, SessionState};

use crate::support::{Bench, MS, S};

fn bench(sampling: Sampling, has_touch: bool) -> Bench<CyberGloveSession, CyberGloveEmulator> {
    let settings = CyberGloveSettings {
        sampling,
        ..CyberGloveSettings::default()
    };
    let mut emulator = CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right);
    if has_touch {
        emulator.add_touch();
    }
    let session = CyberGloveSession::new(settings, GloveCalibration::default());
    let mut bench = Bench::new(session, emulator);
    bench.open();
    bench.run_until(S, |bench| bench.session.state() == SessionState::Running);
    bench
}

fn forces(resistance: [f64; 5]) -> Feedback {
    Feedback {
        resistance,
        vibration: None,
    }
}

#[test]
fn the_vibrators_follow_what_is_asked_for() {
    for sampling in [Sampling::Stream, Sampling::Poll { period_ns: 10 * MS }] {
        let mut bench = bench(sampling, true);
        bench.run_for(100 * MS);
        bench
            .session
            .set_feedback(bench.now_ns, forces([0.0, 0.5, 1.0, 0.0, 0.2]));
        bench.run_for(100 * MS);
        assert_eq!(bench.emulator.touch(), Some([0, 128, 255, 0, 51, 0]));
        assert!(bench.sent.contains(&b"A\xFF\0\x80\xFF\0\x33\0".to_vec()));
        // Nobody asks any more.
        bench.run_for(S);
        assert_eq!(bench.emulator.touch(), Some([0; 6]));
        let n_set = bench.sent.iter().filter(|sent| sent[0] == b'A').count();
        assert_eq!(n_set, 3, "still, set, still");
        // The answers are no records.
        let stats = bench.session.stats();
        assert_eq!((stats.dropped_records, stats.device_errors), (0, 0));
        assert_eq!(bench.session.farewell(), b"A\xFF\0\0\0\0\0\0\x03");
    }
}

#[test]
fn a_cybertouch_that_comes_back_is_still() {
    let mut bench = bench(Sampling::Stream, true);
    bench.session.set_feedback(bench.now_ns, forces([1.0; 5]));
    bench.run_for(100 * MS);
    assert_eq!(bench.emulator.touch(), Some([255, 255, 255, 255, 255, 0]));
    let unplugged = Fault::Unplugged {
        path: "/dev/x".to_owned(),
    };
    bench.session.port_lost(bench.now_ns, unplugged);
    bench.session.port_opened(bench.now_ns);
    bench.run_until(S, |bench| bench.session.state() == SessionState::Running);
    bench.run_for(100 * MS);
    assert_eq!(bench.emulator.touch(), Some([0; 6]));
}

#[test]
fn another_cyberglove_is_told_nothing() {
    let mut bench = bench(Sampling::Stream, false);
    bench.session.set_feedback(bench.now_ns, forces([1.0; 5]));
    bench.run_for(500 * MS);
    assert!(bench.sent.iter().all(|sent| sent[0] != b'A'));
    assert_eq!(bench.session.farewell(), [3]);
}
