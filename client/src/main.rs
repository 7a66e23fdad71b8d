//! `tsukamu`: look at a running daemon, drive a hand, command it.

use std::process::ExitCode;

/// Arguments, commands and what they print.
mod cli;

#[tokio::main(flavor = "current_thread")]
async fn main() -> ExitCode {
    cli::main().await
}
