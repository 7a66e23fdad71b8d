//! Arbitrary bytes at both ends of a LucidGlove's line: no panic, no growth, and in step again within two records.

use proptest::collection::vec;
use proptest::prelude::{ProptestConfig, any, prop_assert, proptest};
use proptest::test_runner::RngSeed;
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::lucidglove::{LucidGloveBuild, LucidGloveEmulator};
use tsukamu_devices::glove::lucidglove::decode::decode_line;
use tsukamu_devices::glove::lucidglove::protocol::Encoding;
use tsukamu_devices::glove::lucidglove::settings::LucidGloveSettings;
use tsukamu_devices::session::Session;

use crate::garbage::{recovers, survive};
use crate::lucidglove_session::bench;
use crate::support::MS;

fn build(is_legacy: bool) -> LucidGloveBuild {
    let encoding = if is_legacy {
        Encoding::Legacy
    } else {
        Encoding::Alpha
    };
    LucidGloveBuild {
        encoding,
        ..LucidGloveBuild::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, rng_seed: RngSeed::Fixed(1998), ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_do_no_harm(
        parts in vec((any::<u32>(), vec(any::<u8>(), 0..200)), 0..60),
        texts in vec((any::<u32>(), "[A-P(Z)&,0-9\n]{0,80}"), 0..60),
    ) {
        let mut bench = bench(LucidGloveSettings::default(), LucidGloveBuild::default());
        prop_assert!(survive(&mut bench.session, &parts) <= 1024);
        let texts: Vec<(u32, Vec<u8>)> =
            texts.into_iter().map(|(pause, text)| (pause, text.into_bytes())).collect();
        prop_assert!(survive(&mut bench.session, &texts) <= 1024);
        for (_, line) in parts.iter().chain(&texts) {
            let _ = decode_line(line);
        }
    }

    #[test]
    fn arbitrary_commands_do_no_harm(parts in vec((any::<u32>(), vec(any::<u8>(), 0..200)), 0..60)) {
        let mut now_ns = 0;
        let mut glove = LucidGloveEmulator::new(LucidGloveBuild::default());
        for (pause_ns, junk) in &parts {
            now_ns += u64::from(*pause_ns);
            glove.push(now_ns, junk);
            prop_assert!(glove.poll(now_ns).len() < 100_000);
        }
    }

    // 30 ms hold at least five lines. Junk without a line end spoils one, and is the end of another's beginning.
    #[test]
    fn a_glove_is_in_step_within_two_records(junk in vec(any::<u8>(), 0..200), is_legacy in any::<bool>()) {
        let mut bench = bench(LucidGloveSettings::default(), build(is_legacy));
        prop_assert!(recovers(&mut bench, &junk) >= 1);
    }
}

#[test]
fn a_flood_does_not_grow_anything() {
    for pattern in [
        &b"A1"[..],
        b"A1\n",
        b"(",
        b"1&",
        b"\n",
        b"A1B2C3D4E5\n",
        b"\0",
    ] {
        let flood = pattern.repeat(20_000 / pattern.len());
        let mut bench = bench(LucidGloveSettings::default(), LucidGloveBuild::default());
        let session = &mut bench.session;
        session.port_opened(0);
        for round in 1..40 {
            session.handle_timeout(round * 300 * MS);
            session.push(round * 300 * MS, &flood);
        }
        let n_events = std::iter::from_fn(|| session.next_event()).count();
        assert!(n_events <= 1024);
        let n_commands = std::iter::from_fn(|| session.poll_transmit()).count();
        assert!(n_commands <= 64);
    }
}
