//! Rokoko Studio's custom streaming, JSON version 3, over UDP to port 14043: all joints of actors in the space of the
//! world (Unity's: left-handed, y up, z forward, metres), plain or compressed by LZ4.
//!
//! The angles come from the positions of the joints: which way a joint's own axes point at rest is not documented.

pub mod settings;

pub(crate) mod decode;
pub(crate) mod lz4;
pub(crate) mod skeleton;

/// The port of Studio's default.
pub const USUAL_PORT: u16 = 14_043;
