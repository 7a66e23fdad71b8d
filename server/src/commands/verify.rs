//! `tsukamud verify`

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use tsukamu_server::record::reader::{self, Ending};
use tsukamu_server::record::verify::verify as verify_recording;
use tsukamu_server::record::writer::build;

use super::Failure;
use super::given::ensure_recording;
use super::output::{count, progress_bar, say, tell};

/// Arguments of `tsukamud verify`.
#[derive(Debug, Args)]
pub(super) struct VerifyArgs {
    /// The recording; one that was cut off is verified up to the cut.
    file: PathBuf,
}

/// Replays a recording and compares every digest.
pub(super) fn verify(args: &VerifyArgs) -> Result<(), Failure> {
    ensure_recording(&args.file)?;
    let recording = reader::open(&args.file)?;
    let length = std::fs::metadata(&args.file)?.len();
    let bar = progress_bar(length, "bytes");
    let start = Instant::now();
    let found = verify_recording(recording, |n_read| bar.set_position(n_read));
    let took_s = start.elapsed().as_secs_f64().max(1.0e-9);
    bar.finish_and_clear();
    say(&format!(
        "{} in {}, {} equal; {:.3} s of world time in {took_s:.3} s, {:.1} times real time",
        count(found.ticks, "step"),
        count(found.epochs, "epoch"),
        count(found.digests, "digest"),
        found.world_time_s,
        found.world_time_s / took_s,
    ))?;
    if let Some(ending @ (Ending::Cut | Ending::Damaged(_))) = &found.ending {
        say(&format!("the recording is {ending}"))?;
    }
    if found.unchecked_ticks > 0 {
        say(&format!(
            "the last {} steps have no digest to compare with",
            found.unchecked_ticks
        ))?;
    }
    match found.fault {
        None => say(&format!("{}: verified", args.file.display())),
        Some(fault) => {
            tell(&format!("{}: NOT verified: {fault}", args.file.display()));
            let made_by = reader::session(&args.file)?
                .remove("build")
                .unwrap_or_default();
            if made_by != build() {
                tell(&format!(
                    "it was made by {made_by:?}, this is {:?}",
                    build()
                ));
            }
            Err(Failure::Negative)
        }
    }
}
