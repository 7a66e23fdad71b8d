//! An emulated Liberty, Patriot or Latus on a wrist.

use std::io;

use nalgebra::Point3;
use tsukamu_devices::emulate::liberty::LibertyEmulator;
use tsukamu_devices::emulate::pty::PtyEmulator;
use tsukamu_devices::tracker::liberty::protocol::Model;

use super::wearing::transmitter_from_sensor;
use super::{Played, Plug, TrackerPlace};

/// A tracker on a pseudo-terminal, its sensor on the wrist of that hand.
///
/// # Errors
/// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub fn spawn_liberty(
    played: Played,
    model: Model,
    place: TrackerPlace,
    plug: Plug,
) -> io::Result<PtyEmulator<LibertyEmulator>> {
    let mut tracker = LibertyEmulator::new(model);
    tracker.set_connected(1, false);
    tracker.set_connected(place.station, true);
    PtyEmulator::spawn(
        tracker,
        plug.settings(),
        move |now_ns, tracker: &mut LibertyEmulator| {
            if let Some(sample) = played.sample_at(now_ns) {
                let pose = transmitter_from_sensor(&sample.wrist, &place);
                let position = Point3::from(pose.translation.vector);
                tracker.set_pose(place.station, position, pose.rotation);
            }
        },
    )
}
