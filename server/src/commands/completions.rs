//! `tsukamud completions`

use clap::{Args, Command};
use clap_complete::{Shell, generate};

use super::Failure;
use super::output::say;

/// Arguments of `tsukamud completions`.
#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// The shell.
    shell: Shell,
}

/// Prints the completions of `command`.
pub(super) fn completions(args: &CompletionsArgs, command: &mut Command) -> Result<(), Failure> {
    say(text(args.shell, command)?.trim_end())
}

/// The completions of `command`.
pub(super) fn text(shell: Shell, command: &mut Command) -> Result<String, Failure> {
    let name = command.get_name().to_owned();
    let mut text = Vec::new();
    generate(shell, command, name, &mut text);
    Ok(String::from_utf8(text)?)
}
