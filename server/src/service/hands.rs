//! Driving hands.

use tonic::{Request, Response, Status, Streaming};
use tsukamu_proto::v1;
use tsukamu_proto::v1::hands_server::Hands;

use crate::input::remote::{RemoteContext, drive};

use super::{Answers, Backend};

/// The service.
#[derive(Clone, Debug)]
pub struct HandsService(pub Backend);

#[tonic::async_trait]
impl Hands for HandsService {
    type DriveStream = Answers<v1::DriveResponse>;

    async fn drive(
        &self,
        request: Request<Streaming<v1::DriveRequest>>,
    ) -> Result<Response<Self::DriveStream>, Status> {
        let address = request
            .extensions()
            .get::<axum::extract::ConnectInfo<std::net::SocketAddr>>();
        let place = address.map_or_else(String::new, |info| info.0.to_string());
        let backend = &self.0;
        let context = RemoteContext {
            ticker: backend.ticker.clone(),
            sources: backend.sources.clone(),
            status: backend.status.clone(),
            clock: backend.clock,
            stopping: backend.stopping.clone(),
        };
        Ok(Response::new(Box::pin(drive(
            context,
            request.into_inner(),
            place,
        ))))
    }
}
