//! 5DT data gloves: 5 (wired and wireless) and the serial kits of 14 and 16. **Emulated, not yet tried on hardware.**
//!
//! What the sources leave open is settled by the glove itself or by settings: whether a record ends in a checksum, and
//! in which, is learned from the records ([`checksum`]); the order of a left glove's fingers is a setting.

pub mod checksum;
pub mod format;
pub mod long_packet;
pub mod short_packet;

/// What the user may choose about a 5DT glove.
pub mod settings;
