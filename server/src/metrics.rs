//! What the daemon counts about itself, for `/metrics`, the status page and `GetStatus`.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use prometheus_client::encoding::{EncodeLabelSet, text};
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::{Registry, Unit};
use tsukamu_proto::v1;

use devices::DeviceFamilies;
use streams::StreamFamilies;

mod devices;
mod streams;

/// Upper bounds of the step time's buckets, seconds.
const STEP_TIME_BUCKETS_S: [f64; 13] = [
    2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 1e-1,
];

/// A gauge of a real number.
type RealGauge = Gauge<f64, AtomicU64>;

/// Which source a number is about.
#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct SourceLabel {
    source: String,
    kind: String,
}

/// Counters of the whole daemon. Every part adds its own; nothing here allocates while the world steps.
#[derive(Debug)]
pub struct Metrics {
    registry: Registry,
    /// Steps done.
    pub steps: Counter,
    /// Steps skipped because they were late.
    pub overruns: Counter,
    /// Time that one step took, seconds.
    step_time: Histogram,
    /// The same for quantiles.
    pub step_times: StepTimes,
    /// Events logged.
    pub events: Counter,
    /// Frames encoded.
    pub frames_encoded: Counter,
    /// Bytes of the encoded frames.
    pub frame_bytes_encoded: Counter,
    /// Frames handed to subscribers, all together.
    pub frames_sent: Counter,
    /// Frames that subscribers skipped because they were slow.
    pub frames_skipped: Counter,
    /// Bytes of the frames handed to subscribers.
    pub frame_bytes_sent: Counter,
    /// Subscribers of frames.
    pub frame_subscribers: AtomicUsize,
    /// Subscribers of events.
    pub event_subscribers: AtomicUsize,
    n_frame_subscribers: Gauge,
    n_event_subscribers: Gauge,
    /// The VRPN server.
    pub vrpn: VrpnMetrics,
    sources: SourceFamilies,
    devices: DeviceFamilies,
    streams: StreamFamilies,
    /// Held while the sources' numbers are filled in and written: two at once would add them up.
    writing: Mutex<()>,
}

/// Counters of the VRPN server.
#[derive(Debug)]
pub struct VrpnMetrics {
    /// Clients that are connected.
    pub clients: AtomicUsize,
    n_clients: Gauge,
    /// Clients that were dropped: they took nothing, or what they said was wrong.
    pub clients_dropped: Counter,
    /// Pictures of the world handed to clients, all together.
    pub pictures_sent: Counter,
    /// Pictures that clients missed because they were slow.
    pub pictures_skipped: Counter,
    /// Bytes handed to clients.
    pub bytes_sent: Counter,
}

impl VrpnMetrics {
    fn new(r: &mut Registry) -> Self {
        Self {
            clients: AtomicUsize::new(0),
            n_clients: gauge(r, "vrpn_clients", "VRPN clients"),
            clients_dropped: counter(
                r,
                "vrpn_clients_dropped",
                "VRPN clients that took nothing, could not be reached or said what is wrong",
            ),
            pictures_sent: counter(
                r,
                "vrpn_pictures_sent",
                "Pictures of the world handed to VRPN clients",
            ),
            pictures_skipped: counter(
                r,
                "vrpn_pictures_skipped",
                "Pictures of the world that slow VRPN clients missed",
            ),
            bytes_sent: counter(r, "vrpn_bytes_sent", "Bytes handed to VRPN clients"),
        }
    }
}

#[derive(Debug, Default)]
struct SourceFamilies {
    rate: Family<SourceLabel, RealGauge>,
    longest_gap: Family<SourceLabel, RealGauge>,
    age: Family<SourceLabel, RealGauge>,
    samples: Family<SourceLabel, Counter>,
    dropped: Family<SourceLabel, Counter>,
    superseded: Family<SourceLabel, Counter>,
    resyncs: Family<SourceLabel, Counter>,
    bytes: Family<SourceLabel, Counter>,
    reconnects: Family<SourceLabel, Counter>,
}

