//! Streams of messages that are encoded already.
//!
//! tonic copies every message into a buffer of its own for every subscriber. Here the bytes that the publisher made go to the
//! connection as they are, shared by all.

use std::pin::Pin;
use std::task::{Context, Poll, ready};

use axum::body::Body;
use axum::http::{HeaderMap, HeaderValue, Request, Response, header};
use bytes::Bytes;
use futures_core::Stream;
use http_body::Frame;
use prost::Message;
use tonic::codec::{BufferSettings, Streaming};
use tonic::{Code, Status};
use tonic_prost::ProstCodec;

use crate::wire_message::WireMessage;

use super::Answers;

/// What a gRPC answer is.
const GRPC: HeaderValue = HeaderValue::from_static("application/grpc");

/// Reads one request and answers with the stream that `watch` makes of it.
pub(crate) async fn answer<R, S>(
    request: Request<Body>,
    watch: impl FnOnce(R) -> Result<S, Status>,
) -> Response<Body>
where
    R: Message + Default + 'static,
    S: Stream<Item = Result<WireMessage, Status>> + Send + 'static,
{
    match read(request).await.and_then(watch) {
        Ok(messages) => {
            let body = Body::new(EncodedBody {
                messages: Some(Box::pin(messages)),
            });
            let mut response = Response::new(body);
            response.headers_mut().insert(header::CONTENT_TYPE, GRPC);
            response
        }
        Err(status) => status.into_http(),
    }
}

async fn read<R: Message + Default + 'static>(request: Request<Body>) -> Result<R, Status> {
    let decoder = ProstCodec::<R, R>::raw_decoder(BufferSettings::default());
    let mut messages = Streaming::<R>::new_request(decoder, request.into_body(), None, None);
    let lacking = || Status::invalid_argument("the call has no request message");
    messages.message().await?.ok_or_else(lacking)
}

/// The messages, then the trailers that end a gRPC call.
struct EncodedBody {
    /// `None` after the last.
    messages: Option<Answers<WireMessage>>,
}

impl http_body::Body for EncodedBody {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        let Some(messages) = &mut self.messages else {
            return Poll::Ready(None);
        };
        let status = match ready!(messages.as_mut().poll_next(context)) {
            Some(Ok(message)) => return Poll::Ready(Some(Ok(Frame::data(message.into_wire())))),
            Some(Err(status)) => status,
            None => Status::new(Code::Ok, ""),
        };
        self.messages = None;
        let mut trailers = HeaderMap::new();
        Poll::Ready(Some(
            status
                .add_header(&mut trailers)
                .map(|()| Frame::trailers(trailers)),
        ))
    }

    fn is_end_stream(&self) -> bool {
        self.messages.is_none()
    }
}
