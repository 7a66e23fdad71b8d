//! Polhemus Liberty, Patriot and Latus, binary frames. **Emulated, not yet tried on hardware.**

pub mod decode;
pub mod protocol;
pub mod session;
pub mod settings;

mod who;
