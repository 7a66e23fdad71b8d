//! An emulated Fastrak on a wrist.

use std::io;

use nalgebra::Point3;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::emulate::pty::PtyEmulator;

use super::wearing::transmitter_from_sensor;
use super::{Played, Plug, TrackerPlace};

/// A tracker on a pseudo-terminal, its receiver on the wrist of that hand.
///
/// # Errors
/// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub fn spawn_fastrak(
    played: Played,
    place: TrackerPlace,
    plug: Plug,
) -> io::Result<PtyEmulator<FastrakEmulator>> {
    let tracker = FastrakEmulator::new();
    PtyEmulator::spawn(
        tracker,
        plug.settings(),
        move |now_ns, tracker: &mut FastrakEmulator| {
            if let Some(sample) = played.sample_at(now_ns) {
                let pose = transmitter_from_sensor(&sample.wrist, &place);
                tracker.set_pose(
                    place.station,
                    Point3::from(pose.translation.vector),
                    pose.rotation,
                );
            }
        },
    )
}
