//! Arbitrary bytes: no panic, no growth, and in step again within two records.

use nalgebra::{Point3, UnitQuaternion};
use proptest::collection::vec;
use proptest::prelude::{ProptestConfig, any, prop_assert, proptest};
use proptest::test_runner::RngSeed;
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::cyberglove::session::CyberGloveSession;
use tsukamu_devices::glove::cyberglove::settings::{CyberGloveSettings, SensorCount};
use tsukamu_devices::session::{PortRequest, Session};
use tsukamu_devices::tracker::fastrak::decode::Encoding;
use tsukamu_devices::tracker::fastrak::session::FastrakSession;
use tsukamu_devices::tracker::fastrak::settings::FastrakSettings;

use crate::support::{Bench, MS, S};

fn glove() -> Bench<CyberGloveSession, CyberGloveEmulator> {
    Bench::new(
        CyberGloveSession::new(CyberGloveSettings::default(), GloveCalibration::default()),
        CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right),
    )
}

fn tracker(encoding: Encoding) -> Bench<FastrakSession, FastrakEmulator> {
    let settings = FastrakSettings {
        encoding,
        ..FastrakSettings::default()
    };
    let mut emulator = FastrakEmulator::new();
    emulator.set_pose(
        1,
        Point3::new(0.2, 0.1, -0.1),
        UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3),
    );
    Bench::new(FastrakSession::new(settings), emulator)
}

/// Pushes junk at odd moments and asks for everything that can be asked.
pub(crate) fn survive(session: &mut dyn Session, parts: &[(u32, Vec<u8>)]) -> usize {
    let mut now_ns = 0;
    let mut n_events = 0;
    session.port_opened(0);
    for (pause_ns, junk) in parts {
        now_ns += u64::from(*pause_ns);
        session.handle_timeout(now_ns);
        session.push(now_ns, junk);
        while session.poll_transmit().is_some() {}
        while let Some(request) = session.poll_port_request() {
            if request == PortRequest::Reopen {
                session.port_opened(now_ns);
            }
        }
        assert!(
            session
                .deadline()
                .is_none_or(|deadline_ns| deadline_ns + 1 > 0)
        );
    }
    while session.next_event().is_some() {
        n_events += 1;
    }
    n_events
}

/// Readings that get through between the first good record after the junk and the third.
pub(crate) fn recovers<Se: Session, E: Emulator>(bench: &mut Bench<Se, E>, junk: &[u8]) -> u64 {
    bench.open();
    bench.run_until(3 * S, |bench| bench.session.stats().records >= 3);
    bench.session.push(bench.now_ns, junk);
    let before = bench.session.stats().records;
    bench.run_for(30 * MS);
    bench.session.stats().records - before
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, rng_seed: RngSeed::Fixed(1998), ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_do_no_harm(parts in vec((any::<u32>(), vec(any::<u8>(), 0..200)), 0..60)) {
        prop_assert!(survive(&mut glove().session, &parts) <= 1024);
        prop_assert!(survive(&mut tracker(Encoding::Binary).session, &parts) <= 1024);
        prop_assert!(survive(&mut tracker(Encoding::Ascii).session, &parts) <= 1024);
    }

    #[test]
    fn arbitrary_commands_do_no_harm(parts in vec((any::<u32>(), vec(any::<u8>(), 0..200)), 0..60)) {
        let mut now_ns = 0;
        let (mut glove, mut tracker) = (glove().emulator, tracker(Encoding::Binary).emulator);
        for (pause_ns, junk) in &parts {
            now_ns += u64::from(*pause_ns);
            glove.push(now_ns, junk);
            tracker.push(now_ns, junk);
            prop_assert!(glove.poll(now_ns).len() < 100_000);
            prop_assert!(tracker.poll(now_ns).len() < 100_000);
        }
    }

    // 30 ms hold at least three records of each device. Junk of less than a record can swallow one record by running
    // into it, and the next may be needed to confirm the step.
    #[test]
    fn a_glove_is_in_step_within_two_records(junk in vec(any::<u8>(), 0..60)) {
        prop_assert!(recovers(&mut glove(), &junk) >= 1);
    }

    #[test]
    fn a_tracker_is_in_step_within_two_records(junk in vec(any::<u8>(), 0..60)) {
        prop_assert!(recovers(&mut tracker(Encoding::Binary), &junk) >= 1);
        prop_assert!(recovers(&mut tracker(Encoding::Ascii), &junk) >= 1);
    }
}

#[test]
fn a_flood_does_not_grow_anything() {
    // Endless plausible headers, endless text without an end, endless silence.
    for pattern in [&b"01 "[..], b"21S", b"S", b"2", b"\0", b"eg\0", b"?G"] {
        let flood = pattern.repeat(100_000 / pattern.len());
        for session in [
            &mut glove().session as &mut dyn Session,
            &mut tracker(Encoding::Binary).session,
        ] {
            session.port_opened(0);
            for round in 1..40 {
                session.handle_timeout(round * 300 * MS);
                session.push(round * 300 * MS, &flood);
            }
            let mut n_events = 0;
            while session.next_event().is_some() {
                n_events += 1;
            }
            assert!(n_events <= 1024);
            let mut n_commands = 0;
            while session.poll_transmit().is_some() {
                n_commands += 1;
            }
            assert!(n_commands <= 64);
        }
    }
}
