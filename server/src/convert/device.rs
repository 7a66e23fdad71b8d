//! What is told about a device beside its counters.

use tsukamu_devices::timing::source::ClockReport;
use tsukamu_proto::v1;

use crate::input::fusion::{StreamErrors, StreamReport};
use crate::input::warning::Code;

/// What is wrong with a device.
pub fn device_warning(code: Code, text: &str) -> v1::DeviceWarning {
    v1::DeviceWarning {
        code: code.name().to_owned(),
        text: text.to_owned(),
    }
}

/// How a device's samples get their times.
pub fn device_clock(report: &ClockReport) -> v1::DeviceClock {
    v1::DeviceClock {
        kind: report.kind.name().to_owned(),
        drift_ppm: report.drift_ppm,
        error_s: report.error_s,
        tick_s: report.tick_s,
        restarts: report.n_restarts,
    }
}

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
