//! A codec that passes on what is encoded already, so that a frame is encoded once for all its subscribers.

use std::marker::PhantomData;

use bytes::{BufMut, Bytes};
use prost::Message;
use tonic::Status;
use tonic::codec::{BufferSettings, Codec, EncodeBuf, Encoder};
use tonic_prost::{ProstCodec, ProstDecoder};

/// Bytes out, messages in: what the server of `WatchFrames` uses.
///
/// The first type parameter is what the generated code names as the encoded type; only [`Bytes`] is there.
#[derive(Debug)]
pub struct EncodedCodec<T, U> {
    _types: PhantomData<fn() -> (T, U)>,
}

impl<T, U> Default for EncodedCodec<T, U> {
    fn default() -> Self {
        Self {
            _types: PhantomData,
        }
    }
}

/// Copies encoded messages to the stream.
#[derive(Clone, Copy, Debug, Default)]
pub struct EncodedEncoder;

impl<U: Message + Default + Send + 'static> Codec for EncodedCodec<Bytes, U> {
    type Encode = Bytes;
    type Decode = U;
    type Encoder = EncodedEncoder;
    type Decoder = ProstDecoder<U>;

    fn encoder(&mut self) -> Self::Encoder {
        EncodedEncoder
    }

    fn decoder(&mut self) -> Self::Decoder {
        ProstCodec::<U, U>::raw_decoder(BufferSettings::default())
    }
}

impl Encoder for EncodedEncoder {
    type Item = Bytes;
    type Error = Status;

    fn encode(&mut self, item: Bytes, buffer: &mut EncodeBuf<'_>) -> Result<(), Status> {
        buffer.reserve(item.len());
        buffer.put(item);
        Ok(())
    }
}
