//! `tsukamud man`

use std::fs::create_dir_all;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, Command};

use super::Failure;
use super::output::tell;

/// Arguments of `tsukamud man`.
#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// The folder; it is made if it is not there.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

/// Writes the man pages of `command`, one for itself and one for each of its commands.
pub(super) fn man(args: &ManArgs, command: Command) -> Result<(), Failure> {
    let folder = &args.output;
    let name = command.get_name().to_owned();
    write(folder, command).with_context(|| folder.display().to_string())?;
    tell(&format!("read it: man {}/{name}.1", folder.display()));
    Ok(())
}

/// The same, without a word.
pub(super) fn write(folder: &Path, command: Command) -> io::Result<()> {
    create_dir_all(folder)?;
    clap_mangen::generate_to(command, folder)
}
