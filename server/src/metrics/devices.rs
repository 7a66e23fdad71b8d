//! What is known of devices beside their samples, as metrics.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeLabelSet, NoLabelSet};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::registry::{Registry, Unit};
use tsukamu_proto::v1;

use super::{RealGauge, SourceLabel};

type Gauges = Family<SourceLabel, RealGauge>;

/// A value of a device; `None` is left out.
type Ask = fn(&v1::Device) -> Option<f64>;

/// Which warning a number is about.
#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct WarningLabel {
    source: String,
    kind: String,
    /// `silent`, `slow`, `noisy`, `out_of_range`, `drifted`.
    code: String,
}

/// One family per number that a device has.
#[derive(Debug)]
pub(super) struct DeviceFamilies {
    gauges: Vec<(Gauges, Ask)>,
    losses: Family<SourceLabel, Counter>,
    warnings: Family<WarningLabel, RealGauge>,
    gaps: Arc<GapHistograms>,
}

/// Of a device alone: other sources have no clock.
fn of_device(device: &v1::Device, value: f64) -> Option<f64> {
    device.clock.as_ref().map(|_| value)
}

impl DeviceFamilies {
    /// `registry` is that of the sources.
    pub(super) fn new(registry: &mut Registry) -> Self {
        let gauges = numbers().map(|(name, help, unit, ask)| {
            let family = Gauges::default();
            match unit {
                Some(unit) => registry.register_with_unit(name, help, unit, family.clone()),
                None => registry.register(name, help, family.clone()),
            }
            (family, ask)
        });
        let new = Self {
            gauges: gauges.into(),
            losses: Family::default(),
            warnings: Family::default(),
            gaps: Arc::default(),
        };
        registry.register(
            "losses",
            "Times that the device was lost after it had run",
            new.losses.clone(),
        );
        registry.register(
            "warning",
            "1 for each thing that is wrong with a device that is there",
            new.warnings.clone(),
        );
        registry.register_collector(Box::new(Arc::clone(&new.gaps)));
        new
    }

    /// Takes over the sources as they are now; those that are gone go.
    pub(super) fn fill(&self, sources: &[v1::Device]) {
        self.gauges.iter().for_each(|(family, _)| family.clear());
        self.losses.clear();
        self.warnings.clear();
        for source in sources {
            let label = SourceLabel {
                source: source.name.clone(),
                kind: source.kind.clone(),
            };
            for (family, ask) in &self.gauges {
                if let Some(value) = ask(source) {
                    family.get_or_create(&label).set(value);
                }
            }
            if source.clock.is_some() {
                self.losses.get_or_create(&label).inc_by(source.losses);
            }
            for warning in &source.warnings {
                let label = WarningLabel {
                    source: source.name.clone(),
                    kind: source.kind.clone(),
                    code: warning.code.clone(),
                };
                self.warnings.get_or_create(&label).set(1.0);
            }
        }
        self.gaps.set(sources);
    }
}

/// Name, meaning, unit and value of each number of a device.
fn numbers() -> [(&'static str, &'static str, Option<Unit>, Ask); 7] {
    [
        ("up", "Whether the device runs, 1 or 0", None, |device| {
            of_device(device, f64::from(u8::from(device.state == "running")))
        }),
        (
            "expected_rate_hz",
            "Samples per second that the device should have",
            None,
            |device| Some(device.expected_rate_hz).filter(|rate_hz| *rate_hz > 0.0),
        ),
        (
            "jitter",
            "Standard deviation of the time between samples over ten seconds",
            Some(Unit::Seconds),
            |device| Some(device.jitter_s),
        ),
        (
            "resync_rate_hz",
            "Times per second that the decoder lost step, over ten seconds",
            None,
            |device| of_device(device, device.resyncs_per_s),
        ),
        (
            "out_of_range",
            "Of the worst sensor: share of ten seconds' samples beyond its calibrated range",
            Some(Unit::Ratios),
            |device| of_device(device, device.out_of_range_share),
        ),
        (
            "clock_drift_ppm",
            "How much faster the device's clock runs than the daemon's, parts per million",
            None,
            |device| device.clock.as_ref()?.drift_ppm,
        ),
        (
            "clock_error",
            "How far a sample's fitted time may be off",
            Some(Unit::Seconds),
            |device| device.clock.as_ref()?.error_s,
        ),
    ]
}

