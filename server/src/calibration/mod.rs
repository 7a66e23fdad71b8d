//! Calibration of devices while they run: what they read, what is in force, guided runs, files.

/// What each device reads, and what is in force for it.
pub mod taps;
/// Guided runs, and everything that is asked about calibration.
pub mod desk;
/// Why something about calibration cannot be done.
pub mod fault;

/// Waiting for a pose, a range, a tracker at rest.
pub mod capture;

mod file;

#[cfg(test)]
mod tests;
