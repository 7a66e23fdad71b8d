//! The experiments: what the 1998 paper reports, done again, and recorded hands judged by its model.
//!
//! Each has options, a `run` that answers with a report, and a report that is text for people and JSON for programs.

/// Steps per second against the number of objects (Fig. 13).
pub mod cost;
/// The five operations and the target game of the paper's §5.2.
pub mod operations;
/// The share of recorded hands whose object is grasped and carried.
pub mod recordings;
/// Contact states over time (Fig. 12).
pub mod transitions;

/// Colours and type of the pictures.
mod picture;
/// A scene with its own hands, watched step by step.
mod play;
/// Tables for people.
mod table;
