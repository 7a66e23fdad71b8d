//! The pure world of Tsukamu: hands, contacts, grasping and motion, advanced by one [`World::step`].
//!
//! No clock, no thread, no file, no random number: everything that changes the world enters through
//! [`StepInput`], and equal inputs give equal bits.

/// What a run starts from.
pub mod scene;
/// What enters the world in one step.
pub mod input;
/// The world and its step: the list of stages.
pub mod step;
/// What one tick shows to the outside.
pub mod frame;
/// Everything that a step may change.
pub mod state;
/// The virtual hand: from a sample to judgement points and segments, and to the shown hand.
pub mod hand;
/// Touching: judgement points on faces, judgement segments on edges.
pub mod contact;
/// From contacts to free, pushed or grasped.
mod classify;
/// Ways of moving, one per file.
pub mod motion;
/// Floor, neighbours, targets.
pub mod environment;
/// The stages of a step.
mod stages;
/// Commands of a tick.
mod commands;
/// Rigid polyhedra.
pub mod polyhedron;
/// Questions about polyhedra: points, segments, overlap.
pub mod query;
/// One number that stands for the whole state.
pub mod digest;
/// A world as bytes.
pub mod snapshot;
/// The state's invariants: asserted in debug builds, checked in snapshots.
mod validate;

pub use input::StepInput;
pub use step::World;
