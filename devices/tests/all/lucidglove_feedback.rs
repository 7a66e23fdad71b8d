//! What goes back to a LucidGlove: limits for its servos and vibrations.

use tsukamu_devices::emulate::lucidglove::LucidGloveBuild;
use tsukamu_devices::fault::Fault;
use tsukamu_devices::feedback::{Feedback, Vibration};
use tsukamu_devices::glove::lucidglove::protocol::Encoding;
use tsukamu_devices::glove::lucidglove::settings::LucidGloveSettings;
use tsukamu_devices::session::Session;

use crate::lucidglove_session::{bench, running};
use crate::support::{MS, S};

const FREE: &str = "A0B0C0D0E0";

fn forces(resistance: [f64; 5]) -> Feedback {
    Feedback {
        resistance,
        vibration: None,
    }
}

/// The commands that the emulator heard, each with when, in ms.
fn heard(
    emulator: &tsukamu_devices::emulate::lucidglove::LucidGloveEmulator,
) -> Vec<(u64, String)> {
    let text = |line: &[u8]| String::from_utf8(line.to_vec()).unwrap();
    let heard = emulator.heard().iter();
    heard
        .map(|heard| (heard.at_ns / MS, text(&heard.line)))
        .collect()
}

#[test]
fn forces_follow_what_is_asked_for() {
    let mut bench = bench(LucidGloveSettings::default(), LucidGloveBuild::default());
    bench.open();
    bench.run_until(S, running);
    bench.run_for(100 * MS);
    let half = forces([0.0, 0.5, 1.0, 0.0, 0.0]);
    for _ in 0..4 {
        bench.session.set_feedback(bench.now_ns, half);
        bench.run_for(200 * MS);
    }
    assert_eq!(bench.emulator.servos_deg(), [0.0, 90.0, 180.0, 0.0, 0.0]);
    bench.session.set_feedback(bench.now_ns, Feedback::FREE);
    bench.run_for(200 * MS);
    let lines: Vec<String> = heard(&bench.emulator).into_iter().map(|(_, l)| l).collect();
    assert_eq!(lines, [FREE, "A0B500C1000D0E0", FREE]);
    // Every other line was answered too.
    assert!(bench.emulator.n_blank() > 100);
}

#[test]
fn forces_are_given_within_some_lines_and_not_too_often() {
    let mut bench = bench(LucidGloveSettings::default(), LucidGloveBuild::default());
    bench.open();
    bench.run_until(S, running);
    bench.run_for(S);
    bench.session.set_feedback(bench.now_ns, forces([1.0; 5]));
    let took_ns = bench.run_until(S, |bench| bench.emulator.limits() == [1000; 5]);
    assert!(took_ns <= 20 * MS, "{took_ns}");
    let n_before = bench.emulator.heard().len();
    // Something else a thousand times in a second.
    for round in 0..1000 {
        let share = f64::from(round % 10) / 10.0;
        bench.session.set_feedback(bench.now_ns, forces([share; 5]));
        bench.run_for(MS);
    }
    let n_commands = bench.emulator.heard().len() - n_before;
    assert!((30..=51).contains(&n_commands), "{n_commands}");
    let times: Vec<u64> = heard(&bench.emulator)
        .into_iter()
        .map(|(at, _)| at)
        .collect();
    assert!(
        times.windows(2).all(|pair| pair[1] - pair[0] >= 19),
        "{times:?}"
    );
}

#[test]
fn fingers_are_freed_when_nobody_asks_any_more() {
    let mut bench = bench(LucidGloveSettings::default(), LucidGloveBuild::default());
    bench.open();
    bench.run_until(S, running);
    bench.session.set_feedback(bench.now_ns, forces([1.0; 5]));
    bench.run_for(900 * MS);
    assert_eq!(bench.emulator.limits(), [1000; 5]);
    bench.run_for(200 * MS);
    assert_eq!(bench.emulator.limits(), [0; 5]);
}

#[test]
fn a_glove_that_comes_back_is_freed_first_and_the_farewell_frees_it() {
    for (encoding, free) in [
        (Encoding::Alpha, "A0B0C0D0E0\n"),
        (Encoding::Legacy, "0&0&0&0&0\n"),
    ] {
        let build = LucidGloveBuild {
            encoding,
            ..LucidGloveBuild::default()
        };
        let mut bench = bench(LucidGloveSettings::default(), build);
        bench.open();
        bench.run_until(S, running);
        bench.session.set_feedback(bench.now_ns, forces([1.0; 5]));
        bench.run_for(100 * MS);
        assert_eq!(bench.emulator.limits(), [1000; 5]);
        assert_eq!(bench.session.farewell(), free.as_bytes());
        let n_before = bench.emulator.heard().len();
        let unplugged = Fault::Unplugged {
            path: "/dev/x".to_owned(),
        };
        bench.session.port_lost(bench.now_ns, unplugged);
        bench.now_ns += 200 * MS;
        bench.session.port_opened(bench.now_ns);
        bench.run_until(S, running);
        bench.run_for(50 * MS);
        let next = &heard(&bench.emulator)[n_before];
        assert_eq!(next.1, free.trim_end());
        assert_eq!(bench.emulator.limits(), [0; 5]);
    }
}

#[test]
fn the_scale_and_silence_are_set() {
    let settings = LucidGloveSettings {
        feedback_max: 4095,
        ..LucidGloveSettings::default()
    };
    let mut library = bench(settings, LucidGloveBuild::default());
    library.open();
    library.run_until(S, running);
    library
        .session
        .set_feedback(library.now_ns, forces([1.0, 0.5, 0.0, 0.0, 0.0]));
    library.run_for(100 * MS);
    assert_eq!(library.emulator.limits(), [4095, 2048, 0, 0, 0]);

    let settings = LucidGloveSettings {
        feedback: false,
        ..LucidGloveSettings::default()
    };
    let mut off = bench(settings, LucidGloveBuild::default());
    off.open();
    off.run_until(S, running);
    off.session.set_feedback(off.now_ns, forces([1.0; 5]));
    off.run_for(S);
    assert_eq!(heard(&off.emulator), []);
    assert_eq!(off.session.farewell(), b"");
    assert!(
        off.session.stats().records > 150,
        "its lines are answered all the same"
    );
}

#[test]
fn a_vibration_is_sent_once_and_the_forces_again_behind_it() {
    let vibration = Vibration {
        frequency_hz: 150.0,
        duration_s: 0.05,
        amplitude: 0.5,
    };
    let touch = Feedback {
        resistance: [0.0, 1.0, 0.0, 0.0, 0.0],
        vibration: Some(vibration),
    };
    for haptics in [true, false] {
        let settings = LucidGloveSettings {
            haptics,
            ..LucidGloveSettings::default()
        };
        let mut bench = bench(settings, LucidGloveBuild::default());
        bench.open();
        bench.run_until(S, running);
        bench.run_for(100 * MS);
        bench.session.set_feedback(bench.now_ns, touch);
        bench.run_for(200 * MS);
        let expected: &[&str] = if haptics { &["F150.00G0.05H0.50"] } else { &[] };
        assert_eq!(bench.emulator.vibrations(), expected);
        assert_eq!(bench.emulator.limits(), [0, 1000, 0, 0, 0]);
        // The extra line does not stay ahead.
        bench.run_for(100 * MS);
        assert!(bench.emulator.n_unread() <= 1);
    }
}
