//! An emulated board that prints lines of numbers, on a hand.

use std::io;

use tsukamu_devices::emulate::delimited::DelimitedEmulator;
use tsukamu_devices::emulate::pty::PtyEmulator;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::glove::delimited::column::Column;
use tsukamu_devices::glove::delimited::format::default_of;
use tsukamu_devices::glove::delimited::settings::DelimitedSettings;
use tsukamu_devices::glove::sensor::GloveSensor;

use super::{Played, Plug};

/// What is emulated unless settings say otherwise: a time in ms and five flexures of 10 bits, as a first sketch has them.
pub fn five_numbers() -> DelimitedSettings {
    let columns = ["time", "thumb", "index", "middle", "ring", "little"];
    let columns = columns.into_iter().map(Column::parse);
    DelimitedSettings::new(columns.filter_map(Result::ok).collect())
}

/// A glove on a pseudo-terminal, worn by that hand, whose lines are as the settings say.
///
/// # Errors
/// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub fn spawn_delimited(
    played: Played,
    settings: DelimitedSettings,
    calibration: GloveCalibration,
    plug: Plug,
) -> io::Result<PtyEmulator<DelimitedEmulator>> {
    let scale = settings.scale;
    let calibration = calibration.filled(|sensor| default_of(scale, sensor));
    let glove = DelimitedEmulator::new(settings);
    PtyEmulator::spawn(
        glove,
        plug.settings(),
        move |now_ns, glove: &mut DelimitedEmulator| {
            if let Some(angles) = played.sensor_angles_at(now_ns) {
                glove.set_slots(&raw_values(&calibration, &angles));
            }
        },
    )
}

/// What the sensors send at these angles (radians by wire slot), within the ranges of the calibration. One sensor does not
/// change another's value on such a glove.
fn raw_values(
    calibration: &GloveCalibration,
    angles: &[Option<f64>; GloveSensor::N_SLOTS],
) -> [f64; GloveSensor::N_SLOTS] {
    let mut raw = [0.0; GloveSensor::N_SLOTS];
    for sensor in GloveSensor::ALL {
        let slot = sensor.slot();
        let range = calibration.sensor(sensor);
        let angle_deg = angles[slot].unwrap_or(0.0).to_degrees();
        // `max` then `min` instead of `clamp`, which panics on a range that nobody validated.
        let angle_deg = angle_deg.max(range.min_deg).min(range.max_deg);
        raw[slot] = range.raw_at_zero + angle_deg / range.gain_deg_per_count;
    }
    raw
}
