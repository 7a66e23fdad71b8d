//! Tables for people: columns as wide as their widest cell.

use std::fmt;

/// Which way the cells of a column lean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lean {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// A table of text.
#[derive(Clone, Debug)]
pub(super) struct Table {
    columns: Vec<(&'static str, Lean)>,
    rows: Vec<Vec<String>>,
}

/// What stands where there is no value.
pub(super) const NONE: &str = "-";
/// Between two columns.
const GAP: &str = "  ";

impl Table {
    /// A table without rows.
    pub(super) fn new(columns: &[(&'static str, Lean)]) -> Self {
        Self {
            columns: columns.to_vec(),
            rows: Vec::new(),
        }
    }

    /// Adds a row: a cell per column.
    pub(super) fn add(&mut self, row: Vec<String>) {
        debug_assert_eq!(row.len(), self.columns.len(), "a cell per column");
        self.rows.push(row);
    }
}

/// A number with so many decimals, or the sign for none.
pub(super) fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| NONE.to_owned(), |value| format!("{value:.decimals$}"))
}

/// A whole number with its digits in groups of three.
pub(super) fn grouped(value: f64) -> String {
    let digits = format!("{:.0}", value.abs());
    let mut text = String::with_capacity(digits.len() * 2);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    if value < 0.0 {
        format!("-{text}")
    } else {
        text
    }
}

impl fmt::Display for Table {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = |index: usize| {
            let cells = self.rows.iter().map(|row| row[index].chars().count());
            cells
                .chain([self.columns[index].0.chars().count()])
                .max()
                .unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let header: Vec<String> = self
            .columns
            .iter()
            .map(|(name, _)| (*name).to_owned())
            .collect();
        for row in [&header].into_iter().chain(&self.rows) {
            let mut line = String::new();
            for ((cell, width), (_, lean)) in row.iter().zip(&widths).zip(&self.columns) {
                match lean {
                    Lean::Left => line.push_str(&format!("{cell:<width$}")),
                    Lean::Right => line.push_str(&format!("{cell:>width$}")),
                }
                line.push_str(GAP);
            }
            writeln!(out, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let mut table = Table::new(&[("run", Lean::Left), ("ms", Lean::Right)]);
        table.add(vec!["ball".to_owned(), number(Some(-3.25), 1)]);
        table.add(vec!["a".to_owned(), number(None, 1)]);
        assert_eq!(table.to_string(), "run     ms\nball  -3.2\na        -\n");
    }

    #[test]
    fn digits_are_grouped() {
        let cases = [
            (7.0, "7"),
            (999.4, "999"),
            (50_000.0, "50 000"),
            (-1_234_567.0, "-1 234 567"),
        ];
        for (value, expected) in cases {
            assert_eq!(grouped(value), expected);
        }
    }
}
