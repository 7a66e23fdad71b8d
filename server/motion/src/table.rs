//! A CSV text as named columns and numbered rows.

use csv::{Position, ReaderBuilder, StringRecord, Trim};

use crate::mistake::{ImportError, MistakeKind, Mistakes, only, shown};

/// A whole CSV text.
#[derive(Debug)]
pub(crate) struct Table {
    header: StringRecord,
    /// The rows that have as many cells as the header.
    pub(crate) rows: Vec<Row>,
}

/// One row.
#[derive(Debug)]
pub(crate) struct Row {
    /// Line of the file, from 1.
    pub(crate) line: u64,
    cells: StringRecord,
}

/// A column that a reader needs.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub(crate) name: String,
    index: usize,
}

/// Cells that only make sense together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Group<const N: usize> {
    /// All are empty: not tracked.
    Absent,
    /// All are finite numbers.
    Values([f64; N]),
    /// A mistake was noted.
    Bad,
}

impl Table {
    /// Reads a text. Rows of the wrong length are noted and left out.
    pub(crate) fn read(text: &str, mistakes: &mut Mistakes) -> Result<Self, ImportError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut reader = ReaderBuilder::new()
            .flexible(true)
            .trim(Trim::All)
            .from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| syntax(&error))?.clone();
        if header.iter().all(str::is_empty) {
            return Err(only(1, None, MistakeKind::NoHeader));
        }
        let mut rows = Vec::new();
        for record in reader.into_records() {
            let cells = record.map_err(|error| syntax(&error))?;
            let line = cells
                .position()
                .map_or(1, |position| line_of(text, position));
            if cells.len() == header.len() {
                rows.push(Row { line, cells });
            } else {
                let kind = MistakeKind::Ragged {
                    expected: header.len(),
                    found: cells.len(),
                };
                mistakes.add(line, None, kind);
            }
        }
        Ok(Self { header, rows })
    }

    /// A column by name; if it is missing or not alone that is noted, and its cells read as empty.
    pub(crate) fn column(&self, name: &str, mistakes: &mut Mistakes) -> Column {
        let mut found = self
            .header
            .iter()
            .enumerate()
            .filter(|(_, n)| *n == name)
            .map(|(i, _)| i);
        let index = found.next();
        if index.is_none() {
            mistakes.add(1, Some(name), MistakeKind::MissingColumn);
        } else if found.next().is_some() {
            mistakes.add(1, Some(name), MistakeKind::DuplicateColumn);
        }
        Column {
            name: name.to_owned(),
            index: index.unwrap_or(usize::MAX),
        }
    }

    /// Whether there is a column of this name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.header.iter().any(|n| n == name)
    }
}

impl Row {
    /// The cell's text, trimmed.
    pub(crate) fn text(&self, column: &Column) -> &str {
        self.cells.get(column.index).unwrap_or("")
    }

    /// A finite number that must be there.
    pub(crate) fn number(&self, column: &Column, mistakes: &mut Mistakes) -> Option<f64> {
        if self.text(column).is_empty() {
            mistakes.add(self.line, Some(&column.name), MistakeKind::Empty);
            return None;
        }
        self.finite(column, mistakes)
    }

    /// A finite number, or `None` for an empty cell and for a mistake, which is noted.
    pub(crate) fn optional(&self, column: &Column, mistakes: &mut Mistakes) -> Option<f64> {
        if self.text(column).is_empty() {
            None
        } else {
            self.finite(column, mistakes)
        }
    }

    /// Cells that belong together.
    pub(crate) fn group<const N: usize>(
        &self,
        columns: &[Column; N],
        mistakes: &mut Mistakes,
    ) -> Group<N> {
        if columns.iter().all(|column| self.text(column).is_empty()) {
            return Group::Absent;
        }
        let mut values = [0.0; N];
        let mut whole = true;
        for (value, column) in values.iter_mut().zip(columns) {
            if self.text(column).is_empty() {
                mistakes.add(self.line, Some(&column.name), MistakeKind::PartlyEmpty);
                whole = false;
            } else if let Some(number) = self.finite(column, mistakes) {
                *value = number;
            } else {
                whole = false;
            }
        }
        if whole {
            Group::Values(values)
        } else {
            Group::Bad
        }
    }

    /// A word of a closed set.
    pub(crate) fn word<T: Copy>(
        &self,
        column: &Column,
        words: &[(&str, T)],
        allowed: &'static str,
        mistakes: &mut Mistakes,
    ) -> Option<T> {
        let text = self.text(column);
        let found = words
            .iter()
            .find(|(word, _)| *word == text)
            .map(|(_, value)| *value);
        if found.is_none() {
            let kind = MistakeKind::UnknownWord {
                found: shown(text),
                allowed,
            };
            mistakes.add(self.line, Some(&column.name), kind);
        }
        found
    }

    fn finite(&self, column: &Column, mistakes: &mut Mistakes) -> Option<f64> {
        let text = self.text(column);
        let kind = match text.parse::<f64>() {
            Ok(number) if number.is_finite() => return Some(number),
            Ok(_) => MistakeKind::NotFinite(shown(text)),
            Err(_) => MistakeKind::NotANumber(shown(text)),
        };
        mistakes.add(self.line, Some(&column.name), kind);
        None
    }
}

/// A record's line. The reader's position is where it began to look, before any empty lines.
fn line_of(text: &str, position: &Position) -> u64 {
    let start = usize::try_from(position.byte()).unwrap_or(usize::MAX);
    let rest = text.as_bytes().get(start..).unwrap_or_default();
    let breaks = rest.iter().take_while(|byte| matches!(byte, b'\r' | b'\n'));
    position.line() + breaks.filter(|byte| **byte == b'\n').count() as u64
}

fn syntax(error: &csv::Error) -> ImportError {
    let line = error.position().map_or(1, Position::line);
    only(line, None, MistakeKind::Syntax(error.to_string()))
}
