//! An emulated Isotrak II or 3SPACE Tracker on a wrist.

use std::io;

use nalgebra::Point3;
use tsukamu_devices::emulate::isotrak::IsotrakEmulator;
use tsukamu_devices::emulate::pty::PtyEmulator;
use tsukamu_devices::tracker::isotrak::protocol::Model;

use super::wearing::transmitter_from_sensor;
use super::{Played, Plug, TrackerPlace};

/// A tracker on a pseudo-terminal, its receiver on the wrist of that hand.
///
/// # Errors
/// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub fn spawn_isotrak(
    played: Played,
    model: Model,
    place: TrackerPlace,
    plug: Plug,
) -> io::Result<PtyEmulator<IsotrakEmulator>> {
    let mut tracker = IsotrakEmulator::new(model);
    tracker.set_connected(1, false);
    tracker.set_connected(place.station, true);
    PtyEmulator::spawn(
        tracker,
        plug.settings(),
        move |now_ns, tracker: &mut IsotrakEmulator| {
            if let Some(sample) = played.sample_at(now_ns) {
                let pose = transmitter_from_sensor(&sample.wrist, &place);
                let position = Point3::from(pose.translation.vector);
                tracker.set_pose(place.station, position, pose.rotation);
            }
        },
    )
}