impl Metrics {
    /// All counters at zero.
    pub fn new() -> Self {
        let mut registry = Registry::with_prefix("tsukamu");
        let r = &mut registry;
        Self {
            steps: counter(r, "steps", "Steps of the world"),
            overruns: counter(
                r,
                "overruns",
                "Steps that were late by more than one step length, and skipped",
            ),
            step_time: step_time(r),
            step_times: StepTimes::new(),
            events: counter(r, "events", "Events logged"),
            frames_encoded: counter(r, "frames_encoded", "Frames encoded"),
            frame_bytes_encoded: counter(r, "frame_bytes_encoded", "Bytes of encoded frames"),
            frames_sent: counter(r, "frames_sent", "Frames handed to subscribers"),
            frames_skipped: counter(r, "frames_skipped", "Frames that slow subscribers skipped"),
            frame_bytes_sent: counter(
                r,
                "frame_bytes_sent",
                "Bytes of frames handed to subscribers",
            ),
            frame_subscribers: AtomicUsize::new(0),
            event_subscribers: AtomicUsize::new(0),
            n_frame_subscribers: gauge(r, "frame_subscribers", "Subscribers of frames"),
            n_event_subscribers: gauge(r, "event_subscribers", "Subscribers of events"),
            vrpn: VrpnMetrics::new(r),
            sources: SourceFamilies::new(r),
            devices: DeviceFamilies::new(r.sub_registry_with_prefix("source")),
            streams: StreamFamilies::new(r),
            registry,
            writing: Mutex::new(()),
        }
    }

    /// Notes that a step took so long, in nanoseconds.
    pub fn note_step(&self, took_ns: u64) {
        self.steps.inc();
        self.step_time.observe(took_ns as f64 * 1.0e-9);
        self.step_times.note(took_ns);
    }

    /// Everything as OpenMetrics text. `sources` are the devices as they are now.
    ///
    /// # Panics
    /// Never: writing to a string cannot fail.
    pub fn text(&self, sources: &[v1::Device]) -> String {
        let _alone = self.writing.lock().unwrap_or_else(PoisonError::into_inner);
        self.n_frame_subscribers
            .set(self.frame_subscribers.load(Ordering::Relaxed) as i64);
        self.n_event_subscribers
            .set(self.event_subscribers.load(Ordering::Relaxed) as i64);
        self.vrpn
            .n_clients
            .set(self.vrpn.clients.load(Ordering::Relaxed) as i64);
        self.sources.fill(sources);
        self.devices.fill(sources);
        self.streams.fill(sources);
        let mut out = String::new();
        text::encode(&mut out, &self.registry).expect("a string takes every text");
        out
    }
}

impl Default for Metrics {
    fn default() -> Self {
        Self::new()
    }
}

impl SourceFamilies {
    fn new(registry: &mut Registry) -> Self {
        let new = Self::default();
        let r = registry.sub_registry_with_prefix("source");
        r.register(
            "rate_hz",
            "Samples per second over the last second",
            new.rate.clone(),
        );
        r.register_with_unit(
            "longest_gap",
            "Longest gap in the last ten seconds",
            Unit::Seconds,
            new.longest_gap.clone(),
        );
        r.register_with_unit(
            "age",
            "Age of the newest sample, negative without one",
            Unit::Seconds,
            new.age.clone(),
        );
        r.register("samples", "Samples", new.samples.clone());
        r.register(
            "dropped",
            "Records and samples that were refused",
            new.dropped.clone(),
        );
        r.register(
            "superseded",
            "Good samples that newer ones replaced before a step",
            new.superseded.clone(),
        );
        r.register("resyncs", "Times a decoder lost step", new.resyncs.clone());
        r.register_with_unit("received", "Bytes received", Unit::Bytes, new.bytes.clone());
        r.register(
            "reconnects",
            "Times a port was opened again",
            new.reconnects.clone(),
        );
        new
    }

    /// Takes over the sources as they are now; those that are gone go.
    fn fill(&self, sources: &[v1::Device]) {
        let families = [&self.rate, &self.longest_gap, &self.age];
        families.iter().for_each(|family| family.clear());
        let counted = [
            &self.samples,
            &self.dropped,
            &self.superseded,
            &self.resyncs,
            &self.bytes,
            &self.reconnects,
        ];
        counted.iter().for_each(|family| family.clear());
        for source in sources {
            let label = SourceLabel {
                source: source.name.clone(),
                kind: source.kind.clone(),
            };
            for (family, value) in
                families
                    .iter()
                    .zip([source.rate_hz, source.longest_gap_s, source.age_s])
            {
                family.get_or_create(&label).set(value);
            }
            let numbers = [
                source.samples,
                source.dropped,
                source.superseded,
                source.resyncs,
                source.bytes,
                source.reconnects,
            ];
            for (family, value) in counted.iter().zip(numbers) {
                family.get_or_create(&label).inc_by(value);
            }
        }
    }
}

