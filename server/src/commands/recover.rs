//! `tsukamud recover`

use std::path::PathBuf;

use clap::Args;
use tsukamu_server::record::recover::recover as recover_recording;

use super::Failure;
use super::given::ensure_recording;
use super::output::{count, say, tell};

/// Arguments of `tsukamud recover`.
#[derive(Debug, Args)]
pub(super) struct RecoverArgs {
    /// The recording that was cut off.
    file: PathBuf,
    /// The new recording; it must not be there yet.
    #[arg(short, long, value_name = "OUT.mcap")]
    output: PathBuf,
}

/// Makes a whole recording of one that was cut off.
pub(super) fn recover(args: &RecoverArgs) -> Result<(), Failure> {
    ensure_recording(&args.file)?;
    let (finished, ending) = recover_recording(&args.file, &args.output)?;
    say(&format!("{} is {ending}", args.file.display()))?;
    say(&format!(
        "{}: {}, {} bytes",
        args.output.display(),
        count(finished.messages, "message"),
        finished.bytes
    ))?;
    if finished.messages == 0 {
        tell("it was cut off before its first message: there is nothing to recover");
        return Err(Failure::Negative);
    }
    Ok(())
}
