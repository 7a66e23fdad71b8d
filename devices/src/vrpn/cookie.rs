//! The 24 bytes that each side sends first: which version it speaks.

/// Length of a cookie in bytes.
pub const COOKIE_LENGTH: usize = 24;
/// What this side sends: version 07.38, no logging asked for.
pub const COOKIE: [u8; COOKIE_LENGTH] = *b"vrpn: ver. 07.38  0\0\0\0\0\0";
/// The part that both sides must have in common.
const MAJOR: &[u8] = b"vrpn: ver. 07";

/// What the other side's cookie says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Cookie {
    /// The same version, or one that differs in its minor number only: both can talk.
    Fits {
        /// The other side's text, such as `vrpn: ver. 07.35`.
        version: String,
    },
    /// Another major version, or no VRPN at all: the connection is to be closed.
    Foreign {
        /// What it sent, as far as it is text.
        text: String,
    },
}

impl Cookie {
    /// Judges the other side's first bytes.
    #[must_use]
    pub fn judge(bytes: &[u8; COOKIE_LENGTH]) -> Self {
        // The digit behind the version asks for logging, which nobody here does.
        let version = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
        let text: String = String::from_utf8_lossy(version)
            .chars()
            .filter(|letter| !letter.is_control())
            .collect();
        if bytes.starts_with(MAJOR) {
            let end = text.find("  ").unwrap_or(text.len());
            Self::Fits {
                version: text[..end].to_owned(),
            }
        } else {
            Self::Foreign { text }
        }
    }
}