/// The classes of gaps of every source; they are counted elsewhere and only written here.
#[derive(Debug, Default)]
struct GapHistograms(Mutex<Vec<GapHistogram>>);

#[derive(Debug)]
struct GapHistogram {
    label: SourceLabel,
    sum_s: f64,
    buckets: Vec<(f64, u64)>,
}

impl GapHistograms {
    fn set(&self, sources: &[v1::Device]) {
        let all = sources.iter().map(|source| {
            let bounds_s = source.gap_bounds_s.iter().copied();
            // What is longer than the last bound has none: the text calls it +Inf.
            let buckets = bounds_s.chain([f64::INFINITY]);
            GapHistogram {
                label: SourceLabel {
                    source: source.name.clone(),
                    kind: source.kind.clone(),
                },
                sum_s: source.gap_sum_s,
                buckets: buckets.zip(source.gap_counts.iter().copied()).collect(),
            }
        });
        // A panic elsewhere leaves whole values.
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = all.collect();
    }
}

impl Collector for GapHistograms {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> Result<(), fmt::Error> {
        let all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut family = encoder.encode_descriptor(
            "gap",
            "Time between two samples, since the start.",
            Some(&Unit::Seconds),
            MetricType::Histogram,
        )?;
        for gaps in all.iter().filter(|gaps| !gaps.buckets.is_empty()) {
            let n_gaps = gaps.buckets.iter().map(|(_, count)| count).sum();
            family
                .encode_family(&gaps.label)?
                .encode_histogram::<NoLabelSet>(gaps.sum_s, n_gaps, &gaps.buckets, None)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use prometheus_client::encoding::text;

    use super::*;

    #[test]
    fn a_device_has_its_numbers_warnings_and_gaps() {
        let mut registry = Registry::with_prefix("tsukamu");
        let families = DeviceFamilies::new(registry.sub_registry_with_prefix("source"));
        let device = v1::Device {
            name: "glove".to_owned(),
            kind: "cyberglove".to_owned(),
            state: "running".to_owned(),
            jitter_s: 0.0012,
            losses: 3,
            gap_bounds_s: vec![0.012, 0.025],
            gap_counts: vec![10, 2, 1],
            gap_sum_s: 0.5,
            warnings: vec![v1::DeviceWarning {
                code: "slow".to_owned(),
                text: "in words".to_owned(),
            }],
            clock: Some(v1::DeviceClock {
                kind: "counter".to_owned(),
                drift_ppm: Some(42.0),
                ..v1::DeviceClock::default()
            }),
            ..v1::Device::default()
        };
        families.fill(&[device, v1::Device::default()]);
        let mut out = String::new();
        text::encode(&mut out, &registry).unwrap();
        let label = "source=\"glove\",kind=\"cyberglove\"";
        for line in [
            format!("tsukamu_source_up{{{label}}} 1.0\n"),
            format!("tsukamu_source_jitter_seconds{{{label}}} 0.0012\n"),
            format!("tsukamu_source_losses_total{{{label}}} 3\n"),
            format!("tsukamu_source_clock_drift_ppm{{{label}}} 42.0\n"),
            format!("tsukamu_source_warning{{{label},code=\"slow\"}} 1.0\n"),
            format!("tsukamu_source_gap_seconds_bucket{{le=\"0.025\",{label}}} 12\n"),
            format!("tsukamu_source_gap_seconds_bucket{{le=\"+Inf\",{label}}} 13\n"),
            format!("tsukamu_source_gap_seconds_count{{{label}}} 13\n"),
        ] {
            assert!(out.contains(&line), "{line} is not in\n{out}");
        }
        assert!(!out.contains("expected_rate_hz{"), "nobody knows it\n{out}");
    }
}
