//! Compares a replay with the recorded digests.

use std::io::Read;

use super::reader::{Ending, RecordingReader};
use super::replay::{Moment, Replay, ReplayFault};

/// What a replay proved.
#[derive(Debug)]
pub struct Verification {
    /// Worlds that were built.
    pub epochs: u64,
    /// Steps that were done.
    pub ticks: u64,
    /// Digests that were compared and equal.
    pub digests: u64,
    /// Steps after the last digest: replayed, but not compared.
    pub unchecked_ticks: u64,
    /// World time that was replayed, in seconds, over all epochs.
    pub world_time_s: f64,
    /// How the recording ends, as far as it was read.
    pub ending: Option<Ending>,
    /// Why it is no proof, if it is none.
    pub fault: Option<VerifyFault>,
}

/// Why a recording is no proof.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum VerifyFault {
    /// The world came to another state than the recorded one.
    #[error(
        "epoch {epoch}, tick {tick}: the digest is {computed:016x}, recorded is {recorded:016x} (last equal: tick {last_equal})"
    )]
    Differs {
        /// The epoch.
        epoch: u64,
        /// First tick whose digest differs.
        tick: u64,
        /// Tick of the last digest that was equal; before the first, the tick at which the recording begins.
        last_equal: u64,
        /// The digest of the replay.
        computed: u64,
        /// The digest in the recording.
        recorded: u64,
    },
    /// The recording cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayFault),
    /// The recording is damaged.
    #[error("the recording is damaged: {0}")]
    Damaged(String),
    /// There is nothing to compare.
    #[error("the recording holds no digest to compare with")]
    Nothing,
}

/// Replays a recording and compares each digest; stops at the first that differs. `progress` gets the bytes read, now
/// and then.
pub fn verify<R: Read>(
    recording: RecordingReader<R>,
    mut progress: impl FnMut(u64),
) -> Verification {
    let mut replay = Replay::new(recording);
    let mut found = Verification {
        epochs: 0,
        ticks: 0,
        digests: 0,
        unchecked_ticks: 0,
        world_time_s: 0.0,
        ending: None,
        fault: None,
    };
    let mut last_equal = 0;
    while found.fault.is_none() {
        match replay.next_moment() {
            Ok(None) => break,
            Ok(Some(Moment::Epoch)) => {
                found.epochs += 1;
                last_equal = replay.world().map_or(0, |world| world.state().tick);
            }
            Ok(Some(Moment::Stepped { .. })) => {
                found.ticks += 1;
                found.unchecked_ticks += 1;
                found.world_time_s += replay
                    .world()
                    .map_or(0.0, |world| world.scene().step_length_s());
            }
            Ok(Some(Moment::Digest { recorded })) => {
                found.fault = compare(&replay, recorded, &mut last_equal);
                if found.fault.is_none() {
                    found.digests += 1;
                    found.unchecked_ticks = 0;
                }
                progress(replay.n_read());
            }
            Err(fault) => found.fault = Some(fault.into()),
        }
    }
    found.ending = replay.ending().cloned();
    found.fault = found
        .fault
        .or_else(|| match (&found.ending, found.digests) {
            (Some(Ending::Damaged(fault)), _) => Some(VerifyFault::Damaged(fault.clone())),
            (_, 0) => Some(VerifyFault::Nothing),
            _ => None,
        });
    found
}

fn compare<R: Read>(
    replay: &Replay<R>,
    recorded: u64,
    last_equal: &mut u64,
) -> Option<VerifyFault> {
    let world = replay.world()?;
    let (tick, computed) = (world.state().tick, world.digest());
    if computed == recorded {
        *last_equal = tick;
        return None;
    }
    Some(VerifyFault::Differs {
        epoch: replay.epoch(),
        tick,
        last_equal: *last_equal,
        computed,
        recorded,
    })
}
