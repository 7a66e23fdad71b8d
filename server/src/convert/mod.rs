//! World values to wire messages and back. Nothing else in the daemon names both.
//!
//! Both ways are exact: a scene, a hand model, a sample or a step input that went over the wire is the same to the
//! last bit, so that a recording rebuilds the very world it was made in. What comes from strangers is checked here,
//! and after that trusted.

/// Vectors, rotations, poses, small enumerations.
pub mod basic;
/// Readings, calibrations, rooms and mounts.
pub mod calibration;
/// What is told about a device.
pub mod device;
/// Changes of state.
pub mod event;
/// Why a message is refused, and which gRPC status says so.
pub mod fault;
/// What a tick publishes.
pub mod frame;
/// Hand models and hand samples.
pub mod hand;
/// Step inputs and the commands in them.
pub mod input;
/// Whole scenes and single objects.
pub mod scene;
/// Polyhedra.
pub mod shape;

#[cfg(test)]
mod tests;
