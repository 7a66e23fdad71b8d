use std::io::{BufRead, IsTerminal, stdin};
use std::time::{Duration, Instant};

use anyhow::Result;
use console::Term;
use tokio::sync::oneshot;

use super::args::CalibrateArgs;
use super::picture::Picture;
use crate::cli::output;
use crate::cli::watch::terminal::LiveTerminal;

/// Between two drawings.
const REDRAW: Duration = Duration::from_millis(50);

/// Where the wearer sees what to do: a picture on a terminal, lines elsewhere.
pub(super) struct Stage {
    terminal: Option<LiveTerminal>,
    pub(super) picture: Picture,
    is_json: bool,
    waits: bool,
    drawn: Option<Instant>,
    told: String,
}

/// What a routine has to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Show {
    /// The sensors of a glove.
    Picture,
    /// A few lines.
    Lines,
}

impl Stage {
    /// With a picture if there is a terminal and nobody wants lines.
    pub(super) fn open(args: &CalibrateArgs, is_json: bool, show: Show) -> Result<Self> {
        let terminal = Term::buffered_stdout();
        let is_live = terminal.is_term() && show == Show::Picture && !args.plain && !is_json;
        Ok(Self {
            terminal: is_live.then(|| LiveTerminal::open(terminal)).transpose()?,
            picture: Picture::default(),
            is_json,
            waits: !args.now && stdin().is_terminal(),
            drawn: None,
            told: String::new(),
        })
    }

    /// Whether somebody is there to press Enter.
    pub(super) const fn waits(&self) -> bool {
        self.waits
    }

    /// The terminal is given back; from here on there are lines.
    pub(super) fn close(&mut self) {
        self.terminal = None;
    }

    /// Draws what has changed, not too often.
    pub(super) fn draw(&mut self) -> Result<()> {
        let Some(terminal) = &self.terminal else {
            return Ok(());
        };
        if self.drawn.is_some_and(|drawn| drawn.elapsed() < REDRAW) {
            return Ok(());
        }
        self.drawn = Some(Instant::now());
        let (height, width) = terminal.size();
        terminal.draw(&self.picture.lines(width, height))?;
        Ok(())
    }

    /// Draws what has changed at once.
    pub(super) fn draw_now(&mut self) -> Result<()> {
        self.drawn = None;
        self.draw()
    }

    /// One line for people who have no picture; the same line twice is told once.
    pub(super) fn tell(&mut self, text: &str) -> Result<()> {
        if self.terminal.is_some() || self.told == text {
            return Ok(());
        }
        text.clone_into(&mut self.told);
        if self.is_json {
            output::note(text);
        } else {
            output::line(text)?;
        }
        Ok(())
    }
}

/// Answers when Enter is pressed, or standard input ends.
pub(super) fn enter() -> oneshot::Receiver<()> {
    let (pressed, answer) = oneshot::channel();
    // A thread of its own: the runtime would wait for its end, which may never come.
    let reading = std::thread::Builder::new()
        .name("enter".to_owned())
        .spawn(move || {
            // What cannot be read is as good as Enter.
            let _ = stdin().lock().read_line(&mut String::new());
            // Whoever waited may have gone.
            let _ = pressed.send(());
        });
    drop(reading);
    answer
}
