//! An emulated OpenCyberGlove on a hand.

use std::io;

use tsukamu_devices::emulate::opencyberglove::OpenCyberGloveEmulator;
use tsukamu_devices::emulate::pty::PtyEmulator;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::glove::opencyberglove::format::default_of;
use tsukamu_devices::glove::opencyberglove::packet::RAW_MAX;

use super::{Played, Plug};

/// A glove on a pseudo-terminal, worn by that hand.
///
/// # Errors
/// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub fn spawn_opencyberglove(
    played: Played,
    calibration: GloveCalibration,
    plug: Plug,
) -> io::Result<PtyEmulator<OpenCyberGloveEmulator>> {
    let calibration = calibration.filled(default_of);
    PtyEmulator::spawn(
        OpenCyberGloveEmulator::new(),
        plug.settings(),
        move |now_ns, glove: &mut OpenCyberGloveEmulator| {
            if let Some(angles) = played.sensor_angles_at(now_ns) {
                glove.set_slots(&calibration.counts(&angles, 0, RAW_MAX as u16));
            }
        },
    )
}
