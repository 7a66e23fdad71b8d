//! Everything around an object that no hand touches (model §7 and §8).

/// Falling on the floor, standing, toppling.
pub mod floor;
/// Objects that run into each other.
pub(crate) mod neighbours;
/// The floor's support polygon.
pub mod support;
/// Targets to throw at.
pub(crate) mod targets;
