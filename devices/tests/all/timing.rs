//! When a sample was taken: a device's counter against the daemon's clock, and streams without one. The time is
//! simulated.

use proptest::collection::vec;
use proptest::prelude::{ProptestConfig, any, prop_assert, prop_assert_eq, proptest};
use proptest::test_runner::RngSeed;
use tsukamu_devices::timing::dejitter::DeJitter;
use tsukamu_devices::timing::fit::ClockFit;
use tsukamu_devices::timing::source::{ClockKind, SourceClock, Stream};

use crate::support::{MS, S};

/// The shortest time from sending to arrival in these tests, ns.
const SHORTEST_NS: u64 = 2 * MS;

/// A sample on its way.
#[derive(Clone, Copy)]
struct Sent {
    /// When it left, by the daemon's clock, ns.
    sent_ns: u64,
    /// When it came, ns.
    arrival_ns: u64,
}

impl Sent {
    /// The earliest time at which it could have come: what a stamp should be.
    fn truth_ns(&self) -> u64 {
        self.sent_ns + SHORTEST_NS
    }

    fn error_ns(&self, fitted_ns: u64) -> u64 {
        fitted_ns.abs_diff(self.truth_ns())
    }
}

/// Random numbers, the same at each run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        if bound == 0 { 0 } else { self.0 % bound }
    }
}

/// What the way does to a sample.
#[derive(Clone, Copy)]
enum Way {
    /// It takes up to so much longer, ns.
    Jitter(u64),
    /// It is handed over once in so long, ns, as by an FTDI adapter.
    Batches(u64),
}

/// Samples sent at a period over some time, ns; arrivals do not overtake one another.
fn sent(start_ns: u64, period_ns: u64, duration_ns: u64, way: Way) -> Vec<Sent> {
    let mut dice = Dice(0x1998_2026);
    let mut last_ns = 0;
    (0..duration_ns / period_ns)
        .map(|k| {
            let sent_ns = start_ns + k * period_ns;
            let earliest_ns = sent_ns + SHORTEST_NS;
            let arrival_ns = match way {
                Way::Jitter(most_ns) => earliest_ns + dice.below(most_ns),
                Way::Batches(every_ns) => earliest_ns.div_ceil(every_ns) * every_ns,
            };
            last_ns = arrival_ns.max(last_ns);
            Sent {
                sent_ns,
                arrival_ns: last_ns,
            }
        })
        .collect()
}

