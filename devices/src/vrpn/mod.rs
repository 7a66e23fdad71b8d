//! VRPN, the network protocol of trackers, analogs and buttons in virtual-reality labs.
//!
//! The wire ([`cookie`], [`message`], [`body`], [`names`], [`inbound`]) is shared by the client here and the daemon's
//! server. [`session`] is the client as a state machine, [`thread`] joins it to a server over TCP and UDP.
//!
//! All numbers on the wire are big endian. The layouts were checked against captured exchanges with a real server and a
//! real client of version 07.38; this code itself has only been joined to its own other end.

pub mod address;
pub mod body;
pub mod cookie;
pub mod inbound;
pub mod message;
pub mod names;
pub mod session;
pub mod settings;
pub mod thread;

mod link;
mod liveness;
mod readings;

/// The port of a VRPN server, TCP and UDP.
pub const DEFAULT_PORT: u16 = 3883;
