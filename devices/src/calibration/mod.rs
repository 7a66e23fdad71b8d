//! Calibration of a wearer's glove and of a tracker's place, without I/O and without a clock: readings in, values out.

/// The poses of the guided calibration.
pub mod pose;

/// A pose that is held, and what the sensors read meanwhile.
pub mod hold;

mod likeness;

/// From held poses to a calibration.
pub mod fit;

/// How good each sensor is.
pub mod quality;

/// Whether a calibration still fits.
pub mod drift;

/// A tracker's sensor that is held still.
pub mod tracker_hold;

/// The room and the tracker's place on the wrist.
pub mod place;

/// Calibration files of other programs.
pub mod import;

/// How far a sensor's raw values reach.
pub mod scale;
