//! The two streams of a hand of devices, as metrics.

use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::metrics::family::Family;
use prometheus_client::registry::{Registry, Unit};
use tsukamu_proto::v1;

use super::RealGauge;

/// Which stream a number is about.
#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct StreamLabel {
    /// The hand's name.
    source: String,
    /// `wrist` or `fingers`.
    stream: &'static str,
}

type Gauges = Family<StreamLabel, RealGauge>;

/// A value of a stream; `None` is left out.
type Ask = fn(&v1::HandStream) -> Option<f64>;

/// One family per number that a stream has.
#[derive(Debug)]
pub(super) struct StreamFamilies(Vec<(Gauges, Ask)>);

impl StreamFamilies {
    pub(super) fn new(registry: &mut Registry) -> Self {
        let r = registry.sub_registry_with_prefix("stream");
        let all: [(&str, &str, Unit, Ask); 5] = [
            (
                "lag",
                "How far what the hand shows is behind what the device reported; negative is ahead",
                Unit::Seconds,
                |stream| Some(stream.lag_s),
            ),
            (
                "lead",
                "How far the stream is predicted",
                Unit::Seconds,
                |stream| Some(stream.lead_s),
            ),
            (
                "age",
                "Age of the newest sample, negative without one",
                Unit::Seconds,
                |stream| Some(stream.age_s),
            ),
            (
                "position_error",
                "Error of the prediction, root mean square over five seconds",
                Unit::Other("meters".to_owned()),
                |stream| stream.position_error_m,
            ),
            (
                "angle_error",
                "Error of the prediction, root mean square over five seconds",
                Unit::Other("radians".to_owned()),
                |stream| stream.angle_error_rad,
            ),
        ];
        let families = all.map(|(name, help, unit, ask)| {
            let gauges = Gauges::default();
            r.register_with_unit(name, help, unit, gauges.clone());
            (gauges, ask)
        });
        Self(families.into())
    }

    /// Takes over the hands as they are now; those that are gone go.
    pub(super) fn fill(&self, sources: &[v1::Device]) {
        let of = |source: &v1::Device, name| match name {
            "wrist" => source.wrist,
            _ => source.fingers,
        };
        for (gauges, ask) in &self.0 {
            gauges.clear();
            let streams = sources
                .iter()
                .flat_map(|source| ["wrist", "fingers"].map(|name| (source, name)));
            for (source, name) in streams {
                let label = || StreamLabel {
                    source: source.name.clone(),
                    stream: name,
                };
                if let Some(value) = of(source, name).as_ref().and_then(ask) {
                    gauges.get_or_create(&label()).set(value);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use prometheus_client::encoding::text;

    use super::*;

    #[test]
    fn each_stream_has_its_numbers_and_no_others() {
        let mut registry = Registry::with_prefix("tsukamu");
        let families = StreamFamilies::new(&mut registry);
        let hand = v1::Device {
            name: "alice:right".to_owned(),
            wrist: Some(v1::HandStream {
                lag_s: -0.02,
                position_error_m: Some(0.003),
                ..v1::HandStream::default()
            }),
            ..v1::Device::default()
        };
        families.fill(&[hand, v1::Device::default()]);
        let mut out = String::new();
        text::encode(&mut out, &registry).unwrap();
        let wrist = "{source=\"alice:right\",stream=\"wrist\"}";
        for line in [
            format!("tsukamu_stream_lag_seconds{wrist} -0.02\n"),
            format!("tsukamu_stream_position_error_meters{wrist} 0.003\n"),
        ] {
            assert!(out.contains(&line), "{out}");
        }
        for absent in ["angle_error_radians{", "stream=\"fingers\""] {
            assert!(!out.contains(absent), "{out}");
        }
    }
}
