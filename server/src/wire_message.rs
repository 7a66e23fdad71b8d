//! A message as it goes over the wire: encoded once, shared by everyone who gets it.

use bytes::{BufMut, Bytes, BytesMut};
use prost::Message;

/// Bytes before each message of a gRPC stream: whether it is compressed, and its length, big-endian.
pub const PREFIX_BYTES: usize = 5;

/// An encoded message with gRPC's prefix before it. Cheap to clone.
#[derive(Clone, Debug)]
pub struct WireMessage(Bytes);

impl WireMessage {
    /// Encodes a message.
    pub fn new(message: &impl Message) -> Self {
        let encoded = message.encode_to_vec();
        Self::build(&mut BytesMut::new(), encoded.len(), |buffer| {
            buffer.put_slice(&encoded);
        })
    }

    /// A message of `length` bytes that `write` puts into `buffer`, which is empty before and after and keeps its memory
    /// when it can.
    pub fn build(buffer: &mut BytesMut, length: usize, write: impl FnOnce(&mut BytesMut)) -> Self {
        buffer.reserve(PREFIX_BYTES + length);
        buffer.put_u8(0);
        // No message comes near 4 GiB: a frame has some 50 bytes per object.
        buffer.put_u32(length as u32);
        write(buffer);
        debug_assert_eq!(buffer.len(), PREFIX_BYTES + length, "the length was told");
        Self(buffer.split().freeze())
    }

    /// The message without the prefix.
    pub fn message(&self) -> Bytes {
        self.0.slice(PREFIX_BYTES..)
    }

    /// Length of the message without the prefix, bytes.
    pub const fn message_len(&self) -> usize {
        self.0.len() - PREFIX_BYTES
    }

    /// What goes over the wire.
    pub fn into_wire(self) -> Bytes {
        self.0
    }
}
