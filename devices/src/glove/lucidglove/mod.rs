//! LucidGloves and others that speak the OpenGloves protocol, in its alpha and its legacy encoding. **Emulated, not yet
//! tried on hardware.**
//!
//! A home-made glove sends one line of text per sample, five curls at least, and takes lines back: limits for the
//! servos that stop a finger from bending further, and vibrations. It says neither what it is nor how far its numbers
//! go, so both are found out from what it sends.

pub mod decode;
pub mod defaults;
pub mod protocol;
pub mod session;
pub mod settings;

mod flow;
mod lines;
pub(crate) mod posture;
mod range;
