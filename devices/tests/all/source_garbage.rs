//! Datagrams of strangers: no panic, no growth, and the next good frame is a hand again.

use proptest::collection::vec;
use proptest::prelude::{ProptestConfig, any, prop_assert, proptest};
use proptest::test_runner::RngSeed;
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::source::{SentHand, SourceEmulator, SourceKind};
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::session::{DeviceEvent, Session, SessionState};
use tsukamu_devices::source::rokoko::settings::RokokoSettings;
use tsukamu_devices::source::session::SourceSession;

use crate::garbage::survive;
use crate::support::{Bench, MS, S};

const KINDS: [SourceKind; 4] = [
    SourceKind::Vmc,
    SourceKind::Rokoko,
    SourceKind::RokokoLz4,
    SourceKind::Udcap,
];

fn session(kind: SourceKind) -> SourceSession {
    let calibration = GloveCalibration::default();
    match kind {
        SourceKind::Vmc => SourceSession::vmc(calibration),
        SourceKind::Rokoko | SourceKind::RokokoLz4 => {
            SourceSession::rokoko(&RokokoSettings::default(), calibration)
        }
        SourceKind::Udcap => SourceSession::udcap(calibration),
    }
}

fn bench(kind: SourceKind) -> Bench<SourceSession, SourceEmulator> {
    let mut emulator = SourceEmulator::new(kind);
    emulator.set_hand(Handedness::Left, Some(SentHand::flat()));
    emulator.set_hand(Handedness::Right, Some(SentHand::flat()));
    Bench::new(session(kind), emulator)
}

/// The datagrams of two frames.
fn datagrams(kind: SourceKind) -> Vec<Vec<u8>> {
    let mut emulator = bench(kind).emulator;
    (0..40)
        .map(|k| emulator.poll(k * MS))
        .filter(|datagram| !datagram.is_empty())
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, rng_seed: RngSeed::Fixed(1998), ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_do_no_harm(parts in vec((any::<u32>(), vec(any::<u8>(), 0..200)), 0..60)) {
        for kind in KINDS {
            prop_assert!(survive(&mut session(kind), &parts) <= 1024);
        }
    }

    /// What begins as it should gets further in than what does not.
    #[test]
    fn plausible_beginnings_do_no_harm(
        head in 0..6_usize, parts in vec((any::<u32>(), vec(any::<u8>(), 0..200)), 0..60),
    ) {
        let head = [
            &b"#bundle\0\0\0\0\0\0\0\0\x01"[..],
            b"/VMC/Ext/Bone/Pos\0\0\0,sfffffff\0\0\0LeftHand\0\0\0\0",
            b"\x04\x22\x4D\x18\x60\x40\x82",
            b"{\"scene\":{\"actors\":[{\"body\":{\"leftHand\":",
            b"{\"Parameter\":[{\"Name\":\"l0\",\"Value\":",
            b"{\"",
        ][head];
        let parts: Vec<(u32, Vec<u8>)> = parts
            .into_iter()
            .map(|(pause_ns, tail)| (pause_ns, [head, &tail].concat()))
            .collect();
        for kind in KINDS {
            prop_assert!(survive(&mut session(kind), &parts) <= 1024);
        }
    }

    /// Good datagrams with bytes changed, cut off at any place: whatever still is a hand has finite numbers.
    #[test]
    fn spoiled_frames_give_finite_hands_or_none(
        changes in vec((any::<usize>(), any::<u8>()), 0..8), cut in any::<usize>(),
    ) {
        for kind in KINDS {
            let mut session = session(kind);
            session.port_opened(0);
            for datagram in datagrams(kind) {
                let mut spoiled = datagram.clone();
                for (place, byte) in &changes {
                    let n_bytes = spoiled.len();
                    spoiled[place % n_bytes] = *byte;
                }
                spoiled.truncate(1 + cut % (2 * datagram.len()));
                session.push(MS, &spoiled);
            }
            while let Some(event) = session.next_event() {
                match event {
                    DeviceEvent::Glove(reading) => {
                        let mut sensors = reading.sensors.iter().flatten();
                        prop_assert!(sensors.all(|sensor| sensor.angle_rad.is_finite() && sensor.raw.is_finite()));
                    }
                    DeviceEvent::Tracker(reading) => {
                        let pose = reading.world_from_sensor().expect("both are valid");
                        prop_assert!(pose.translation.vector.iter().all(|x| x.is_finite()));
                        prop_assert!((pose.rotation.norm() - 1.0).abs() < 1e-9);
                    }
                    _ => {}
                }
            }
        }
    }

    #[test]
    fn a_source_is_in_step_within_two_frames(junk in vec(any::<u8>(), 0..400)) {
        for kind in KINDS {
            let mut bench = bench(kind);
            bench.open();
            bench.run_until(S, |bench| bench.session.state() == SessionState::Running);
            bench.session.push(bench.now_ns, &junk);
            let before = bench.gloves().len();
            // Two frames at 60 Hz.
            bench.run_for(40 * MS);
            prop_assert!(bench.gloves().len() >= before + 2, "{kind:?}");
        }
    }
}

#[test]
fn one_percent_of_lost_and_spoiled_bytes_costs_few_frames() {
    for kind in KINDS {
        let mut bench = bench(kind);
        bench.open();
        bench.run_for(S);
        let before = bench.gloves().len();
        // A byte in the middle of each of 30 datagrams.
        bench.emulator.faults.drop_bytes(30);
        bench.run_for(2 * S);
        assert_eq!(bench.session.state(), SessionState::Running, "{kind:?}");
        assert!(bench.session.stats().dropped_records >= 10, "{kind:?}");
        // Two hands at 60 Hz in 2 s are 240.
        let n_gloves = bench.gloves().len() - before;
        assert!(n_gloves >= 160, "{kind:?} {n_gloves}");
    }
}
