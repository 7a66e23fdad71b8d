//! One line of numbers.

use thiserror::Error;

use crate::glove::delimited::column::Column;
use crate::glove::delimited::settings::DelimitedSettings;
use crate::glove::sensor::GloveSensor;

/// What a line holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Raw values by wire slot.
    pub raw: [Option<f64>; GloveSensor::N_SLOTS],
    /// The value of the time column, in its own unit.
    pub time: Option<f64>,
}

/// Why a line holds no row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum LineFault {
    /// It is blank, a comment, or begins otherwise than a line of numbers does.
    #[error("no line of numbers")]
    Other,
    /// It has another number of columns.
    #[error("{found} columns in place of {expected}")]
    Columns {
        /// Columns found.
        found: usize,
        /// Columns expected.
        expected: usize,
    },
    /// A column that has to be a number is none.
    #[error("column {column} is no number")]
    Number {
        /// The column, from 1.
        column: usize,
    },
}

/// Reads a line, given without its end.
///
/// # Errors
/// A [`LineFault`] that says what the line is in place of a row.
pub fn read_line(line: &str, settings: &DelimitedSettings) -> Result<Row, LineFault> {
    let line = line.trim();
    let prefix = settings.prefix.trim();
    let is_comment = line.starts_with('#') || line.starts_with("//");
    if line.is_empty() || (is_comment && prefix.is_empty()) {
        return Err(LineFault::Other);
    }
    let text = line.strip_prefix(prefix).ok_or(LineFault::Other)?;
    let expected = settings.columns.len();
    let found = fields(text, &settings.separators).count();
    if found != expected {
        return Err(LineFault::Columns { found, expected });
    }
    let mut row = Row {
        raw: [None; GloveSensor::N_SLOTS],
        time: None,
    };
    let columns = settings.columns.iter().enumerate();
    for ((index, column), field) in columns.zip(fields(text, &settings.separators)) {
        if *column == Column::Skip {
            continue;
        }
        let value: Option<f64> = field.parse().ok();
        let value = value.filter(|value| value.is_finite());
        let value = value.ok_or(LineFault::Number { column: index + 1 })?;
        if *column == Column::Time {
            row.time = Some(value);
        }
        for sensor in column.sensors() {
            row.raw[sensor.slot()] = Some(value);
        }
    }
    Ok(row)
}

/// The columns of a line. A separator at its end, as a loop that prints them leaves it, parts nothing.
fn fields<'a>(text: &'a str, separators: &str) -> impl Iterator<Item = &'a str> {
    let is_blank = |letter: &char| letter.is_ascii_whitespace();
    let hard: Vec<char> = separators
        .chars()
        .filter(|letter| !is_blank(letter))
        .collect();
    let parts_at_blanks = separators.chars().any(|letter| is_blank(&letter));
    let text = text.trim();
    let text = text.strip_suffix(hard.as_slice()).unwrap_or(text);
    let parts: Vec<&str> = text.split(hard.as_slice()).collect();
    parts.into_iter().flat_map(move |part| {
        let part = part.trim();
        // Nothing between two separators is a column that is no number.
        let is_whole = !parts_at_blanks || part.is_empty();
        let whole = is_whole.then_some(part);
        let words = (!is_whole).then(|| part.split_ascii_whitespace());
        whole.into_iter().chain(words.into_iter().flatten())
    })
}
