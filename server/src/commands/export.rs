//! `tsukamud export`

use std::path::PathBuf;

use clap::Args;
use tsukamu_server::record::export::export as export_recording;
use tsukamu_server::record::reader::{self, Ending};

use super::Failure;
use super::given::ensure_recording;
use super::output::{progress_bar, say, tell};

/// Arguments of `tsukamud export`.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    /// The recording.
    file: PathBuf,
    /// Folder for poses.csv, hands.csv, events.csv and inputs.csv; made where it is missing.
    #[arg(long, value_name = "DIR")]
    csv: PathBuf,
}

/// Turns a recording into tables.
pub(super) fn export(args: &ExportArgs) -> Result<(), Failure> {
    ensure_recording(&args.file)?;
    let recording = reader::open(&args.file)?;
    let bar = progress_bar(std::fs::metadata(&args.file)?.len(), "bytes");
    let ending = export_recording(recording, &args.csv, |n_read| bar.set_position(n_read));
    bar.finish_and_clear();
    let ending = ending?;
    if ending != Ending::Complete {
        tell(&format!("the recording is {ending}"));
    }
    say(&format!(
        "poses.csv, hands.csv, events.csv and inputs.csv are in {}",
        args.csv.display()
    ))
}
