//! Where hands come from. Every source ends in the same [`HandSample`](tsukamu_world::hand::sample::HandSample).
//!
//! ```text
//! glove + tracker --assemble--> lane --.
//! client (Hands.Drive)  ------> lane --+--> intake: newest wins, filter, interpolate --> StepInput
//! file or computed motion ------------'     (a track is sampled at the world's own time)
//! ```

/// From a glove's and a tracker's readings to hand samples.
pub mod assemble;
/// Between samples: held or interpolated.
pub mod between;
/// The One-Euro filter.
pub mod filter;
/// All sources of the world, and what they give to each step.
pub mod intake;
/// Rate, longest gap and age of a stream of samples.
pub mod meter;
/// A client's stream that drives a hand.
pub mod remote;
/// Gloves and trackers on serial ports.
pub mod serial;
/// One source as seen from outside: its lane to the tick and its statistics.
pub mod sources;
