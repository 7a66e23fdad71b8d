//! What is printed goes through here: results to standard output, all else to standard error. Both are written with
//! their errors kept, so that a closed pipe ends the program instead of panicking it.

use std::io::{self, Write};

/// One line of the result.
///
/// # Errors
/// When standard output is closed.
pub(crate) fn line(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.write_all(b"\n")
}

/// One JSON value on one line.
///
/// # Errors
/// When standard output is closed.
pub(crate) fn json(value: &serde_json::Value) -> io::Result<()> {
    line(&value.to_string())
}

/// One line beside the result: what goes on, for people.
pub(crate) fn note(text: &str) {
    // Who closes standard error wants no notes.
    let _ = writeln!(io::stderr().lock(), "tsukamu: {text}");
}

/// Lines of a failure that are shown; a file may have many mistakes.
const MAX_LINES: usize = 8;

/// Why the program fails: one line, and for a file's mistakes one line each.
pub(crate) fn complain(error: &anyhow::Error) {
    let text = format!("{error:#}");
    let mut lines: Vec<&str> = text.lines().take(MAX_LINES).collect();
    if text.lines().nth(MAX_LINES).is_some() {
        lines.push("…");
    }
    note(&lines.join("\n  "));
}
