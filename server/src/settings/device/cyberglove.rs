//! `kind = "cyberglove"`

use tsukamu_devices::driver::Driver;
use tsukamu_devices::glove::cyberglove::settings::{CyberGloveSettings, Sampling, SensorCount};

use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Time between questions of a polled glove, in nanoseconds: 100 Hz.
const POLL_PERIOD_NS: u64 = 10_000_000;

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    let default = CyberGloveSettings::default();
    let forced_sensors = match keys.whole(sheet, "sensors", Bounds::within(18.0, 22.0, "sensors")) {
        Some(18) => Some(SensorCount::Eighteen),
        Some(22) => Some(SensorCount::TwentyTwo),
        Some(other) => {
            keys.fault(
                sheet,
                "sensors",
                format!("is {other}; gloves have 18 or 22"),
            );
            None
        }
        None => None,
    };
    let sampling = match keys.choice(sheet, "sampling", &["stream", "poll"]) {
        Some("poll") => Sampling::Poll {
            period_ns: POLL_PERIOD_NS,
        },
        _ => Sampling::Stream,
    };
    let rate = keys.number(sheet, "sample_rate_hz", Bounds::within(0.01, 1000.0, "Hz"));
    Some(Driver::CyberGlove(CyberGloveSettings {
        forced_sensors,
        sampling,
        rate_hz: rate.or(default.rate_hz),
        ..default
    }))
}
