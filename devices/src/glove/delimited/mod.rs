//! A glove that prints lines of numbers, described by settings alone: most home-made gloves, and the LeRobot Homunculus
//! exoskeleton. **Emulated, not yet tried on hardware.**
//!
//! A line carries no checksum. A digit that is changed on the way is believed; a line with another number of columns, or
//! with something else where a number has to be, is not.

pub mod column;
pub mod format;
pub mod line;

/// What a glove that prints lines of numbers is like.
pub mod settings;
