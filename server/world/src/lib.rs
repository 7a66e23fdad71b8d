//! The pure world of Tsukamu: hands, contacts, grasping and motion, advanced by one [`World::step`].
//!
//! No clock, no thread, no file, no random number: everything that changes the world enters through
//! [`StepInput`], and equal inputs give equal bits.

/// What a run starts from.
pub mod scene;
/// Everything that a step may change.
pub mod state;
/// What enters the world in one step.
pub mod input;
/// The world and its step: the list of stages.
pub mod step;
/// What one tick shows to the outside.
pub mod frame;
/// The stages of a step.
mod stages;
/// Commands of a tick.
mod commands;
/// Asserts the state's invariants in debug builds.
mod validate;
/// One number that stands for the whole state.
pub mod digest;
/// The virtual hand: from a sample to judgement points and segments, and to the shown hand.
pub mod hand;
/// Rigid polyhedra.
pub mod polyhedron;
/// Questions about polyhedra: points, segments, overlap.
pub mod query;
/// Touching: judgement points on faces, judgement segments on edges.
pub mod contact;
/// From contacts to free, pushed or grasped.
mod classify;
/// Ways of moving, one per file.
pub mod motion;
/// Floor, neighbours, targets.
pub mod environment;

pub use input::StepInput;
pub use step::World;
