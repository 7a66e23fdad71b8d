//! What the user gives: recordings, hands, rates.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::Context;
use tsukamu_motion::synthetic::names;
use tsukamu_world::scene::{RATE_HZ_MAX, RATE_HZ_MIN};

use super::Failure;

/// Refuses a file that is no MCAP file at all. Of one that is cut off or damaged something can be read, of another nothing.
pub(super) fn ensure_recording(path: &Path) -> Result<(), Failure> {
    let mut start = Vec::new();
    File::open(path)
        .and_then(|file| file.take(mcap::MAGIC.len() as u64).read_to_end(&mut start))
        .with_context(|| path.display().to_string())?;
    if start == mcap::MAGIC {
        Ok(())
    } else {
        let what = if start.is_empty() {
            "is empty"
        } else {
            "is no MCAP file"
        };
        Err(anyhow::anyhow!("{}: {what}, so no recording", path.display()).into())
    }
}

/// What is wrong with a hand that is neither `synthetic:NAME` nor a file.
pub(super) fn missing_hand(text: &str) -> Option<String> {
    if text.starts_with("synthetic:") || Path::new(text).exists() {
        return None;
    }
    let known: Vec<&str> = names().iter().map(|known| known.name.text()).collect();
    let name = text.split(['?', ',']).next().unwrap_or_default();
    Some(if known.contains(&name) {
        format!("is no file; did you mean synthetic:{text}?")
    } else {
        let known = known.join(", ");
        format!("is no file, and no synthetic:NAME with a NAME of {known}")
    })
}

/// Steps per second.
pub(super) fn rate(text: &str) -> Result<f64, String> {
    let rate = text
        .parse()
        .ok()
        .filter(|rate| (RATE_HZ_MIN..=RATE_HZ_MAX).contains(rate));
    rate.ok_or_else(|| format!("it must be a number of hertz from {RATE_HZ_MIN} to {RATE_HZ_MAX}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_is_a_name_or_a_file() {
        let told = [
            ("synthetic:anything", None),
            ("Cargo.toml", None),
            ("stack?seed=3", Some("did you mean synthetic:stack?seed=3?")),
            ("walk.csv", Some("NAME of free,")),
        ];
        for (text, expected) in told {
            let told = missing_hand(text);
            assert_eq!(told.is_some(), expected.is_some(), "{text}: {told:?}");
            let told = told.unwrap_or_default();
            assert!(told.contains(expected.unwrap_or_default()), "{told}");
        }
    }

    #[test]
    fn another_file_is_no_recording() {
        let told = ensure_recording(Path::new("Cargo.toml"));
        assert!(
            matches!(told, Err(Failure::Failed(fault)) if fault.to_string().contains("Cargo.toml: is no MCAP file"))
        );
    }

    #[test]
    fn rates_are_within_bounds() {
        for (text, expected) in [
            ("1", Some(1.0)),
            ("4000", Some(4000.0)),
            ("0", None),
            ("-5", None),
            ("nan", None),
        ] {
            assert_eq!(rate(text).ok(), expected, "{text}");
        }
    }
}
