//! Emulated devices that move as a given hand does, so that the whole serial path can be tried without hardware.

/// Every device that can be emulated, by the name of its kind.
pub mod kinds;
/// From a hand's joint angles to what a glove's sensors would read, and from its wrist to a tracker's pose.
pub mod wearing;

/// A CyberGlove.
pub mod cyberglove;
/// A board that prints lines of numbers.
pub mod delimited;
/// A Fastrak.
pub mod fastrak;
/// A 5DT glove.
pub mod fivedt;
/// A Flock of Birds.
pub mod flock;
/// An Isotrak II or 3SPACE Tracker.
pub mod isotrak;
/// A Liberty, Patriot or Latus.
pub mod liberty;
/// Senders of hands over the network.
pub mod network;
/// A LucidGlove.
pub mod lucidglove;
/// An OpenCyberGlove.
pub mod opencyberglove;

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use nalgebra::Isometry3;
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_motion::track::Outside;
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::sample::HandSample;

use crate::offline::hands::Motion;
use wearing::{joint_angles_of, sensor_angles};

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

/// What every emulated device is given; each takes what it has a use for.
#[derive(Clone, Debug)]
pub struct Worn {
    /// The hand that wears it.
    pub played: Played,
    /// That wearer's calibration of a glove.
    pub calibration: GloveCalibration,
    /// Where a tracker stands.
    pub place: TrackerPlace,
    /// One of the models of the device's kind.
    pub model: &'static str,
    /// Where it is plugged in.
    pub plug: Plug,
    /// `HOST:PORT` that it sends to, if it is of the network; `None` is this machine and its usual port.
    pub to: Option<String>,
}

/// An emulated device on its terminal, whichever kind it is; it ends when this is dropped.
pub trait Plugged: Send {
    /// The terminal of the present, or last, plugging in.
    fn path(&self) -> &Path;

    /// Pulls the cable.
    fn unplug(&mut self);

    /// Plugs the cable in again, on a new terminal.
    ///
    /// # Errors
    /// When the system has no pseudo-terminal to give, or the link cannot be made.
    fn plug(&mut self) -> io::Result<()>;

    /// From now on replaces this share of the bytes that the device says, 0 to 1.
    fn spoil(&mut self, share: f64);

    /// Says and hears nothing for a time, then goes on as if nothing had been.
    fn stall(&mut self, time: Duration);

    /// Loses its power in the middle of what it says, and comes back after that time as it was when it was plugged in first.
    fn cut_power(&mut self, time: Duration);
}

impl<E: Emulator + Clone + Send + 'static> Plugged for PtyEmulator<E> {
    fn path(&self) -> &Path {
        Self::path(self)
    }

    fn unplug(&mut self) {
        Self::unplug(self);
    }

    fn plug(&mut self) -> io::Result<()> {
        Self::plug(self).map(|_path| ())
    }

    fn spoil(&mut self, share: f64) {
        Self::spoil(self, share);
    }

    fn stall(&mut self, time: Duration) {
        Self::stall(self, time);
    }

    fn cut_power(&mut self, time: Duration) {
        Self::cut_power(self, time);
    }
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

    /// What the sensors of a glove on that hand measure so many nanoseconds after the start, radians by wire slot;
    /// `None` where a joint is not tracked.
    pub fn sensor_angles_at(
        &self,
        since_start_ns: u64,
    ) -> Option<[Option<f64>; GloveSensor::N_SLOTS]> {
        let sample = self.sample_at(since_start_ns)?;
        joint_angles_of(&sample, self.motion.side()).map(|angles| sensor_angles(&angles))
    }

    /// Which hand it is, in a glove's words.
    pub fn handedness(&self) -> Handedness {
        match self.motion.side() {
            Side::Left => Handedness::Left,
            Side::Right => Handedness::Right,
        }
    }
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
