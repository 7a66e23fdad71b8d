//! The records of a Fastrak that are not data: status and errors. All are ASCII, begin with `2` and end with LF.

use crate::tracker::fastrak::protocol::{
    CONTROL, FLAG_BINARY, FLAG_CENTIMETRES, FLAG_CONTINUOUS, MAX_CONTROL, N_STATIONS,
};

/// The answer to `S`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct StatusRecord {
    /// The flag digits.
    pub flags: u16,
    /// Result of the built-in test; empty when it found nothing.
    pub test_code: String,
    /// Firmware version.
    pub firmware: String,
    /// Configuration text.
    pub identity: String,
}

impl StatusRecord {
    /// Whether output is binary.
    #[must_use]
    pub const fn binary(&self) -> bool {
        self.flags & FLAG_BINARY != 0
    }

    /// Whether lengths are in centimetres.
    #[must_use]
    pub const fn centimetres(&self) -> bool {
        self.flags & FLAG_CENTIMETRES != 0
    }

    /// Whether records come by themselves.
    #[must_use]
    pub const fn continuous(&self) -> bool {
        self.flags & FLAG_CONTINUOUS != 0
    }
}

/// A record that is not data.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ControlRecord {
    /// The answer to `S`.
    Status(StatusRecord),
    /// A command was refused; the text names it and gives the code.
    Refusal(String),
    /// An answer that this driver does not ask for.
    Other,
}

/// What stands at the front of some bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Front {
    /// A control record of so many bytes.
    Whole(usize, ControlRecord),
    /// The beginning of one.
    Part,
    /// Something else.
    Other,
}

/// Looks for a control record at the front of `bytes`.
pub(super) fn read_front(bytes: &[u8]) -> Front {
    let station = |byte: &u8| *byte == b' ' || (b'1'..b'1' + N_STATIONS as u8).contains(byte);
    let kind = |byte: &u8| *byte == b' ' || byte.is_ascii_alphabetic();
    if bytes.first().is_some_and(|byte| *byte != CONTROL)
        || !bytes.get(1).is_none_or(station)
        || !bytes.get(2).is_none_or(kind)
    {
        return Front::Other;
    }
    let window = &bytes[..bytes.len().min(MAX_CONTROL)];
    let text = |byte: &u8| matches!(byte, b' '..=b'~' | b'\r' | b'\n');
    match window.iter().position(|byte| *byte == b'\n' || !text(byte)) {
        Some(end) => parse_control(&window[..=end])
            .map_or(Front::Other, |control| Front::Whole(end + 1, control)),
        None if window.len() < MAX_CONTROL => Front::Part,
        None => Front::Other,
    }
}

/// Reads one line that begins with `2`, given with its CR LF; `None` when it is no control record.
#[must_use]
pub fn parse_control(line: &[u8]) -> Option<ControlRecord> {
    let text = std::str::from_utf8(line).ok()?;
    let body = text.strip_suffix('\n')?.trim_end_matches('\r');
    if body.len() < 3 || body.as_bytes()[0] != CONTROL || !text.is_ascii() {
        return None;
    }
    if body.contains("ERROR") {
        return Some(ControlRecord::Refusal(body[1..].trim().to_owned()));
    }
    Some(parse_status(body).map_or(ControlRecord::Other, ControlRecord::Status))
}

/// `2`, station, `S`, 3 hexadecimal flags, 3 characters of test code, and from the 15th the version and the text.
/// An InterSense unit's is one byte shorter, so nothing behind the test code is required.
fn parse_status(body: &str) -> Option<StatusRecord> {
    if body.as_bytes()[2] != b'S' || body.len() < 50 {
        return None;
    }
    Some(StatusRecord {
        flags: u16::from_str_radix(body.get(3..6)?, 16).ok()?,
        test_code: body.get(6..9)?.trim().to_owned(),
        firmware: body.get(15..21)?.trim().to_owned(),
        identity: body.get(21..)?.trim().to_owned(),
    })
}
