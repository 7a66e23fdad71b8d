use std::io;
use std::path::PathBuf;

use thiserror::Error;
use tsukamu_devices::calibration::fit::FitFault;
use tsukamu_devices::calibration::place::RoomFault;
use tsukamu_devices::glove::calibrate::CalibrationProblem;

/// Why something about calibration cannot be done.
#[derive(Debug, Error)]
pub enum CalibrationFault {
    /// No device of that name.
    #[error("there is no device {name:?}; there are {known}")]
    NoDevice {
        /// What was asked for.
        name: String,
        /// Those there are, with commas; or `none`.
        known: String,
    },
    /// It has no fingers.
    #[error("{0} is no glove; of a tracker the room and the mount can be calibrated")]
    NoGlove(String),
    /// It has no pose.
    #[error("{0} is no tracker")]
    NoTracker(String),
    /// One run per device.
    #[error("{0} is being calibrated by somebody else: wait until that is done, or two minutes")]
    Busy(String),
    /// The run is over, or never was.
    #[error(
        "there is no calibration run {0}: it is done, given up, or was left alone for two minutes"
    )]
    NoRun(u64),
    /// No pose of that name.
    #[error("there is no pose {0:?}; there are flat, fist, thumb_across, spread")]
    NoPose(String),
    /// Not held.
    #[error("{0}")]
    NotHeld(String),
    /// The poses do not make a calibration.
    #[error(transparent)]
    Fit(#[from] FitFault),
    /// The points do not make a room.
    #[error(transparent)]
    Room(#[from] RoomFault),
    /// Its numbers make no sense.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Problems(Vec<CalibrationProblem>),
    /// No hand wears the tracker.
    #[error("no hand of the settings has station {station} of {device} on its wrist")]
    NoHand {
        /// The tracker.
        device: String,
        /// Its station.
        station: u16,
    },
    /// Nowhere to save.
    #[error("{device} has no {key} file in the settings: name one with `{key} = \"FILE\"`")]
    NoFile {
        /// The device.
        device: String,
        /// `calibration` or `room`.
        key: &'static str,
    },
    /// The file is of someone else.
    #[error(
        "{} is the calibration of {wearer:?}: it is replaced only when that is asked for", .file.display()
    )]
    OtherWearer {
        /// The file.
        file: PathBuf,
        /// Whose it is.
        wearer: String,
    },
    /// Writing failed.
    #[error("{}: {source}", .file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// It cannot be said in TOML.
    #[error("the calibration cannot be written: {0}")]
    Text(#[from] toml::ser::Error),
}
