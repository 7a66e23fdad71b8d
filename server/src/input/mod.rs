//! Where hands come from. Every source ends in the same [`HandSample`](tsukamu_world::hand::sample::HandSample).
//!
//! ```text
//! glove, tracker --assemble--> lane --> fusion: filter, predict, join by time --.
//! client (Hands.Drive) ------> lane --> newest wins, filter --------------------+--> intake --> StepInput
//! file or computed motion ------------> sampled at the world's own time --------'
//! ```

/// From a glove's and a tracker's readings to joint angles and wrist poses.
pub mod assemble;
/// What the world does to the fingers in a glove.
pub mod feedback;
/// The filter of a whole hand.
pub mod filter;
/// A glove's and a tracker's streams, joined by time into one hand.
pub mod fusion;
/// All sources of the world, and what they give to each step.
pub mod intake;
/// Rate, jitter, gaps and age of a stream of samples.
pub mod meter;
/// Quantities that move.
pub mod moving;
/// The One-Euro filter.
pub mod one_euro;
/// Whether a device is there.
pub mod presence;
/// Where a stream will be a little later.
pub mod predict;
/// How often a glove's sensors are beyond their range.
pub mod reach;
/// A client's stream that drives a hand.
pub mod remote;
/// The measured error of a stream's prediction.
pub mod score;
/// What a source says.
pub mod seen;
/// Gloves and trackers on serial ports.
pub mod serial;
/// One source as seen from outside: its lane to the tick and its statistics.
pub mod sources;
/// One of the two streams that make a hand.
pub mod stream;
/// Devices are looked after.
pub mod supervise;
/// What is wrong with a device that is there.
pub mod warning;
