//! One message: a header of 24 bytes, a body, padding to a multiple of 8.

use thiserror::Error;

/// Length of the header in bytes.
pub const HEADER_LENGTH: usize = 24;
/// Longest message that is read, header and body without padding, in bytes.
pub const MAX_LENGTH: usize = 64 * 1024;
/// Longest datagram, in bytes.
pub const MAX_DATAGRAM: usize = 1472;

/// Type ids below zero: messages of the connection itself.
pub mod system {
    /// The name of a sender; its id stands in the header's sender field.
    pub const SENDER_DESCRIPTION: i32 = -1;
    /// The name of a type; its id stands in the header's sender field.
    pub const TYPE_DESCRIPTION: i32 = -2;
    /// Where low-latency messages may go; the UDP port stands in the header's sender field.
    pub const UDP_DESCRIPTION: i32 = -3;
    /// A request to write a log; ignored here.
    pub const LOG_DESCRIPTION: i32 = -4;
    /// The end of a log file; ignored here.
    pub const DISCONNECT: i32 = -5;
}

/// When a message was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Time {
    /// Seconds since the Unix epoch.
    pub seconds: u32,
    /// And microseconds.
    pub microseconds: u32,
}

impl Time {
    /// From nanoseconds since the Unix epoch; what does not fit is cut off (in 2106).
    #[must_use]
    pub const fn from_unix_ns(unix_ns: u64) -> Self {
        Self {
            seconds: (unix_ns / 1_000_000_000) as u32,
            microseconds: (unix_ns % 1_000_000_000 / 1000) as u32,
        }
    }

    /// Microseconds since the Unix epoch; `None` when there are a million or more of them in the second.
    #[must_use]
    pub const fn unix_us(self) -> Option<u64> {
        if self.microseconds >= 1_000_000 {
            return None;
        }
        Some(self.seconds as u64 * 1_000_000 + self.microseconds as u64)
    }
}

/// The header without its length, which follows from the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Header {
    /// When it was made.
    pub time: Time,
    /// Who sends it, by the sending side's own number; in a description the number that is described.
    pub sender: i32,
    /// Which type it has, by the sending side's own number; below 0 one of [`system`].
    pub kind: i32,
    /// Counts messages; padding in old versions. Nobody reads it.
    pub sequence: u32,
}

/// A message with its body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Message<'a> {
    /// Its header.
    pub header: Header,
    /// Its body without padding.
    pub body: &'a [u8],
}

/// Why bytes are no message. There is nothing to find the next one by, so the connection has to be closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum MessageFault {
    /// The length is less than that of a header.
    #[error("a message claims {0} bytes, which is less than its header")]
    TooShort(u32),
    /// The length is beyond all reason.
    #[error("a message claims {0} bytes; the limit is 65536")]
    TooLong(u32),
    /// A system message that does not exist.
    #[error("a system message of the unknown type {0}")]
    UnknownSystemType(i32),
}

impl<'a> Message<'a> {
    /// The first message of `bytes` and how many bytes it takes, padding included; `None` while it is not whole.
    /// The padding may be missing at the very end when `is_last` (a datagram).
    ///
    /// # Errors
    /// As soon as the bytes cannot be the beginning of a message.
    pub fn decode(bytes: &'a [u8], is_last: bool) -> Result<Option<(Self, usize)>, MessageFault> {
        let Some(length) = u32_at(bytes, 0) else {
            return Ok(None);
        };
        let whole = length as usize;
        if whole < HEADER_LENGTH {
            return Err(MessageFault::TooShort(length));
        }
        if whole > MAX_LENGTH {
            return Err(MessageFault::TooLong(length));
        }
        let Some(kind) = u32_at(bytes, 16) else {
            return Ok(None);
        };
        let kind = kind.cast_signed();
        if kind < system::DISCONNECT {
            return Err(MessageFault::UnknownSystemType(kind));
        }
        let padded = padded(whole);
        let taken = if is_last {
            padded.min(bytes.len())
        } else {
            padded
        };
        if bytes.len() < taken || bytes.len() < whole {
            return Ok(None);
        }
        let word = |at| u32_at(bytes, at).unwrap_or_default();
        let header = Header {
            time: Time {
                seconds: word(4),
                microseconds: word(8),
            },
            sender: word(12).cast_signed(),
            kind,
            sequence: word(20),
        };
        let body = &bytes[HEADER_LENGTH..whole];
        Ok(Some((Self { header, body }, taken)))
    }

    /// Appends the bytes of the message, padded with zeros.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let start = begin(&self.header, out);
        out.extend_from_slice(self.body);
        end(start, out);
    }
}

/// Appends a message whose body `write` appends.
pub fn encode_with(header: &Header, out: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
    let start = begin(header, out);
    write(out);
    end(start, out);
}

/// Appends the header, with a length to be filled in; gives where it begins.
fn begin(header: &Header, out: &mut Vec<u8>) -> usize {
    let start = out.len();
    let words = [
        0,
        header.time.seconds,
        header.time.microseconds,
        header.sender.cast_unsigned(),
        header.kind.cast_unsigned(),
        header.sequence,
    ];
    for word in words {
        out.extend_from_slice(&word.to_be_bytes());
    }
    start
}

/// Fills in the length of the message that begins at `start`, and pads it.
fn end(start: usize, out: &mut Vec<u8>) {
    let length = out.len() - start;
    out[start..start + 4].copy_from_slice(&(length as u32).to_be_bytes());
    out.resize(start + padded(length), 0);
}

/// Splits encoded messages into datagrams of whole messages, each as long as it may be.
pub fn datagrams(messages: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = messages;
    std::iter::from_fn(move || {
        let mut end = 0;
        while let Some(length) = rest.get(end..).and_then(|next| u32_at(next, 0)) {
            let next = (end + padded(length as usize)).min(rest.len());
            if next == end || (end > 0 && next > MAX_DATAGRAM) {
                break;
            }
            end = next;
        }
        let (datagram, after) = rest.split_at(end);
        rest = after;
        (end > 0).then_some(datagram)
    })
}

/// A length rounded up to the multiple of 8 that it takes on the wire.
const fn padded(length: usize) -> usize {
    length.next_multiple_of(8)
}

pub(super) fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at + 4)?;
    Some(u32::from_be_bytes(word.try_into().ok()?))
}
