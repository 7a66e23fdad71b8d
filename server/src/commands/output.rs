//! What the commands say: results on standard output, everything else on standard error.

use std::io::{ErrorKind, IsTerminal, Write, stderr, stdout};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::Failure;

/// A result, with a line end.
pub(super) fn say(text: &str) -> Result<(), Failure> {
    match writeln!(stdout().lock(), "{text}") {
        // The reader has seen enough (`| head`): not a failure.
        Err(fault) if fault.kind() == ErrorKind::BrokenPipe => Ok(()),
        done => Ok(done?),
    }
}

/// A mistake or a note, with a line end.
pub(super) fn tell(text: &str) {
    // Where standard error is gone there is nobody to tell.
    let _ = writeln!(stderr().lock(), "{text}");
}

/// A number of things: "1 step", "2 steps".
pub(super) fn count(n: u64, thing: &str) -> String {
    let plural = if n == 1 { "" } else { "s" };
    format!("{n} {thing}{plural}")
}

/// A bar on standard error while that is a terminal, nothing otherwise.
pub(super) fn progress_bar(length: u64, unit: &str) -> ProgressBar {
    if !stderr().is_terminal() {
        return ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::hidden());
    }
    let numbers = if unit == "bytes" {
        "{bytes}/{total_bytes}"
    } else {
        "{human_pos}/{human_len}"
    };
    let template = format!("{{wide_bar:.cyan/blue}} {numbers} {unit}, {{eta}} left");
    let style =
        ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length).with_style(style)
}
