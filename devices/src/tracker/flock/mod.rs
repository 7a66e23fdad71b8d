//! Ascension Flock of Birds, one bird alone or a group on one line. **Emulated, not yet tried on hardware.**

pub mod decode;
pub mod protocol;
pub mod session;
pub mod settings;

mod status;
