//! Recordings: every session is a proof.
//!
//! A recording is an MCAP file. Its channels carry protobuf messages with their schemas inside, so that other tools
//! open it: `/scene` (SceneRecord), `/inputs` (StepInput), `/events` (Event), `/digests` (Digest) and, where asked
//! for, `/frames` (Frame), `/raw` (RawBytes), `/samples` (RawSample). Each scene's own text is an attachment; build,
//! settings and counts are metadata.
//!
//! A recording begins where the world stood when it was asked for: at a scene's start, or in mid-session with the
//! state of the world as bytes. Each further scene begins a new epoch.
//!
//! A message's log time is the wall stamp of its step, in nanoseconds since the Unix epoch.

/// The world that a recording, or an epoch of it, begins with.
pub mod beginning;
/// Tables for spreadsheets.
pub mod export;
/// Reads one from its start, also one that was cut off.
pub mod reader;
/// Makes a whole file of one that was cut off.
pub mod recover;
/// Steps a world through a recording again.
pub mod replay;
/// Compares a replay with the recorded digests.
pub mod verify;
/// Writes a recording, at once or on a thread of its own.
pub mod writer;

mod channels;
mod staged;

/// Why a recording cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordFault {
    /// The file cannot be opened or made.
    #[error("{file}: {source}")]
    Open {
        /// The file.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// Writing failed: the disk is full, say.
    #[error("writing the recording failed")]
    Write(#[from] mcap::McapError),
    /// Syncing to disk failed.
    #[error("syncing the recording to disk failed")]
    Sync(#[from] std::io::Error),
    /// The thread of the writer is gone without an answer.
    #[error("the thread of the recording has panicked")]
    Panicked,
}