fn counter(registry: &mut Registry, name: &str, help: &str) -> Counter {
    let counter = Counter::default();
    registry.register(name, help, counter.clone());
    counter
}

fn gauge(registry: &mut Registry, name: &str, help: &str) -> Gauge {
    let gauge = Gauge::default();
    registry.register(name, help, gauge.clone());
    gauge
}

fn step_time(registry: &mut Registry) -> Histogram {
    let histogram = Histogram::new(STEP_TIME_BUCKETS_S);
    registry.register_with_unit(
        "step_time",
        "Time one step took",
        Unit::Seconds,
        histogram.clone(),
    );
    histogram
}

/// Sub-buckets per doubling, as a power of two: quantiles are within 12.5 %.
const SUB_BITS: u32 = 3;
/// Buckets up to 2^40 ns, 18 minutes.
const N_BUCKETS: usize = 40 << SUB_BITS;

/// Step times since the start, in buckets whose width grows with the time.
#[derive(Debug)]
pub struct StepTimes {
    buckets: Vec<AtomicU64>,
}

impl StepTimes {
    fn new() -> Self {
        Self {
            buckets: (0..N_BUCKETS).map(|_| AtomicU64::new(0)).collect(),
        }
    }

    fn note(&self, took_ns: u64) {
        self.buckets[bucket(took_ns)].fetch_add(1, Ordering::Relaxed);
    }

    /// The time in seconds that a share of all steps did not exceed; 0 before the first step.
    pub fn quantile_s(&self, share: f64) -> f64 {
        let counts: Vec<u64> = self
            .buckets
            .iter()
            .map(|count| count.load(Ordering::Relaxed))
            .collect();
        let wanted = (counts.iter().sum::<u64>() as f64 * share).ceil() as u64;
        let mut seen = 0;
        for (index, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            seen += count;
            if seen >= wanted {
                return upper_bound_ns(index) as f64 * 1.0e-9;
            }
        }
        0.0
    }
}

fn bucket(ns: u64) -> usize {
    let ns = ns.max(1 << SUB_BITS);
    let exponent = ns.ilog2();
    let sub = (ns >> (exponent - SUB_BITS)) as usize & ((1 << SUB_BITS) - 1);
    (((exponent as usize) << SUB_BITS) + sub).min(N_BUCKETS - 1)
}

/// The first time that is above a bucket.
fn upper_bound_ns(index: usize) -> u64 {
    let (exponent, sub) = (index >> SUB_BITS, (index & ((1 << SUB_BITS) - 1)) as u64);
    ((1 << SUB_BITS) + sub + 1) << exponent >> SUB_BITS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_within_an_eighth() {
        let times = StepTimes::new();
        assert_eq!(times.quantile_s(0.5), 0.0);
        (1..=1000_u64).for_each(|us| times.note(us * 1000));
        for (share, expected) in [(0.5, 500e-6), (0.99, 990e-6), (1.0, 1000e-6)] {
            let found = times.quantile_s(share);
            assert!(
                (1.0..=1.125).contains(&(found / expected)),
                "{share}: {found}"
            );
        }
        times.note(u64::MAX);
        times.note(0);
    }

    #[test]
    fn who_asks_at_once_is_told_the_same() {
        let metrics = Metrics::new();
        let glove = v1::Device {
            name: "glove".to_owned(),
            samples: 7,
            ..v1::Device::default()
        };
        let line = "tsukamu_source_samples_total{source=\"glove\",kind=\"\"} 7\n";
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    let mut texts = (0..300).map(|_| metrics.text(std::slice::from_ref(&glove)));
                    assert!(texts.all(|text| text.contains(line)));
                });
            }
        });
    }

    #[test]
    fn the_text_is_open_metrics() {
        let metrics = Metrics::new();
        metrics.note_step(20_000);
        let glove = v1::Device {
            name: "glove:right".to_owned(),
            samples: 7,
            ..v1::Device::default()
        };
        let text = metrics.text(&[glove]);
        for line in [
            "tsukamu_steps_total 1",
            "tsukamu_step_time_seconds_bucket{le=\"0.00002\"} 1",
            "tsukamu_source_samples_total{source=\"glove:right\",kind=\"\"} 7",
            "# EOF",
        ] {
            assert!(text.contains(line), "{line} is not in\n{text}");
        }
        assert!(!metrics.text(&[]).contains("glove:right"));
    }
}