/// A counter that runs faster than the daemon's clock by so many millionths.
fn ticks(sent_ns: u64, tick_ns: f64, drift_ppm: f64) -> u64 {
    (sent_ns as f64 * (1.0 + drift_ppm * 1.0e-6) / tick_ns) as u64
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, rng_seed: RngSeed::Fixed(1999), ..ProptestConfig::default() })]

    #[test]
    fn a_counter_is_fitted_within_the_error_that_is_told(
        drift_ppm in -300.0..300.0_f64,
        tick_us in 1_u32..1000,
        rate_hz in 40_u64..500,
        jitter_ms in 0_u64..20,
        is_known in any::<bool>(),
    ) {
        let tick_ns = f64::from(tick_us) * 1.0e3;
        let mut fit = ClockFit::new(is_known.then_some(tick_ns));
        let all = sent(5 * S, S / rate_hz, 40 * S, Way::Jitter(jitter_ms * MS));
        let (mut n, mut n_off) = (0, 0);
        for sample in &all {
            let fitted_ns = fit.push(ticks(sample.sent_ns, tick_ns, drift_ppm), sample.arrival_ns);
            prop_assert!(fitted_ns.is_none_or(|fitted_ns| fitted_ns <= sample.arrival_ns));
            if sample.sent_ns > 15 * S {
                let fitted_ns = fitted_ns.expect("ten seconds are enough");
                n += 1;
                let bound_ns = (fit.error_s().expect("a line") * 1.0e9) as u64 + 1000;
                n_off += u64::from(sample.error_ns(fitted_ns) > bound_ns);
            }
        }
        prop_assert!(n_off * 20 <= n, "{n_off} of {n} are off by more than {:?} s", fit.error_s());
        prop_assert_eq!(fit.n_restarts(), 0);
        if is_known {
            let told = fit.drift_ppm().expect("forty seconds");
            // What a stamp may be off at either end of the time that was looked at.
            let bound_ppm = 2.0 * fit.error_s().expect("a line") / 20.0 * 1.0e6 + 5.0;
            prop_assert!(
                (told - drift_ppm).abs() < bound_ppm,
                "{told} for {drift_ppm} ppm, within {bound_ppm}"
            );
        } else {
            prop_assert!(fit.drift_ppm().is_none());
        }
    }

    #[test]
    fn any_counter_and_any_arrivals_give_stamps_in_order_and_not_after_arrival(
        steps in vec((0_u64..3_000_000_000, any::<u64>(), 0_u8..4, any::<bool>()), 1..300),
        tick_ns in proptest::option::of(any::<f64>()),
    ) {
        let mut clock = SourceClock::new();
        clock.set_tick(tick_ns);
        let (mut arrival_ns, mut ticks) = (0, 0_u64);
        let mut last = [0; 2];
        for (pause_ns, number, what, side) in steps {
            arrival_ns += pause_ns >> (8 * u32::from(what));
            ticks = if what == 3 { number } else { ticks.wrapping_add(number >> 40) };
            let stream = Stream::Station(u16::from(side));
            let given = (what != 2).then_some(ticks);
            let stamped = clock.stamp(stream, arrival_ns, given);
            prop_assert_eq!((stamped.arrival_ns, stamped.ticks), (arrival_ns, given));
            prop_assert!(stamped.fitted_ns <= arrival_ns);
            prop_assert!(stamped.fitted_ns >= last[usize::from(side)]);
            last[usize::from(side)] = stamped.fitted_ns;
            let report = clock.report();
            prop_assert!(report.error_s.is_none_or(|error_s| error_s >= 0.0));
        }
    }

    #[test]
    fn jitter_and_batches_come_out_even(
        rate_hz in 20_u64..300,
        jitter_share in 0.1..0.9_f64,
        batches in any::<bool>(),
        lost_percent in 0_u64..2,
    ) {
        let period_ns = S / rate_hz;
        let way = if batches {
            Way::Batches(16 * MS)
        } else {
            Way::Jitter((period_ns as f64 * jitter_share) as u64)
        };
        let mut dice = Dice(7);
        let all = sent(S, period_ns, 12 * S, way);
        let all: Vec<Sent> = all.into_iter().filter(|_| dice.below(100) >= lost_percent).collect();
        let mut clock = DeJitter::new();
        let stamped: Vec<(Sent, u64)> = all
            .iter()
            .filter_map(|sample| Some((*sample, clock.push(sample.arrival_ns)?)))
            .collect();
        prop_assert!(stamped.iter().all(|(sample, fitted_ns)| *fitted_ns <= sample.arrival_ns));
        let late: Vec<&(Sent, u64)> = stamped.iter().filter(|(sample, _)| sample.sent_ns > 5 * S).collect();
        // By how much the way varies, and what of it is left: mean distance from the mean.
        let raw = spread(late.iter().map(|(sample, _)| sample.arrival_ns as f64 - sample.sent_ns as f64));
        let left = spread(late.iter().map(|(sample, fitted_ns)| *fitted_ns as f64 - sample.sent_ns as f64));
        let per_batch = 16.0e6 / period_ns as f64;
        let is_beat = (per_batch - per_batch.round()).abs() < 0.03;
        if batches && (is_beat || lost_percent > 0) {
            // A slow beat looks like another rate, and a batch without one of its samples like a beat: no worse than
            // before is all that can be had.
            prop_assert!(left <= raw + period_ns as f64, "{left} ns are left of {raw} ns");
            return Ok(());
        }
        prop_assert!(late.len() as u64 > 6 * rate_hz, "a period is known: {} of {}", late.len(), all.len());
        let grain = if lost_percent > 0 { 0.15 * period_ns as f64 } else { 0.0 };
        prop_assert!(left <= raw / 3.0 + grain + 2.0e5, "{left} ns are left of {raw} ns");
    }
}

/// Mean distance from the mean.
fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / n;
    values.map(|value| (value - mean).abs()).sum::<f64>() / n
}

