//! An emulated CyberGlove on a hand.

use std::io;

use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::pty::PtyEmulator;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::glove::cyberglove::settings::SensorCount;

use super::{Played, Plug};

/// A glove on a pseudo-terminal, worn by that hand.
///
/// # Errors
/// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub fn spawn_cyberglove(
    played: Played,
    sensors: SensorCount,
    calibration: GloveCalibration,
    plug: Plug,
) -> io::Result<PtyEmulator<CyberGloveEmulator>> {
    let glove = CyberGloveEmulator::new(sensors, played.handedness());
    PtyEmulator::spawn(
        glove,
        plug.settings(),
        move |now_ns, glove: &mut CyberGloveEmulator| {
            if let Some(angles) = played.sensor_angles_at(now_ns) {
                let counts = calibration.counts(&angles, 1, 254);
                glove.set_slots(&counts.map(|count| count as u8));
            }
        },
    )
}
