//! Emulated devices that move as a given hand does, so that the whole serial path can be tried without hardware.

/// From a hand's joint angles to what a glove's sensors would read, and from its wrist to a tracker's pose.
pub mod wearing;

use std::io;
use std::path::PathBuf;

use nalgebra::{Isometry3, Point3};
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::cyberglove::settings::SensorCount;
use tsukamu_motion::track::Outside;
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::sample::HandSample;

use crate::offline::hands::Motion;
use wearing::{joint_angles_of, sensor_angles, transmitter_from_sensor};

/// Pause between two rounds of a motion, in seconds.
const PAUSE_S: f64 = 1.0;

/// A motion as an emulated device plays it.
#[derive(Clone, Debug)]
pub struct Played {
    /// What is played.
    pub motion: Motion,
    /// Whether it begins again after its end; otherwise the last pose stays.
    pub repeats: bool,
}

/// How an emulated tracker stands to the world and to the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerPlace {
    /// Station that the wrist's receiver is on, from 1.
    pub station: u8,
    /// `world_from_transmitter`, in the y-up space in which the driver reports.
    pub world_from_transmitter: Isometry3<f64>,
    /// `wrist_from_sensor`.
    pub wrist_from_sensor: Isometry3<f64>,
}

impl Default for TrackerPlace {
    /// Station 1, the transmitter in the world's origin, the receiver in the wrist.
    fn default() -> Self {
        let here = Isometry3::identity();
        Self {
            station: 1,
            world_from_transmitter: here,
            wrist_from_sensor: here,
        }
    }
}

/// Where an emulated device is plugged in.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Plug {
    /// A link that points to the terminal.
    pub link: Option<PathBuf>,
    /// Line rate in bit/s; `None` is 115200, 0 is no pacing.
    pub baud: Option<u32>,
}

impl Played {
    /// The sample so many nanoseconds after the start.
    pub fn sample_at(&self, since_start_ns: u64) -> Option<HandSample> {
        let time_s = since_start_ns as f64 * 1.0e-9;
        let round_s = self.motion.end_s() + PAUSE_S;
        let time_s = if self.repeats {
            time_s % round_s
        } else {
            time_s
        };
        self.motion.sample_at(time_s, Outside::Hold)
    }
}

/// A glove on a pseudo-terminal, worn by that hand.
///
/// # Errors
/// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub fn spawn_glove(
    played: Played,
    sensors: SensorCount,
    calibration: GloveCalibration,
    plug: Plug,
) -> io::Result<PtyEmulator<CyberGloveEmulator>> {
    let side = match played.motion.side() {
        Side::Left => Handedness::Left,
        Side::Right => Handedness::Right,
    };
    let glove = CyberGloveEmulator::new(sensors, side);
    PtyEmulator::spawn(
        glove,
        plug.settings(),
        move |now_ns, glove: &mut CyberGloveEmulator| {
            let sample = played.sample_at(now_ns);
            if let Some(angles) =
                sample.and_then(|sample| joint_angles_of(&sample, played.motion.side()))
            {
                let counts = calibration.counts(&sensor_angles(&angles), 1, 254);
                glove.set_slots(&counts.map(|count| count as u8));
            }
        },
    )
}

/// A tracker on a pseudo-terminal, its receiver on the wrist of that hand.
///
/// # Errors
/// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub fn spawn_tracker(
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

impl Plug {
    fn settings(self) -> PtySettings {
        let default = PtySettings::default();
        PtySettings {
            link: self.link,
            baud: self.baud.unwrap_or(default.baud),
        }
    }
}