#[test]
fn batches_of_an_adapter_do_not_move_a_counter() {
    let mut fit = ClockFit::new(Some(1.0e3));
    for sample in sent(S, 9_973_000, 60 * S, Way::Batches(16 * MS)) {
        let fitted_ns = fit.push(ticks(sample.sent_ns, 1.0e3, 40.0), sample.arrival_ns);
        let error_ns = sample.error_ns(fitted_ns.unwrap());
        if sample.sent_ns > 10 * S {
            assert!(error_ns < MS, "{error_ns} ns at {}", sample.sent_ns);
        }
    }
    let drift_ppm = fit.drift_ppm().unwrap();
    assert!((drift_ppm - 40.0).abs() < 10.0, "{drift_ppm}");
}

#[test]
fn silence_and_lost_records_leave_a_counter_where_it_is() {
    let mut fit = ClockFit::new(Some(1.0e6));
    let mut dice = Dice(3);
    for sample in sent(0, 10 * MS, 60 * S, Way::Jitter(4 * MS)) {
        let is_silent = (20 * S..23 * S).contains(&sample.sent_ns);
        if is_silent || dice.below(100) < 5 {
            continue;
        }
        let fitted_ns = fit
            .push(ticks(sample.sent_ns, 1.0e6, -80.0), sample.arrival_ns)
            .unwrap();
        if sample.sent_ns > 10 * S {
            assert!(sample.error_ns(fitted_ns) < 2 * MS, "at {}", sample.sent_ns);
        }
    }
    assert_eq!(fit.n_restarts(), 0);
}

#[test]
fn records_that_waited_keep_the_time_at_which_they_were_taken() {
    let mut fit = ClockFit::new(Some(1.0e6));
    for sample in sent(0, 10 * MS, 20 * S, Way::Jitter(MS)) {
        // The daemon was stopped for a second; what came meanwhile is read at its end.
        let was_stopped = (10 * S..11 * S).contains(&sample.arrival_ns);
        let arrival_ns = if was_stopped {
            11 * S
        } else {
            sample.arrival_ns
        };
        let fitted_ns = fit
            .push(ticks(sample.sent_ns, 1.0e6, 0.0), arrival_ns)
            .unwrap();
        if sample.sent_ns > 2 * S {
            assert!(sample.error_ns(fitted_ns) < 3 * MS, "at {}", sample.sent_ns);
        }
    }
    assert_eq!(fit.n_restarts(), 0);
}

#[test]
fn a_counter_that_begins_anew_is_followed() {
    // From 0 again; ahead; behind, at a time at which it is greater than before.
    let jumps: [fn(u64) -> u64; 3] = [|_| 0, |was| was + 100_000, |was| was - 3_000];
    for (index, jump) in jumps.into_iter().enumerate() {
        let mut fit = ClockFit::new(Some(1.0e6));
        let mut offset = 500_000_i64;
        let mut is_done = false;
        for sample in sent(S, 10 * MS, 30 * S, Way::Jitter(3 * MS)) {
            let own = (sample.sent_ns / MS) as i64;
            if sample.sent_ns > 15 * S && !is_done {
                offset = jump((own + offset) as u64) as i64 - own;
                is_done = true;
            }
            let fitted_ns = fit.push((own + offset) as u64, sample.arrival_ns).unwrap();
            assert!(fitted_ns <= sample.arrival_ns);
            let is_settled = !(15 * S..18 * S).contains(&sample.sent_ns) && sample.sent_ns > 3 * S;
            if is_settled {
                let error_ns = sample.error_ns(fitted_ns);
                assert!(
                    error_ns < 4 * MS,
                    "{index}: {error_ns} ns at {}",
                    sample.sent_ns
                );
            }
        }
        assert_eq!(fit.n_restarts(), 1, "{index}");
    }
}

#[test]
fn a_nominal_tick_that_is_wrong_is_given_up() {
    let mut fit = ClockFit::new(Some(1.0e6));
    for sample in sent(0, 10 * MS, 40 * S, Way::Jitter(3 * MS)) {
        let fitted_ns = fit
            .push(ticks(sample.sent_ns, 1.1e6, 0.0), sample.arrival_ns)
            .unwrap_or(sample.arrival_ns);
        if sample.sent_ns > 20 * S {
            assert!(sample.error_ns(fitted_ns) < 3 * MS, "at {}", sample.sent_ns);
        }
    }
    assert_eq!(fit.drift_ppm(), None, "its unit is not known after all");
    assert!((fit.tick_s().unwrap() - 1.1e-3).abs() < 1.0e-7);
}

