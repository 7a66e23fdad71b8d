//! One direction of a TCP connection: a cookie, then messages.

use super::cookie::{COOKIE_LENGTH, Cookie};
use super::message::{MAX_LENGTH, Message, MessageFault};

/// What comes out of the bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Item<'a> {
    /// The first thing: who is there.
    Cookie(Cookie),
    /// Everything after.
    Message(Message<'a>),
}

/// Bytes that were not taken yet; at most one unfinished message and what was pushed since.
#[derive(Debug, Default)]
pub struct Inbound {
    bytes: Vec<u8>,
    /// Bytes at the front that are done with.
    start: usize,
    is_greeted: bool,
}

impl Inbound {
    /// Most bytes that may be pushed at once; more has to be pushed in parts, with everything taken in between.
    pub const MAX_PUSH: usize = 16 * 1024;
    /// Most bytes that are kept.
    pub const CAPACITY: usize = MAX_LENGTH + 8 + Self::MAX_PUSH;

    /// Appends bytes; those beyond [`Inbound::CAPACITY`] are lost, which cannot happen when all is taken between pushes.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.start);
        self.start = 0;
        let room = Self::CAPACITY - self.bytes.len();
        self.bytes
            .extend_from_slice(&bytes[..bytes.len().min(room)]);
    }

    /// The next thing that is whole.
    ///
    /// # Errors
    /// When the bytes are no message; nothing more comes out then.
    pub fn next_item(&mut self) -> Result<Option<Item<'_>>, MessageFault> {
        let rest = &self.bytes[self.start..];
        if !self.is_greeted {
            let Some(cookie) = rest.first_chunk::<COOKIE_LENGTH>() else {
                return Ok(None);
            };
            let cookie = Cookie::judge(cookie);
            self.start += COOKIE_LENGTH;
            self.is_greeted = true;
            return Ok(Some(Item::Cookie(cookie)));
        }
        let Some((message, n_taken)) = Message::decode(rest, false)? else {
            return Ok(None);
        };
        self.start += n_taken;
        Ok(Some(Item::Message(message)))
    }

    /// The bytes that were not taken, for an error message.
    #[must_use]
    pub fn rest(&self) -> &[u8] {
        &self.bytes[self.start..]
    }

    /// Whether the cookie has come.
    #[must_use]
    pub const fn is_greeted(&self) -> bool {
        self.is_greeted
    }
}
