//! Cuts the host's bytes into the commands of a Polhemus unit: single letters that act at once, and lines.

/// Longest line.
const MAX_LINE: usize = 128;

/// One command of the host.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Command {
    Letter(u8),
    /// What came before CR or LF, never empty.
    Line(Vec<u8>),
    /// A line that was too long and is forgotten.
    Overflow,
}

/// The line that has been begun.
#[derive(Debug, Clone, Default)]
pub(crate) struct CommandReader {
    line: Vec<u8>,
}

impl CommandReader {
    /// Takes a byte, and gives the command that is whole with it. A letter that `begins_line` does not act at once.
    pub(crate) fn take(&mut self, byte: u8, begins_line: impl Fn(u8) -> bool) -> Option<Command> {
        if self.line.is_empty() && !begins_line(byte) {
            return Some(Command::Letter(byte));
        }
        if matches!(byte, b'\r' | b'\n') {
            return Some(Command::Line(std::mem::take(&mut self.line)));
        }
        self.line.push(byte);
        if self.line.len() > MAX_LINE {
            self.line.clear();
            return Some(Command::Overflow);
        }
        None
    }

    /// Forgets what has been begun.
    pub(crate) fn clear(&mut self) {
        self.line.clear();
    }
}
