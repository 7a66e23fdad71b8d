//! An emulated 5DT glove on a hand.

use std::io;

use tsukamu_devices::emulate::fivedt::FiveDtEmulator;
use tsukamu_devices::emulate::pty::PtyEmulator;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::glove::fivedt::format::default_of;
use tsukamu_devices::glove::fivedt::settings::Model;

use super::{Played, Plug};

/// A glove on a pseudo-terminal, worn by that hand.
///
/// # Errors
/// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub fn spawn_fivedt(
    played: Played,
    model: Model,
    calibration: GloveCalibration,
    plug: Plug,
) -> io::Result<PtyEmulator<FiveDtEmulator>> {
    let glove = FiveDtEmulator::new(model, played.handedness());
    let calibration = calibration.filled(|sensor| default_of(model, sensor));
    PtyEmulator::spawn(
        glove,
        plug.settings(),
        move |now_ns, glove: &mut FiveDtEmulator| {
            if let Some(angles) = played.sensor_angles_at(now_ns) {
                let counts = calibration.counts(&angles, 0, model.raw_max() as u16);
                glove.set_slots(&counts);
            }
        },
    )
}
