//! How a scene, a setting or a flag names a source of hands.

use std::fmt;
use std::path::{Path, PathBuf};

use tsukamu_motion::synthetic::{Spec, SpecFault};

/// Where a hand's motion comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum HandSourceSpec {
    /// A computed hand: `synthetic:NAME`, with parameters as `synthetic:NAME?key=value&key=value`.
    Synthetic {
        /// The text as it was given.
        text: String,
        /// What it says.
        spec: Spec,
    },
    /// A file of hand motion (hand CSV), absolute or relative to the working folder.
    Csv(PathBuf),
}

/// A text that names no source of hands.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HandSpecFault {
    /// Nothing is named.
    #[error("names no hand: give synthetic:NAME or a hand CSV file")]
    Empty,
    /// No such computed hand, or not with these parameters.
    #[error(transparent)]
    Synthetic(#[from] SpecFault),
}

impl HandSourceSpec {
    /// Reads `synthetic:NAME[?key=value…]` or a file's name; a relative file is looked for in `folder`.
    ///
    /// # Errors
    /// When the text is empty, or names no computed hand.
    pub fn parse(text: &str, folder: &Path) -> Result<Self, HandSpecFault> {
        if text.starts_with("synthetic:") {
            return Ok(Self::Synthetic {
                text: text.to_owned(),
                spec: Spec::parse(text)?,
            });
        }
        if text.trim().is_empty() {
            Err(HandSpecFault::Empty)
        } else {
            Ok(Self::Csv(folder.join(text)))
        }
    }
}

impl fmt::Display for HandSourceSpec {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Synthetic { text, .. } => write!(out, "{text}"),
            Self::Csv(path) => write!(out, "{}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specs_read_and_write_themselves() {
        for text in [
            "synthetic:operations/stack",
            "synthetic:free?object=cube&seed=3",
            "folder/hand.csv",
        ] {
            let spec = HandSourceSpec::parse(text, Path::new(""));
            assert_eq!(spec.map(|spec| spec.to_string()).as_deref(), Ok(text));
        }
        let inside = HandSourceSpec::parse("hand.csv", Path::new("scenes"));
        assert_eq!(
            inside,
            Ok(HandSourceSpec::Csv(PathBuf::from("scenes/hand.csv")))
        );
        for (text, fault) in [
            ("", "names no hand"),
            ("synthetic:", "no synthetic hand is called"),
            ("synthetic:free?seed", "is no parameter"),
        ] {
            let found =
                HandSourceSpec::parse(text, Path::new("")).map_err(|fault| fault.to_string());
            assert!(
                found.as_ref().is_err_and(|found| found.contains(fault)),
                "{text}: {found:?}"
            );
        }
    }
}
