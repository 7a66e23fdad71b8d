//! The table.

use crate::match_up::{Delay, MatchUp};

/// What VRPN needs on the same kind of machine only to forward a tracker, as it was measured before: usual and worst.
const VRPN: &str = "605 µs and 4.0 ms";

pub(crate) fn print(found: &MatchUp, n_bends: usize, rate_hz: f64) {
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    println!(
        "serial byte to frame at a subscriber, loopback, {rate_hz} steps/s, emulated glove on a pseudo-terminal"
    );
    println!(
        "{:34} {:>8} {:>8} {:>8} {:>8}",
        "µs", "p50", "p99", "p99.9", "max"
    );
    row("byte to step", found, |delay| delay.to_step_us);
    row("step to subscriber", found, |delay| {
        delay.first_us - delay.to_step_us
    });
    row("byte to subscriber", found, |delay| delay.first_us);
    row("byte to 90 % of the way", found, |delay| delay.near_us);
    println!("for comparison: VRPN needs {VRPN} only to forward a tracker");
    println!(
        "{} of {n_bends} bends seen, {} frames, {} skipped; load of the machine {}",
        found.delays.len(),
        found.n_frames,
        found.n_skipped,
        load.split_whitespace().next().unwrap_or("not told"),
    );
}

fn row(name: &str, found: &MatchUp, part: impl Fn(&Delay) -> f64) {
    let mut values: Vec<f64> = found.delays.iter().map(part).collect();
    values.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index =
            ((values.len() as f64 * share).ceil() as usize).clamp(1, values.len().max(1)) - 1;
        values.get(index).copied().unwrap_or(f64::NAN)
    };
    println!(
        "{name:34} {:8.0} {:8.0} {:8.0} {:8.0}",
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0)
    );
}
