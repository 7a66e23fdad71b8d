//! What Fastrak, Isotrak, 3SPACE, Liberty and Flock all promise: arbitrary bytes do no harm, and every loss is recovered from.

use nalgebra::{Isometry3, Point3, UnitQuaternion};
use proptest::collection::vec;
use proptest::prelude::{ProptestConfig, any, prop_assert, proptest};
use proptest::test_runner::RngSeed;
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::emulate::flock::FlockEmulator;
use tsukamu_devices::emulate::isotrak::IsotrakEmulator;
use tsukamu_devices::emulate::liberty::LibertyEmulator;
use tsukamu_devices::emulate::line_fault::{LineFaults, Noise};
use tsukamu_devices::fault::Fault;
use tsukamu_devices::reading::TrackerReading;
use tsukamu_devices::session::{Session, SessionState};
use tsukamu_devices::tracker::fastrak::session::FastrakSession;
use tsukamu_devices::tracker::fastrak::settings::FastrakSettings;
use tsukamu_devices::tracker::flock::decode::Output;
use tsukamu_devices::tracker::flock::session::FlockSession;
use tsukamu_devices::tracker::flock::settings::FlockSettings;
use tsukamu_devices::tracker::isotrak::protocol::Model as IsotrakModel;
use tsukamu_devices::tracker::isotrak::session::IsotrakSession;
use tsukamu_devices::tracker::isotrak::settings::IsotrakSettings;
use tsukamu_devices::tracker::liberty::protocol::Model as LibertyModel;
use tsukamu_devices::tracker::liberty::session::LibertySession;
use tsukamu_devices::tracker::liberty::settings::LibertySettings;

use crate::garbage::survive;
use crate::support::{Bench, MS, S};

/// Longest that any of these devices is deaf after a reset, and longest start-up after it.
const RESET_NS: u64 = 10 * S;
const START_NS: u64 = 3 * S;

fn pose() -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3);
    Isometry3::from_parts(Point3::new(0.2, 0.1, -0.1).into(), rotation)
}

/// An emulator that can be treated badly.
trait Victim: Emulator {
    fn faults(&mut self) -> &mut LineFaults;
    /// What a power cut does.
    fn restart(&mut self, now_ns: u64);
}

impl Victim for FastrakEmulator {
    fn faults(&mut self) -> &mut LineFaults {
        &mut self.faults
    }

    fn restart(&mut self, now_ns: u64) {
        self.push(now_ns, b"\r\x19");
    }
}

impl Victim for IsotrakEmulator {
    fn faults(&mut self) -> &mut LineFaults {
        &mut self.faults
    }

    fn restart(&mut self, now_ns: u64) {
        self.push(now_ns, b"\r\x19");
    }
}

impl Victim for LibertyEmulator {
    fn faults(&mut self) -> &mut LineFaults {
        &mut self.faults
    }

    fn restart(&mut self, now_ns: u64) {
        self.push(now_ns, b"\r\x19\r");
    }
}

impl Victim for FlockEmulator {
    fn faults(&mut self) -> &mut LineFaults {
        &mut self.faults
    }

    fn restart(&mut self, now_ns: u64) {
        Self::restart(self, now_ns);
    }
}

fn fastrak() -> Bench<FastrakSession, FastrakEmulator> {
    let mut emulator = FastrakEmulator::new();
    emulator.set_pose(1, pose().translation.vector.into(), pose().rotation);
    Bench::new(FastrakSession::new(FastrakSettings::default()), emulator)
}

fn isotrak(model: IsotrakModel) -> Bench<IsotrakSession, IsotrakEmulator> {
    let mut emulator = IsotrakEmulator::new(model);
    emulator.set_pose(1, pose().translation.vector.into(), pose().rotation);
    let settings = IsotrakSettings {
        model,
        ..IsotrakSettings::default()
    };
    Bench::new(IsotrakSession::new(settings), emulator)
}

fn liberty() -> Bench<LibertySession, LibertyEmulator> {
    let mut emulator = LibertyEmulator::new(LibertyModel::Patriot);
    emulator.set_pose(1, pose().translation.vector.into(), pose().rotation);
    Bench::new(LibertySession::new(LibertySettings::default()), emulator)
}

