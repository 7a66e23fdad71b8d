//! The frame lane: one encoding per frame, any number of subscribers, newest wins.
//!
//! ```text
//! tick thread --Inbox (merged, never waits)--> publisher thread --watch (newest only)--> a stream per subscriber
//!                                               |  mirror of the world, cumulative deltas, one encoding
//!                                               '--> event log, recorder
//! ```
//!
//! The tick only copies what changed. A subscriber that stops reading is stopped by HTTP/2 flow control: its stream is
//! not polled, holds at most a keyframe and a frame, and skips to the newest when it reads on.

/// What the tick hands over.
pub mod inbox;
/// The publisher's copy of the world, and its keyframes and deltas.
pub mod mirror;
/// The thread between tick and subscribers.
pub mod publisher;
/// One subscriber's stream.
pub mod subscriber;
