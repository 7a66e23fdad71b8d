//! OpenCyberGlove (CyberOrigin, 2025): 19 stretch sensors, packets with a CRC. **Emulated, not yet tried on hardware.**
//!
//! Everything here has one source, the maker's own; which sensor is which joint of the thumb is read out of it, so the
//! order is a setting. The inertial sensors are guarded by the CRC and not used.

pub mod format;
pub mod packet;
