//! A glove that prints lines of numbers, after settings for it. **No real glove has been compared with it.**

use std::fmt::Write;

use crate::emulate::Emulator;
use crate::emulate::beat::Beat;
use crate::emulate::line_fault::LineFaults;
use crate::glove::delimited::column::Column;
use crate::glove::delimited::settings::{DelimitedSettings, Scale, TimeUnit};
use crate::glove::sensor::GloveSensor;

/// Lines in a second.
const RATE_HZ: u64 = 100;

/// A board that prints lines of numbers, as a state machine seen from its side of the line.
#[derive(Debug, Clone)]
pub struct DelimitedEmulator {
    /// What goes wrong on the line.
    pub faults: LineFaults,
    /// What is printed when the board comes up.
    pub boot_text: String,
    settings: DelimitedSettings,
    raw: [f64; GloveSensor::N_SLOTS],
    beat: Beat,
    /// Whether the board has come up.
    is_up: bool,
    /// What was heard of the line that starts it.
    heard: Vec<u8>,
    output: Vec<u8>,
}

impl DelimitedEmulator {
    /// A board whose lines are as the settings say, with straight fingers. One with a start-up line waits for it.
    #[must_use]
    pub fn new(settings: DelimitedSettings) -> Self {
        let mut beat = Beat::new(RATE_HZ);
        if settings.start.is_empty() {
            beat.start(0);
        }
        let straight = match settings.scale {
            Scale::Range(first, _) => first,
            Scale::Degrees | Scale::Radians => 0.0,
        };
        Self {
            faults: LineFaults::none(),
            boot_text: "# emulated glove\r\nready, 100 lines/s\r\n".to_owned(),
            settings,
            raw: [straight; GloveSensor::N_SLOTS],
            beat,
            is_up: false,
            heard: Vec::new(),
            output: Vec::new(),
        }
    }

    /// Bends the glove: raw values by wire slot. A column of several sensors is their mean.
    pub const fn set_slots(&mut self, raw: &[f64; GloveSensor::N_SLOTS]) {
        self.raw = *raw;
    }

    /// Resets the board, as opening the port of many of them does.
    pub fn reset(&mut self, now_ns: u64) {
        self.is_up = false;
        self.heard.clear();
        if self.settings.start.is_empty() {
            self.beat.start(now_ns);
        } else {
            self.beat.stop();
        }
    }

    fn say(&mut self, bytes: Vec<u8>) {
        let bytes = self.faults.apply(bytes);
        self.output.extend(bytes);
    }

    fn line(&self, now_ns: u64) -> String {
        let mut letters = self.settings.separators.chars();
        let separator = letters.next().unwrap_or(' ');
        let mut line = self.settings.prefix.clone();
        for (index, column) in self.settings.columns.iter().enumerate() {
            if index > 0 {
                line.push(separator);
            }
            let value = match column {
                Column::Skip => 0.0,
                Column::Time => self.time(now_ns),
                Column::Sensors(sensors) => {
                    let sum: f64 = sensors.iter().map(|sensor| self.raw[sensor.slot()]).sum();
                    sum / sensors.len().max(1) as f64
                }
            };
            // Writing to a string cannot fail.
            let _ = write!(line, "{}", self.rounded(column, value));
        }
        line.push_str("\r\n");
        line
    }

    /// Whole raw values and times as a board has them; angles and seconds with their decimals.
    fn rounded(&self, column: &Column, value: f64) -> f64 {
        let is_whole = match column {
            Column::Time => self.settings.time_unit != TimeUnit::Seconds,
            Column::Skip | Column::Sensors(_) => matches!(self.settings.scale, Scale::Range(..)),
        };
        if is_whole {
            value.round()
        } else {
            (value * 1.0e4).round() / 1.0e4
        }
    }

    fn time(&self, now_ns: u64) -> f64 {
        let turn = 1_u64 << 32;
        match self.settings.time_unit {
            TimeUnit::Seconds => now_ns as f64 * 1.0e-9,
            TimeUnit::Milliseconds | TimeUnit::Ticks => (now_ns / 1_000_000 % turn) as f64,
            TimeUnit::Microseconds => (now_ns / 1_000 % turn) as f64,
        }
    }
}

impl Emulator for DelimitedEmulator {
    fn push(&mut self, now_ns: u64, bytes: &[u8]) {
        let start = self.settings.start.as_bytes();
        if start.is_empty() || self.faults.is_frozen() {
            return;
        }
        self.heard.extend_from_slice(bytes);
        let excess = self.heard.len().saturating_sub(start.len());
        let is_started = self
            .heard
            .windows(start.len())
            .any(|window| window == start);
        self.heard.drain(..excess);
        if is_started && self.beat.next_ns().is_none() {
            self.beat.start(now_ns);
        }
    }

    fn poll(&mut self, now_ns: u64) -> Vec<u8> {
        if !self.is_up {
            self.is_up = true;
            let text = self.boot_text.clone().into_bytes();
            self.say(text);
        }
        while let Some(due_ns) = self.beat.due(now_ns) {
            let line = self.line(due_ns);
            self.say(line.into_bytes());
        }
        std::mem::take(&mut self.output)
    }

    fn deadline(&self) -> Option<u64> {
        if self.output.is_empty() && self.is_up {
            self.beat.next_ns()
        } else {
            Some(0)
        }
    }
}
