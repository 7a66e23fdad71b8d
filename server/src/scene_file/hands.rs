//! How a scene, a setting or a flag names a source of hands.

use std::fmt;
use std::path::{Path, PathBuf};

/// Where a hand's motion comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HandSourceSpec {
    /// A computed hand: `synthetic:NAME`, with parameters as `synthetic:NAME,key=value,…`.
    Synthetic {
        /// Its name, e.g. `stack`.
        name: String,
        /// Its parameters, in the order given.
        params: Vec<(String, String)>,
    },
    /// A file of hand motion (hand CSV), absolute or relative to the working folder.
    Csv(PathBuf),
}

/// A text that names no source of hands.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HandSpecFault {
    /// Nothing is named.
    #[error("names no hand: give synthetic:NAME or a hand CSV file")]
    Empty,
    /// A parameter is not `key=value`.
    #[error("has the parameter {0:?}: parameters are key=value, separated by commas")]
    Parameter(String),
}

impl HandSourceSpec {
    /// Reads `synthetic:NAME[,key=value…]` or a file's name; a relative file is looked for in `folder`.
    ///
    /// # Errors
    /// When the text is empty, or a parameter has no `=`.
    pub fn parse(text: &str, folder: &Path) -> Result<Self, HandSpecFault> {
        let Some(synthetic) = text.strip_prefix("synthetic:") else {
            return if text.trim().is_empty() {
                Err(HandSpecFault::Empty)
            } else {
                Ok(Self::Csv(folder.join(text)))
            };
        };
        let mut parts = synthetic.split(',');
        let name = parts.next().unwrap_or_default().trim().to_owned();
        if name.is_empty() {
            return Err(HandSpecFault::Empty);
        }
        let pair = |part: &str| match part.split_once('=') {
            Some((key, value)) => Ok((key.trim().to_owned(), value.trim().to_owned())),
            None => Err(HandSpecFault::Parameter(part.to_owned())),
        };
        Ok(Self::Synthetic {
            name,
            params: parts.map(pair).collect::<Result<_, _>>()?,
        })
    }
}

impl fmt::Display for HandSourceSpec {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Synthetic { name, params } => {
                write!(out, "synthetic:{name}")?;
                params
                    .iter()
                    .try_for_each(|(key, value)| write!(out, ",{key}={value}"))
            }
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
            "synthetic:free,object=cube,seed=3",
            "folder/hand.csv",
        ] {
            assert_eq!(
                HandSourceSpec::parse(text, Path::new(""))
                    .map(|spec| spec.to_string())
                    .as_deref(),
                Ok(text)
            );
        }
        let inside = HandSourceSpec::parse("hand.csv", Path::new("scenes"));
        assert_eq!(
            inside,
            Ok(HandSourceSpec::Csv(PathBuf::from("scenes/hand.csv")))
        );
        for (text, fault) in [
            ("", HandSpecFault::Empty),
            ("synthetic:", HandSpecFault::Empty),
            (
                "synthetic:free,seed",
                HandSpecFault::Parameter("seed".to_owned()),
            ),
        ] {
            assert_eq!(HandSourceSpec::parse(text, Path::new("")), Err(fault));
        }
    }
}
