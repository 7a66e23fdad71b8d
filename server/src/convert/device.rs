//! What is told about a device beside its counters.

use tsukamu_proto::v1;

use crate::input::fusion::{StreamErrors, StreamReport};

/// How one stream of a hand stands at a monotonic time in nanoseconds.
pub fn hand_stream(report: &StreamReport, now_ns: u64) -> v1::HandStream {
    let age = |arrival_ns: u64| now_ns.saturating_sub(arrival_ns) as f64 * 1.0e-9;
    let error = |of: fn(&StreamErrors) -> Option<f64>| report.error.as_ref().and_then(of);
    v1::HandStream {
        delay_s: report.delay_s,
        lag_s: report.lag_s,
        filter_lag_s: report.filter_lag_s,
        lead_s: report.lead_s,
        age_s: report.arrival_ns.map_or(-1.0, age),
        position_error_m: error(|errors| errors.predicted.position_m),
        angle_error_rad: error(|errors| Some(errors.predicted.angle_rad)),
        unpredicted_position_error_m: error(|errors| errors.unpredicted.position_m),
        unpredicted_angle_error_rad: error(|errors| Some(errors.unpredicted.angle_rad)),
    }
}
