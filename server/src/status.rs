//! What the daemon shows of itself at a glance: written by the tick, read by anyone.

use std::sync::{Mutex, MutexGuard, PoisonError};

use tsukamu_proto::v1;

/// The daemon at a glance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// The last step.
    pub stamp: v1::Stamp,
    /// The scene's name.
    pub scene: String,
    /// The model's name.
    pub model: &'static str,
    /// `realtime` or `lockstep`.
    pub mode: &'static str,
    /// Whether the clock is stopped.
    pub is_paused: bool,
    /// Steps per second, nominal.
    pub rate_hz: f64,
    /// Steps per second over the last second.
    pub measured_rate_hz: f64,
    /// Objects in the world.
    pub n_objects: u32,
    /// Hands in the world.
    pub n_hands: u32,
    /// Name of the recording under way, or empty.
    pub recording: String,
}

/// Where the status hangs. Whoever holds it does so for nanoseconds.
#[derive(Debug, Default)]
pub struct StatusBoard(Mutex<Status>);

impl StatusBoard {
    /// The status now.
    pub fn now(&self) -> Status {
        self.lock().clone()
    }

    /// The last step's stamp.
    pub fn stamp(&self) -> v1::Stamp {
        self.lock().stamp
    }

    /// Changes it.
    pub fn update(&self, change: impl FnOnce(&mut Status)) {
        change(&mut self.lock());
    }

    /// A panic elsewhere leaves plain values.
    fn lock(&self) -> MutexGuard<'_, Status> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
