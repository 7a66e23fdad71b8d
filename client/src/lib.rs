//! The thin Tsukamu client: connect, watch frames and events, keep a short timeline for a renderer, drive a hand.
//!
//! What computes is pure and takes its time as an argument: [`view`], [`timeline`], [`clock_sync`]. What talks to the
//! daemon is thin: [`connect`], [`subscribe`], [`feed`].

/// The client's steady clock: the only file that asks for the time.
pub mod clock;
/// How far the daemon's clock is from ours, with an error bound.
pub mod clock_sync;
/// Reaching a daemon: retry, back-off, protocol version.
pub mod connect;
/// Why a daemon cannot be reached, in words that say what to do.
pub mod connect_error;
/// An event in words.
pub mod event_text;
/// Watching events: a stream that resumes where it broke.
pub mod event_watch;
/// Driving a hand.
pub mod feed;
/// The names of states, sides and events in files and for people.
pub mod names;
/// How often to try again.
pub mod retry;
/// Hand samples of the world as wire messages.
pub mod sample;
/// Watching frames: a stream that reconnects and keeps a view of the world up to date.
pub mod subscribe;
/// A short buffer of views, and the poses at any time in it.
pub mod timeline;
/// The world as frames tell it; keyframes and cumulative deltas.
pub mod view;
