//! Devices are looked after: their rate, their gaps, their range and their clock, each with what is wrong in plain words.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};
use tracing::{info, warn};
use tsukamu_devices::calibration::drift::DriftWatch;
use tsukamu_devices::reading::GloveReading;
use tsukamu_devices::timing::source::ClockReport;
use tsukamu_proto::v1;

use crate::clock::Clock;
use crate::convert::device::{device_clock, device_warning};

use super::meter::Gaps;
use super::reach::Reach;
use super::sources::{Source, Sources};
use super::warning::{Change, Observed, Warnings};

/// How often every device is looked at.
const PERIOD: Duration = Duration::from_millis(500);
/// The same warning about the same device is written once in this time, nanoseconds.
const WRITTEN_NS: u64 = 60_000_000_000;
/// Seconds over which a rate is judged.
const RATE_SECONDS: u64 = 2;

/// What is known of a device beside its samples.
#[derive(Debug, Default)]
pub(super) struct Supervised {
    /// Samples per second that it should have.
    expected_hz: Option<f64>,
    reach: Reach,
    drift: DriftWatch,
    warnings: Warnings,
    clock: Option<ClockReport>,
    n_losses: u64,
}

impl Supervised {
    /// Writes what is known into the message.
    pub(super) fn fill(&self, device: &mut v1::Device, now_ns: u64) {
        device.expected_rate_hz = self.expected_hz.unwrap_or(0.0);
        device.resyncs_per_s = self.warnings.resync_rate_hz();
        device.out_of_range_share = self.reach.worst(now_ns).map_or(0.0, |(_, share)| share);
        device.warnings = self
            .warnings
            .standing()
            .map(|(code, text)| device_warning(code, text))
            .collect();
        device.clock = self.clock.as_ref().map(device_clock);
        device.losses = self.n_losses;
    }
}

impl Source {
    /// From now on it is looked after as a device that should have so many samples per second.
    pub fn supervise(&self, expected_hz: Option<f64>) {
        self.lane().supervised = Some(Box::new(Supervised {
            expected_hz,
            ..Supervised::default()
        }));
    }

    /// The device has said how many samples it sends in a second; what the settings say stands above it.
    pub fn expect_rate(&self, rate_hz: f64) {
        if let Some(supervised) = &mut self.lane().supervised {
            supervised.expected_hz.get_or_insert(rate_hz);
        }
    }

    /// Counts a sample of a glove.
    pub fn note_glove(&self, reading: &GloveReading) {
        let mut lane = self.lane();
        lane.note(reading.stamp_ns);
        if let Some(supervised) = &mut lane.supervised {
            supervised.reach.note(reading);
            supervised.drift.add(reading);
        }
    }

    /// Notes how its samples get their times.
    pub fn note_clock(&self, report: ClockReport) {
        if let Some(supervised) = &mut self.lane().supervised {
            supervised.clock = Some(report);
        }
    }

    /// Counts a loss.
    pub fn note_loss(&self) {
        if let Some(supervised) = &mut self.lane().supervised {
            supervised.n_losses += 1;
        }
    }

    /// Looks whether anything is wrong; what begins and ends comes back.
    pub fn look(&self, now_ns: u64) -> Vec<Change> {
        let changes = {
            let mut lane = self.lane();
            let lane = &mut *lane;
            let Some(supervised) = &mut lane.supervised else {
                return Vec::new();
            };
            let observed = Observed {
                now_ns,
                state: lane.health.state,
                error: &lane.health.error,
                age_s: lane.meter.age_s(now_ns),
                rate_hz: lane.meter.mean_rate_hz(now_ns, RATE_SECONDS),
                expected_hz: supervised.expected_hz,
                n_resyncs: lane.health.n_resyncs,
                worst: supervised.reach.worst(now_ns),
                zero_shift: supervised.drift.zero_shift(now_ns),
            };
            supervised.warnings.look(&observed)
        };
        if !changes.is_empty() {
            self.tell_change();
        }
        changes
    }
}

/// The classes of gaps as a message has them: bounds, counts, and all gaps together in seconds.
pub(super) fn fill_gaps(device: &mut v1::Device, gaps: &Gaps) {
    device.gap_bounds_s = Gaps::bounds_s().to_vec();
    device.gap_counts = gaps.counts.to_vec();
    device.gap_sum_s = gaps.sum_s;
}

