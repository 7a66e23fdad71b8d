//! An emulated Flock of Birds on a wrist.

use std::io;

use nalgebra::Point3;
use tsukamu_devices::emulate::flock::FlockEmulator;
use tsukamu_devices::emulate::pty::PtyEmulator;

use super::wearing::transmitter_from_sensor;
use super::{Played, Plug, TrackerPlace};

/// A bird alone, or a group of so many on a bus, on a pseudo-terminal; the bird of the place's station is on the wrist of
/// that hand, and the others lie where they are.
///
/// # Errors
/// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub fn spawn_flock(
    played: Played,
    group: Option<u8>,
    place: TrackerPlace,
    plug: Plug,
) -> io::Result<PtyEmulator<FlockEmulator>> {
    let tracker = group.map_or_else(FlockEmulator::alone, FlockEmulator::group);
    PtyEmulator::spawn(
        tracker,
        plug.settings(),
        move |now_ns, tracker: &mut FlockEmulator| {
            if let Some(sample) = played.sample_at(now_ns) {
                let pose = transmitter_from_sensor(&sample.wrist, &place);
                let position = Point3::from(pose.translation.vector);
                tracker.set_pose(place.station, position, pose.rotation);
            }
        },
    )
}
