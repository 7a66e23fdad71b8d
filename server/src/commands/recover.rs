//! `tsukamud recover`

use std::path::PathBuf;

use clap::Args;
use tsukamu_server::record::recover::recover as recover_recording;

use super::Failure;
use super::output::say;

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
    let (finished, ending) = recover_recording(&args.file, &args.output)?;
    say(&format!("{} is {ending}", args.file.display()))?;
    say(&format!(
        "{}: {} messages, {} bytes",
        args.output.display(),
        finished.messages,
        finished.bytes
    ))
}