/// Which warnings the log has been told of: one that comes and goes without end is written once in a while.
#[derive(Debug, Default)]
struct Written(BTreeMap<(String, &'static str), Line>);

/// The last line about one warning.
#[derive(Clone, Copy, Debug)]
struct Line {
    at_ns: u64,
    /// Whether its end is to be written too.
    is_open: bool,
}

impl Written {
    /// Whether what begins or ends at a monotonic time is to be written.
    fn is_due(&mut self, device: &str, change: &Change, now_ns: u64) -> bool {
        let key = (device.to_owned(), change.code.name());
        let last = self.0.get_mut(&key);
        if change.text.is_none() {
            return last.is_some_and(|line| std::mem::take(&mut line.is_open));
        }
        let is_due = last.is_none_or(|line| now_ns.saturating_sub(line.at_ns) >= WRITTEN_NS);
        if is_due {
            let (at_ns, is_open) = (now_ns, true);
            self.0.insert(key, Line { at_ns, is_open });
        }
        is_due
    }
}

/// Looks after all devices, without end. What begins and what ends is one line of the log each.
pub async fn supervise(sources: Sources, clock: Clock) {
    let mut period = interval(PERIOD);
    period.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut written = Written::default();
    loop {
        period.tick().await;
        let now_ns = clock.monotonic_ns();
        for source in sources.all() {
            for change in source.look(now_ns) {
                if written.is_due(&source.name, &change, now_ns) {
                    log(&source, &change);
                }
            }
        }
    }
}

fn log(source: &Arc<Source>, change: &Change) {
    let (device, code) = (&source.name, change.code.name());
    match &change.text {
        Some(text) => warn!(device, code, text, "device warning"),
        None => info!(device, code, "device warning is over"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::warning::Code;
    use super::*;

    const S: u64 = 1_000_000_000;

    #[test]
    fn a_warning_that_comes_and_goes_is_written_once_a_minute() {
        let mut written = Written::default();
        let change = |is_begin: bool| Change {
            code: Code::Silent,
            text: is_begin.then(String::new),
        };
        let mut n_lines = [0; 2];
        // It speaks every other second, for ten minutes.
        for second in 0..600 {
            let is_begin = second % 2 == 0;
            if written.is_due("wrist", &change(is_begin), second * S) {
                n_lines[usize::from(is_begin)] += 1;
            }
        }
        assert_eq!(n_lines, [10, 10]);
        assert!(written.is_due("fingers", &change(true), 600 * S));
    }

    #[test]
    fn a_device_says_what_is_wrong_with_it() {
        let sources = Sources::new();
        let source = sources.add("glove", "cyberglove", String::new(), "running");
        source.supervise(Some(100.0));
        let mut changes = sources.changes();
        let mut told = Vec::new();
        // A quarter of its rate, then nothing at all.
        for quarter in 0..80_u64 {
            let now_ns = S + quarter * S / 4;
            if quarter < 40 {
                (0..6).for_each(|k| source.note(now_ns + k * S / 24));
            }
            if quarter % 2 == 1 {
                told.extend(
                    source
                        .look(now_ns + S / 4)
                        .into_iter()
                        .map(|change| (change.code.name(), change.text.is_some())),
                );
            }
        }
        let expected = [("slow", true), ("slow", false), ("silent", true)];
        assert!(
            expected.iter().all(|wanted| told.contains(wanted)) && told.len() == 3,
            "{told:?}"
        );
        assert!(changes.has_changed().is_ok_and(|changed| changed));
        changes.mark_unchanged();
        source.note_loss();
        let device = source.device(21 * S);
        assert_eq!((device.expected_rate_hz, device.losses), (100.0, 1));
        let codes: Vec<&str> = device.warnings.iter().map(|w| w.code.as_str()).collect();
        assert_eq!(codes, ["silent"]);
        assert!(device.warnings[0].text.contains("no sample"), "{device:?}");
        assert_eq!(device.gap_counts.iter().sum::<u64>(), 239);
        assert_eq!(device.gap_counts.len(), device.gap_bounds_s.len() + 1);
        source.update(|health| health.state = "absent");
        assert!(source.look(22 * S).is_empty());
        assert!(source.device(22 * S).warnings.is_empty());
    }
}