fn flock(group: bool, output: Output) -> Bench<FlockSession, FlockEmulator> {
    let mut emulator = if group {
        FlockEmulator::group(2)
    } else {
        FlockEmulator::alone()
    };
    emulator.set_pose(1, pose().translation.vector.into(), pose().rotation);
    let settings = FlockSettings {
        birds: if group { vec![1, 2] } else { vec![1] },
        group,
        output,
        ..FlockSettings::default()
    };
    Bench::new(FlockSession::new(settings), emulator)
}

/// Does the same to every device.
macro_rules! for_each_device {
    ($name:ident, $bench:ident => $body:block) => {{
        for_each_device!(@ $name, $bench, $body, "fastrak", fastrak());
        for_each_device!(@ $name, $bench, $body, "isotrak", isotrak(IsotrakModel::IsotrakTwo));
        for_each_device!(@ $name, $bench, $body, "3space", isotrak(IsotrakModel::ThreeSpace));
        for_each_device!(@ $name, $bench, $body, "liberty", liberty());
        for_each_device!(@ $name, $bench, $body, "flock", flock(false, Output::PositionQuaternion));
        for_each_device!(@ $name, $bench, $body, "flock angles", flock(false, Output::PositionAngles));
        for_each_device!(@ $name, $bench, $body, "flock group", flock(true, Output::PositionQuaternion));
    }};
    (@ $name:ident, $bench:ident, $body:block, $text:literal, $made:expr) => {{
        let $name = $text;
        let $bench = &mut $made;
        $body
    }};
}

fn start<Se: Session, E: Victim>(bench: &mut Bench<Se, E>) {
    bench.open();
    bench.run_until(5 * S, |bench| bench.session.stats().records >= 3);
}

fn is_right(reading: &TrackerReading) -> bool {
    reading.transmitter_from_sensor().is_some_and(|found| {
        let offset = found.translation.vector - pose().translation.vector;
        offset.amax() < 2.5e-4 && found.rotation.angle_to(&pose().rotation) < 2e-3
    })
}

fn last_of_station_one<Se: Session, E: Victim>(bench: &Bench<Se, E>) -> TrackerReading {
    let readings = bench.trackers();
    *readings
        .iter()
        .rfind(|reading| reading.station == 1)
        .unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, rng_seed: RngSeed::Fixed(1998), ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_do_no_harm(parts in vec((any::<u32>(), vec(any::<u8>(), 0..200)), 0..60)) {
        for_each_device!(name, bench => {
            prop_assert!(survive(&mut bench.session, &parts) <= 1024, "{name}");
        });
    }

    #[test]
    fn bytes_with_few_phases_do_no_harm(parts in vec((any::<u32>(), vec(0_u8..0x84, 0..200)), 0..60)) {
        for_each_device!(name, bench => {
            prop_assert!(survive(&mut bench.session, &parts) <= 1024, "{name}");
        });
    }

    #[test]
    fn arbitrary_commands_do_no_harm(parts in vec((any::<u32>(), vec(any::<u8>(), 0..200)), 0..60)) {
        for_each_device!(name, bench => {
            let mut now_ns = 0;
            for (pause_ns, junk) in &parts {
                now_ns += u64::from(*pause_ns);
                bench.emulator.push(now_ns, junk);
                prop_assert!(bench.emulator.poll(now_ns).len() < 100_000, "{name}");
            }
        });
    }

    #[test]
    fn all_are_in_step_within_two_records(junk in vec(any::<u8>(), 0..60)) {
        for_each_device!(name, bench => {
            start(bench);
            // The longest time between two records is 17 ms, so at least six come in 105 ms. Two may be lost, and then
            // all are right.
            bench.session.push(bench.now_ns, &junk);
            bench.events.clear();
            bench.run_for(105 * MS);
            let readings = bench.trackers();
            prop_assert!(readings.len() >= 4, "{name}: {}", readings.len());
            prop_assert!(is_right(&last_of_station_one(bench)), "{name}");
        });
    }
}

