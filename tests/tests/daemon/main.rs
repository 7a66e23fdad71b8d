//! The daemon over a real loopback socket, in process, on a free port. No test waits for a time to pass: each waits for
//! a value, with a deadline.

mod commands;
mod drain;
mod events;
mod frames;
mod front;
mod hands;
mod mid_session;
mod readings;
mod recordings;
mod rude_clients;
mod rude_scenes;
mod support;
mod vrpn;
mod vrpn_alice;
mod vrpn_across;
mod vrpn_probe;
mod vrpn_rude;
