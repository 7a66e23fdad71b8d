//! The answer to "who are you?": text that begins with `0`, whose length and wording differ from model to model.

use crate::tracker::liberty::protocol::{MIN_WHO_LENGTH, Model};

/// Longest identity that is passed on.
const MAX_IDENTITY: usize = 160;

/// What the text tells.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Who {
    /// The model that it names.
    pub(super) model: Option<Model>,
    /// The first word that looks like a version.
    pub(super) firmware: String,
    /// The text on one line.
    pub(super) identity: String,
}

/// Reads the answer. Greetings and the rest of a stream before it are passed over: it begins at the first line that
/// begins with `0` and is followed by text alone.
pub(super) fn read_who(bytes: &[u8]) -> Option<Who> {
    // A maker's text may hold a sign beyond ASCII, such as ©.
    let is_text = |byte: &u8| matches!(byte, b'\t' | b'\r' | b'\n' | b' '..=b'~' | 0xA9 | 0xAE);
    let n_text = bytes.iter().rev().take_while(|byte| is_text(byte)).count();
    let text = &bytes[bytes.len() - n_text..];
    let begins = |at: &usize| {
        let before = text[..*at].iter().rev().find(|byte| **byte != b' ');
        text[*at] == b'0' && before.is_none_or(|byte| matches!(byte, b'\r' | b'\n'))
    };
    let start = (0..text.len()).find(begins)?;
    if text.len() - start < MIN_WHO_LENGTH {
        return None;
    }
    let text = String::from_utf8_lossy(&text[start..]);
    let words: Vec<&str> = text.split_whitespace().collect();
    let is_version = |word: &&&str| {
        let digits =
            |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
        word.contains('.') && word.split('.').all(digits)
    };
    let lower = text.to_ascii_lowercase();
    Some(Who {
        model: Model::ALL
            .into_iter()
            .find(|model| lower.contains(&model.family().to_ascii_lowercase())),
        firmware: words
            .iter()
            .find(is_version)
            .map_or_else(String::new, |word| (*word).to_owned()),
        identity: words.join(" ").chars().take(MAX_IDENTITY).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::{Model, read_who};

    #[test]
    fn a_greeting_and_a_broken_frame_are_passed_over() {
        let who = format!("0  Patriot tracker{:<100}\r\nVersion 1.2.3\r\n", "");
        let heard = [
            b"LY\x01C\x20\xFF",
            &b"Patriot Ready!\r\n"[..],
            who.as_bytes(),
        ]
        .concat();
        let found = read_who(&heard).unwrap();
        assert_eq!(found.model, Some(Model::Patriot));
        assert_eq!(found.firmware, "1.2.3");
        assert_eq!(found.identity, "0 Patriot tracker Version 1.2.3");
    }

    #[test]
    fn text_alone_is_no_answer() {
        assert_eq!(read_who(b""), None);
        assert_eq!(read_who(b"0 Liberty\r\n"), None);
        assert_eq!(read_who(&[b'1'; 200]), None);
        assert_eq!(read_who(&[b'0'; 200].map(|byte| byte | 0x80)), None);
    }
}
