//! Polhemus Fastrak, ASCII and binary lists. **Emulated, not yet tried on hardware.**

pub mod decode;
pub mod protocol;
pub mod session;
pub mod settings;
pub mod status;
