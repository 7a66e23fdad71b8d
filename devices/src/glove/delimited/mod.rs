//! A glove that prints lines of numbers, described by settings alone: most home-made gloves, and the LeRobot Homunculus
//! exoskeleton. **Emulated, not yet tried on hardware.**
//!
//! Two worked examples, a sketch for five bend sensors and the Homunculus, stand in `deploy/homemade-glove.toml`. Lines
//! that begin with `#` or `//` are comments, blank ones and those without the prefix say nothing, and what is printed
//! before the first good line is the board coming up. Many boards restart when their port is opened, so a silent one is
//! given ten seconds before that is done again.
//!
//! A line carries no checksum. A digit that is changed on the way is believed; a line with another number of columns, or
//! with something else where a number has to be, is not.

pub mod column;
pub mod format;
pub mod line;

/// What a glove that prints lines of numbers is like.
pub mod settings;