#[test]
fn a_rhythm_that_changes_is_learned_anew() {
    let mut clock = DeJitter::new();
    let mut start_ns = S;
    for rate_hz in [100, 50, 95, 200] {
        let period_ns = S / rate_hz;
        for sample in sent(start_ns, period_ns, 8 * S, Way::Jitter(2 * MS)) {
            let fitted_ns = clock.push(sample.arrival_ns).unwrap_or(sample.arrival_ns);
            assert!(sample.arrival_ns - fitted_ns <= 250 * MS);
            if sample.sent_ns > start_ns + 6 * S {
                let error_ns = sample.error_ns(fitted_ns);
                assert!(error_ns < period_ns / 2, "{rate_hz} Hz: {error_ns} ns");
            }
        }
        let period_s = clock.period_s().expect("a steady rate");
        assert!(
            (period_s * rate_hz as f64 - 1.0).abs() < 0.02,
            "{rate_hz} Hz: {period_s} s"
        );
        start_ns += 8 * S;
    }
}

#[test]
fn after_a_silence_a_rhythm_locks_again() {
    let mut clock = DeJitter::new();
    for start_ns in [S, 10 * S + 3_700_000] {
        for sample in sent(start_ns, 10 * MS, 5 * S, Way::Jitter(6 * MS)) {
            let fitted_ns = clock.push(sample.arrival_ns).unwrap_or(sample.arrival_ns);
            let settles_ns = if start_ns == S { 2 * S } else { S / 2 };
            if sample.sent_ns > start_ns + settles_ns {
                assert!(sample.error_ns(fitted_ns) < 2 * MS, "at {}", sample.sent_ns);
            }
        }
    }
    assert_eq!(clock.n_restarts(), 0, "the period is the same");
}

#[test]
fn a_burst_after_a_stop_is_spread_out_again() {
    let mut clock = DeJitter::new();
    for sample in sent(S, 10 * MS, 20 * S, Way::Jitter(2 * MS)) {
        let was_stopped = (10 * S..10 * S + 200 * MS).contains(&sample.arrival_ns);
        let arrival_ns = if was_stopped {
            10 * S + 200 * MS
        } else {
            sample.arrival_ns
        };
        let fitted_ns = clock.push(arrival_ns).unwrap_or(arrival_ns);
        if sample.sent_ns > 4 * S {
            assert!(sample.error_ns(fitted_ns) < 2 * MS, "at {}", sample.sent_ns);
        }
    }
}

#[test]
fn a_source_without_a_rhythm_keeps_its_arrivals() {
    let mut dice = Dice(11);
    let mut clock = SourceClock::new();
    let (mut arrival_ns, mut n, mut n_kept) = (S, 0, 0);
    while arrival_ns < 120 * S {
        // Now and then something moves, and is told at once.
        arrival_ns += match dice.below(3) {
            0 => dice.below(700 * MS),
            _ => 5 * MS + dice.below(60 * MS),
        };
        let stamped = clock.stamp(Stream::Station(1), arrival_ns, None);
        assert!(arrival_ns - stamped.fitted_ns <= 250 * MS);
        if arrival_ns > 20 * S {
            n += 1;
            n_kept += u32::from(stamped.fitted_ns == arrival_ns);
        }
    }
    assert!(n_kept * 10 > n * 7, "{n_kept} of {n}");
}

#[test]
fn each_station_has_a_rhythm_of_its_own_and_the_way_is_told() {
    let mut clock = SourceClock::new();
    assert_eq!(clock.report().kind, ClockKind::Arrival);
    for sample in sent(S, 20 * MS, 8 * S, Way::Jitter(5 * MS)) {
        for station in 1..=2_u16 {
            // The second comes right behind the first.
            let arrival_ns = sample.arrival_ns + u64::from(station - 1) * 3 * MS;
            let stamped = clock.stamp(Stream::Station(station), arrival_ns, None);
            if sample.sent_ns > 4 * S {
                let expected_ns = sample.truth_ns() + u64::from(station - 1) * 3 * MS;
                let error_ns = stamped.fitted_ns.abs_diff(expected_ns);
                assert!(error_ns < MS, "{station}: {error_ns} ns");
            }
        }
    }
    let report = clock.report();
    assert_eq!(report.kind, ClockKind::Even);
    assert!((report.tick_s.unwrap() - 0.02).abs() < 1.0e-4);
    assert!(report.error_s.unwrap() < 5.0e-3);
    clock.restart();
    assert_eq!(clock.report().kind, ClockKind::Arrival);
}
