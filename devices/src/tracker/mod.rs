//! Position trackers.

pub mod dialect;
pub mod fastrak;
pub mod flock;
pub mod isotrak;
pub mod liberty;
pub mod packed;
pub mod session;
pub mod space;

pub(crate) mod numbers;
