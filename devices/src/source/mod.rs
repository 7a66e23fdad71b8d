//! Programs on the network that send hands: each datagram is a frame, or a part of one.
//!
//! All of them come from public pages and third-party readers; **none has been tried with its sender.**

pub mod session;

pub mod rokoko;
pub mod udcap;
pub mod vmc;

pub(crate) mod links;
pub(crate) mod unity;
