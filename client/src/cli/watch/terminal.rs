use console::Term;

/// A second screen, so that what was on the terminal is there again afterwards; no cursor on it.
const ENTER: &str = "\x1b[?1049h\x1b[?25l";
const LEAVE: &str = "\x1b[?25h\x1b[?1049l";
/// Terminals that know these two show what lies between at once; others ignore them.
const BEGIN_PICTURE: &str = "\x1b[?2026h\x1b[H";
const END_PICTURE: &str = "\x1b[J\x1b[?2026l";

/// The terminal while a live view is on it; given back when dropped.
pub(in crate::cli) struct LiveTerminal {
    terminal: Term,
}

impl LiveTerminal {
    pub(in crate::cli) fn open(terminal: Term) -> std::io::Result<Self> {
        terminal.write_str(ENTER)?;
        terminal.flush()?;
        Ok(Self { terminal })
    }

    /// Lines and columns.
    pub(in crate::cli) fn size(&self) -> (usize, usize) {
        let (height, width) = self.terminal.size();
        (usize::from(height), usize::from(width))
    }

    /// Shows these lines from the top, in one write, and nothing below them.
    pub(in crate::cli) fn draw(&self, lines: &[String]) -> std::io::Result<()> {
        let body: Vec<String> = lines
            .iter()
            .map(|line| format!("{line}\x1b[0m\x1b[K"))
            .collect();
        self.terminal.write_str(&format!(
            "{BEGIN_PICTURE}{}{END_PICTURE}",
            body.join("\r\n")
        ))?;
        self.terminal.flush()
    }
}

impl Drop for LiveTerminal {
    fn drop(&mut self) {
        // Nothing can be done about a terminal that is gone.
        let _ = self.terminal.write_str(LEAVE);
        let _ = self.terminal.flush();
    }
}
