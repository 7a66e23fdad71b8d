//! What is wrong in a text, and where.

use std::fmt;
use std::ops::Range;

/// One mistake in a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// The file's name, the flag or the variable that holds the mistake.
    pub origin: String,
    /// Line and column, both from 1, columns in characters; `None` where the origin has no lines (a flag, a folder).
    pub place: Option<(usize, usize)>,
    /// The key, with its path (`object[1].size`); empty for the text as a whole.
    pub key: String,
    /// What is wrong and what is allowed.
    pub message: String,
}

/// Every mistake of one or several texts; never empty when it is an error.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mistakes(pub Vec<Mistake>);

/// Mistakes of one text that are kept, at most: a text that is all wrong is looked through all the same, once.
const MISTAKES_MAX: usize = 1000;

/// One text under reading, and the mistakes found in it so far.
#[derive(Debug)]
pub struct Sheet<'t> {
    origin: String,
    text: &'t str,
    /// The mistakes so far, in the order of their finding.
    mistakes: Vec<Mistake>,
}

impl<'t> Sheet<'t> {
    /// An empty list for this text; `origin` is the file's name as the user gave it.
    pub fn new(origin: impl Into<String>, text: &'t str) -> Self {
        Self {
            origin: origin.into(),
            text,
            mistakes: Vec::new(),
        }
    }

    /// The text.
    pub const fn text(&self) -> &'t str {
        self.text
    }

    /// Adds a mistake at this span of the text (byte offsets).
    pub fn fault(
        &mut self,
        span: &Range<usize>,
        key: impl Into<String>,
        message: impl Into<String>,
    ) {
        if self.mistakes.len() >= MISTAKES_MAX {
            return;
        }
        let place = Some(place_of(self.text, span.start));
        self.mistakes.push(Mistake {
            origin: self.origin.clone(),
            place,
            key: key.into(),
            message: message.into(),
        });
    }

    /// Adds a mistake that belongs to another origin than this text, such as a flag.
    pub fn fault_elsewhere(&mut self, mistake: Mistake) {
        self.mistakes.push(mistake);
    }

    /// Whether nothing is wrong so far.
    pub const fn is_clean(&self) -> bool {
        self.mistakes.is_empty()
    }

    /// The mistakes, in the order of the text.
    pub fn into_mistakes(mut self) -> Mistakes {
        self.mistakes.sort_by_key(|mistake| mistake.place);
        Mistakes(self.mistakes)
    }
}

impl Mistakes {
    /// One mistake about a whole file or flag.
    pub fn one(origin: impl Into<String>, message: impl Into<String>) -> Self {
        Self(vec![Mistake {
            origin: origin.into(),
            place: None,
            key: String::new(),
            message: message.into(),
        }])
    }

    /// `Ok` with the value when there is no mistake.
    ///
    /// # Errors
    /// The mistakes, if there are any.
    pub fn or_value<T>(self, value: T) -> Result<T, Self> {
        if self.0.is_empty() {
            Ok(value)
        } else {
            Err(self)
        }
    }
}

impl std::error::Error for Mistakes {}

impl fmt::Display for Mistakes {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, mistake) in self.0.iter().enumerate() {
            if index > 0 {
                writeln!(out)?;
            }
            write!(out, "{mistake}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}", self.origin)?;
        if let Some((line, column)) = self.place {
            write!(out, ":{line}:{column}")?;
        }
        if self.key.is_empty() {
            write!(out, ": {}", self.message)
        } else {
            write!(out, ": {}: {}", self.key, self.message)
        }
    }
}

/// Line and column of a byte offset, both from 1.
fn place_of(text: &str, offset: usize) -> (usize, usize) {
    let mut end = offset.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let before = &text[..end];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (
        before.matches('\n').count() + 1,
        before[line_start..].chars().count() + 1,
    )
}

#[cfg(test)]
mod tests {
    use super::place_of;

    #[test]
    fn places_count_characters_from_one() {
        let text = "a = 1\nname = \"手\" # x\n";
        for (offset, place) in [
            (0, (1, 1)),
            (4, (1, 5)),
            (6, (2, 1)),
            (13, (2, 8)),
            (18, (2, 11)),
            (999, (3, 1)),
        ] {
            assert_eq!(place_of(text, offset), place, "offset {offset}");
        }
    }
}
