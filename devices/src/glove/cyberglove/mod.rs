//! CyberGlove (18 or 22 sensors), 8-bit records. **Emulated, not yet tried on hardware.**

pub mod decode;
pub mod high_resolution;
pub mod protocol;
pub mod session;
pub mod settings;

mod reply;
mod running;
mod script;
