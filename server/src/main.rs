//! `tsukamud`: the daemon and the tools around it.

mod commands;

use std::process::ExitCode;

fn main() -> ExitCode {
    commands::main()
}