#[test]
fn one_byte_in_a_hundred_is_lived_with() {
    for_each_device!(name, bench => {
        start(bench);
        bench.noise = Noise::new(0.01);
        bench.events.clear();
        let before = bench.session.stats();
        bench.run_for(20 * S);
        let after = bench.session.stats();
        let readings = bench.trackers();
        let own: Vec<_> = readings
            .iter()
            .filter(|reading| reading.station == 1)
            .collect();
        // 60 records in a second are the least.
        assert!(own.len() > 700, "{name}: {}", own.len());
        assert!(after.resyncs > before.resyncs, "{name}");
        assert_eq!(after.restarts, before.restarts, "{name}");
        // There is no check sum on these lines: a byte of a position or an angle that is replaced cannot be told.
        let n_right = own.iter().filter(|reading| is_right(reading)).count();
        assert!(
            n_right * 100 > own.len() * 80,
            "{name}: {n_right} of {}",
            own.len()
        );
        bench.noise = Noise::new(0.0);
        bench.run_for(100 * MS);
        assert!(is_right(&last_of_station_one(bench)), "{name}");
    });
}

#[test]
fn a_stalled_device_is_named_and_comes_back() {
    for_each_device!(name, bench => {
        start(bench);
        bench.emulator.faults().stop_mid_record();
        let took_ns = bench.run_until(3 * S, |bench| bench.session.fault().is_some());
        assert!(took_ns < 2_100 * MS, "{name}: {took_ns}");
        assert!(bench.states().contains(&SessionState::Stalled), "{name}");
        assert!(
            matches!(bench.session.fault(), Some(Fault::Silent { .. })),
            "{name}"
        );
        bench.run_for(20 * S);
        bench.emulator.faults().thaw();
        bench.run_until(20 * S, |bench| {
            bench.session.state() == SessionState::Running
        });
        assert_eq!(bench.session.fault(), None, "{name}");
        assert!(is_right(&last_of_station_one(bench)), "{name}");
    });
}

#[test]
fn a_device_that_resets_in_mid_record_comes_back() {
    for_each_device!(name, bench => {
        start(bench);
        bench.emulator.faults().stop_mid_record();
        bench.run_for(50 * MS);
        bench.emulator.faults().thaw();
        let now_ns = bench.now_ns;
        bench.emulator.restart(now_ns);
        bench.run_until(3 * S, |bench| {
            bench.session.state() == SessionState::Stalled
                || bench.session.state() == SessionState::Resetting
        });
        let took_ns = bench.run_until(RESET_NS + START_NS, |bench| {
            bench.session.state() == SessionState::Running
        });
        assert!(took_ns < RESET_NS, "{name}: {took_ns}");
        bench.run_for(100 * MS);
        assert!(is_right(&last_of_station_one(bench)), "{name}");
    });
}

#[test]
fn a_device_that_is_plugged_in_again_comes_back() {
    for_each_device!(name, bench => {
        start(bench);
        for _ in 0..3 {
            let path = "/dev/x".to_owned();
            bench
                .session
                .port_lost(bench.now_ns, Fault::Unplugged { path });
            assert_eq!(bench.session.state(), SessionState::Absent, "{name}");
            assert_eq!(bench.session.deadline(), None, "{name}");
            bench.run_for(S);
            bench.session.port_opened(bench.now_ns);
            let took_ns = bench.run_until(START_NS, |bench| {
                bench.session.state() == SessionState::Running
            });
            assert!(took_ns < S, "{name}: {took_ns}");
            assert!(is_right(&last_of_station_one(bench)), "{name}");
        }
    });
}

#[test]
fn a_flood_does_not_grow_anything() {
    // Endless plausible headers, endless text without an end, endless phases, endless records without a rotation.
    let patterns = [
        &b"\xB01 "[..],
        b"21S",
        b"2",
        b"0",
        b"LY\x01C \0\x21\0",
        b"\xAA\x15",
        b"\xAA\x15\x2A\x75\x0E\x07\0\0\0\0\0\0\0\0",
        b"\0",
        b"(\0",
    ];
    for pattern in patterns {
        let flood = pattern.repeat(20_000 / pattern.len());
        for_each_device!(name, bench => {
            let session: &mut dyn Session = &mut bench.session;
            session.port_opened(0);
            let mut n_commands = 0;
            for round in 1..40 {
                session.handle_timeout(round * 300 * MS);
                session.push(round * 300 * MS, &flood);
            }
            while session.poll_transmit().is_some() {
                n_commands += 1;
            }
            assert!(n_commands <= 64, "{name}: {n_commands}");
            let mut n_events = 0;
            while session.next_event().is_some() {
                n_events += 1;
            }
            assert!(n_events <= 1024, "{name}: {n_events}");
        });
    }
}
