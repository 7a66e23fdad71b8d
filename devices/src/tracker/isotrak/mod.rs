//! Polhemus Isotrak II and 3SPACE Tracker, binary records. **Emulated, not yet tried on hardware.**

pub mod decode;
pub mod protocol;
pub mod session;
pub mod settings;
