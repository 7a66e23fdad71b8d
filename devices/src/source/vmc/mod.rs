//! The VMC protocol: OSC messages with the bones of an avatar, as many motion-capture programs send them over UDP to
//! port 39539.
//!
//! Each bone is sent with its position and rotation in the space of its parent, as Unity has it. The rotations are
//! taken to be those of a VRM avatar: in T-pose (arms along x, palms down, fingers straight, thumbs level and 45°
//! forward) all of them are the identity. A sender with another skeleton gives other angles.

pub(crate) mod bones;
pub(crate) mod decode;
pub(crate) mod frame;
pub(crate) mod osc;

/// The port of the convention for motion data.
pub const USUAL_PORT: u16 = 39_539;
