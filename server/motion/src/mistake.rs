//! What is wrong with a motion file: every mistake by line and column, up to a limit, at once.

use std::fmt;

use thiserror::Error;

/// A motion file that was refused, with its mistakes in the order of the file.
#[derive(Clone, Debug, PartialEq, Error)]
pub struct ImportError {
    /// The first mistakes, at most [`N_MISTAKES_SHOWN`]; never empty.
    pub mistakes: Vec<Mistake>,
    /// How many more there are.
    pub n_more: usize,
}

/// One mistake.
#[derive(Clone, Debug, PartialEq)]
pub struct Mistake {
    /// Line of the file, from 1; 0 for an option that came with it.
    pub line: u64,
    /// The column's name, where one is to blame.
    pub column: Option<String>,
    /// What is wrong.
    pub kind: MistakeKind,
}

/// What can be wrong with a motion file.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MistakeKind {
    /// The file has no text.
    #[error("the file is empty")]
    NoHeader,
    /// The file has a header but no row with a tracked hand.
    #[error("no row has a tracked hand")]
    NoRows,
    /// A column that must be there is not.
    #[error("the column is missing")]
    MissingColumn,
    /// So many columns are not there that another kind of file is likely.
    #[error("{n} columns are missing, the first of them {}", .first.join(", "))]
    MissingColumns {
        /// How many.
        n: usize,
        /// The first of them, as many as are named.
        first: Vec<String>,
    },
    /// A needed column is there twice.
    #[error("the column is there more than once")]
    DuplicateColumn,
    /// A row with more or fewer cells than the header.
    #[error("the row has {found} cells, the header has {expected}")]
    Ragged {
        /// Cells of the header.
        expected: usize,
        /// Cells of the row.
        found: usize,
    },
    /// A cell that must not be empty is.
    #[error("the cell is empty")]
    Empty,
    /// Some cells of a position or pose are empty and some are not.
    #[error("the cell is empty while others of the same position or pose are not")]
    PartlyEmpty,
    /// A cell that is no number.
    #[error("{0:?} is not a number")]
    NotANumber(String),
    /// A cell that is infinite or not a number.
    #[error("{0:?} is not finite")]
    NotFinite(String),
    /// A cell with a word that is not among the known ones.
    #[error("{found:?} is none of {allowed}")]
    UnknownWord {
        /// What the cell says.
        found: String,
        /// What it may say.
        allowed: &'static str,
    },
    /// A hand's time is not later than that of its row before.
    #[error("time {t_s} s is not after this hand's previous time {previous_s} s")]
    TimeNotAfter {
        /// The row's time, seconds.
        t_s: f64,
        /// The time before it, seconds.
        previous_s: f64,
    },
    /// A quaternion without length.
    #[error("the quaternion is zero")]
    ZeroQuaternion,
    /// Three axes that are no right-handed rotation.
    #[error("the axes are no rotation")]
    NotARotation,
    /// A number out of its bounds.
    #[error("{value} is out of bounds: it must be {bounds}")]
    OutOfBounds {
        /// What was given.
        value: f64,
        /// What is allowed.
        bounds: &'static str,
    },
    /// The text is not in the format at all.
    #[error("{0}")]
    Syntax(String),
}

/// How many mistakes an error carries.
pub const N_MISTAKES_SHOWN: usize = 20;
/// How many missing columns are named one by one; of more, only so many are.
const N_COLUMNS_NAMED: usize = 3;
/// How much of a cell an error repeats, characters.
const N_CHARS_SHOWN: usize = 40;

impl fmt::Display for ImportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, mistake) in self.mistakes.iter().enumerate() {
            write!(f, "{}{mistake}", if index == 0 { "" } else { "\n" })?;
        }
        if self.n_more > 0 {
            write!(f, "\nand {} more", self.n_more)?;
        }
        Ok(())
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.line, &self.column) {
            (0, Some(option)) => write!(f, "option {option}: {}", self.kind),
            (line, Some(column)) => write!(f, "line {line}, column {column}: {}", self.kind),
            (line, None) => write!(f, "line {line}: {}", self.kind),
        }
    }
}

/// Mistakes found so far.
#[derive(Debug, Default)]
pub(crate) struct Mistakes {
    list: Vec<Mistake>,
    n_more: usize,
    in_header: bool,
}

impl Mistakes {
    /// Notes a mistake; beyond the limit it is only counted.
    pub(crate) fn add(&mut self, line: u64, column: Option<&str>, kind: MistakeKind) {
        self.in_header |= line == 1;
        // Those of the header are few, and stand for all others.
        if line == 1 || self.list.len() < N_MISTAKES_SHOWN {
            self.list.push(Mistake {
                line,
                column: column.map(str::to_owned),
                kind,
            });
        } else {
            self.n_more += 1;
        }
    }

    /// The error of the header's mistakes (line 1), if it has some: without columns no row can be read, so that those of
    /// the rows say nothing.
    pub(crate) fn check_header(&mut self) -> Result<(), ImportError> {
        if !self.in_header {
            return Ok(());
        }
        self.list.retain(|mistake| mistake.line == 1);
        self.n_more = 0;
        self.sum_up_missing_columns();
        if self.list.len() > N_MISTAKES_SHOWN {
            self.n_more = self.list.len() - N_MISTAKES_SHOWN;
            self.list.truncate(N_MISTAKES_SHOWN);
        }
        self.check()
    }

    /// Makes one mistake of many missing columns, in the place of the first.
    fn sum_up_missing_columns(&mut self) {
        let is_missing = |mistake: &Mistake| mistake.kind == MistakeKind::MissingColumn;
        let missing = self.list.iter().filter(|mistake| is_missing(mistake));
        let names: Vec<String> = missing
            .filter_map(|mistake| mistake.column.clone())
            .collect();
        if names.len() <= N_COLUMNS_NAMED {
            return;
        }
        self.list.retain(|mistake| !is_missing(mistake));
        let first = names.iter().take(N_COLUMNS_NAMED).cloned().collect();
        let kind = MistakeKind::MissingColumns {
            n: names.len(),
            first,
        };
        self.list.insert(
            0,
            Mistake {
                line: 1,
                column: None,
                kind,
            },
        );
    }

    /// The error of all mistakes so far, if there are any.
    pub(crate) fn check(&mut self) -> Result<(), ImportError> {
        if self.list.is_empty() {
            return Ok(());
        }
        self.list.sort_by_key(|mistake| mistake.line);
        Err(ImportError {
            mistakes: std::mem::take(&mut self.list),
            n_more: std::mem::take(&mut self.n_more),
        })
    }
}

/// The error of one mistake.
pub(crate) fn only(line: u64, column: Option<&str>, kind: MistakeKind) -> ImportError {
    ImportError {
        mistakes: vec![Mistake {
            line,
            column: column.map(str::to_owned),
            kind,
        }],
        n_more: 0,
    }
}

/// A cell's text, cut to what an error repeats.
pub(crate) fn shown(cell: &str) -> String {
    cell.chars().take(N_CHARS_SHOWN).collect()
}
