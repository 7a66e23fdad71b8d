//! An emulated LucidGlove on a hand.

use std::io;

use tsukamu_devices::emulate::lucidglove::{LucidGloveBuild, LucidGloveEmulator};
use tsukamu_devices::emulate::pty::PtyEmulator;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::glove::lucidglove::defaults::default_of;

use super::{Played, Plug};

/// A glove on a pseudo-terminal, worn by that hand: an ESP32 with servos, a sensor at each joint and splay, so that it
/// can grasp whatever the motion grasps.
///
/// # Errors
/// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub fn spawn_lucidglove(
    played: Played,
    calibration: GloveCalibration,
    plug: Plug,
) -> io::Result<PtyEmulator<LucidGloveEmulator>> {
    let build = LucidGloveBuild {
        joints: true,
        splay: true,
        info: Some(played.handedness()),
        ..LucidGloveBuild::default()
    };
    let calibration = calibration.filled(|sensor| default_of(sensor, build.max));
    PtyEmulator::spawn(
        LucidGloveEmulator::new(build),
        plug.settings(),
        move |now_ns, glove: &mut LucidGloveEmulator| {
            if let Some(angles) = played.sensor_angles_at(now_ns) {
                glove.set_slots(&calibration.counts(&angles, 0, build.max));
            }
        },
    )
}
