//! The client against a daemon that follows a script, over a real local socket.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

/// The scripted daemon.
mod fake;

mod calibrating;
mod command_line;
mod connecting;
mod driving;
mod events;
mod frames;
