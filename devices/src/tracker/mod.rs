//! Position trackers.

pub mod fastrak;
pub mod space;
