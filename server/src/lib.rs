//! The Tsukamu daemon as a library, so that tests can run it in process.

/// Every setting, its unit, its bounds, its default; text to checked values.
pub mod settings;
/// Scenes as TOML files or by built-in name.
pub mod scene_file;
/// TOML texts that people write, read with all their mistakes.
pub mod document;
/// Builds the parts, starts them, waits, drains.
pub mod daemon;
/// The clock of the world: the thread that owns it.
pub mod ticker;
/// Where hands come from.
pub mod input;
/// The daemon at a glance.
pub mod status;
/// What the service manager is told.
pub mod sd_notify;
/// The one port.
pub mod front;
/// The gRPC services.
pub mod service;
/// From a loaded scene to what an epoch begins with.
pub mod plan;
/// Calibration of devices while they run.
pub mod calibration;
/// The folder of recordings.
pub mod recording_desk;
/// The frame lane: encoded once, newest wins.
pub mod broadcast;
/// A message as it goes over the wire.
pub mod wire_message;
/// The event lane: bounded, numbered, resumable.
pub mod event_log;
/// World values to wire messages and back.
pub mod convert;
/// A VRPN server.
pub mod vrpn;
/// Recordings: written, read, verified, exported.
pub mod record;
/// What is wrong with a device, and what to do.
pub mod doctor;
/// Emulated devices, worn by a hand whose motion is known.
pub mod emulate;
/// Scenes against hand motion, offline.
pub mod offline;
/// The paper's experiments, done again.
pub mod experiment;
/// What is handed to a recording.
pub mod recorder_handle;
/// What the daemon counts about itself.
pub mod metrics;
/// The daemon's time.
pub mod clock;
