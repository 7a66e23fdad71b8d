//! Glove and tracker drivers: bytes in, physical readings out.
//!
//! A driver is a state machine without I/O and without a clock ([`session::Session`]): bytes and monotonic stamps
//! are pushed in, readings in SI units are pulled out. [`port`] is the thin shell that joins a session to a serial
//! port on a thread of its own. [`emulate`] speaks the same bytes from the other end, on a pseudo-terminal, so that
//! the whole serial path can be tried without hardware.
//!
//! Everything here is **emulated, not yet tried on hardware**: the byte layouts follow the manuals as cited by
//! several independent open drivers, and no real unit has been connected.

pub mod reading;

pub mod session;

pub mod core;

pub mod driver;

pub mod fault;

pub mod feedback;

pub mod glove;

pub mod calibration;

pub mod tracker;

pub mod vrpn;

pub mod source;

pub mod port;

pub mod port_thread;

pub mod place;

pub mod network;

pub mod ports;

pub mod trial;

pub mod probe;

pub mod clock;

pub mod timing;

pub mod emulate;

mod buffer;
mod ticks;
