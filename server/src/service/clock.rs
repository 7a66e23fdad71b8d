//! The daemon's clock.

use tonic::{Request, Response, Status};
use tsukamu_proto::v1;
use tsukamu_proto::v1::clock_server::Clock;

use super::Backend;

/// The service.
#[derive(Clone, Debug)]
pub struct ClockService(pub Backend);

#[tonic::async_trait]
impl Clock for ClockService {
    async fn ping(
        &self,
        request: Request<v1::PingRequest>,
    ) -> Result<Response<v1::PingResponse>, Status> {
        let received_ns = self.0.clock.wall_ns();
        let stamp = Some(self.0.status.stamp());
        let client_ns = request.into_inner().client_ns;
        Ok(Response::new(v1::PingResponse {
            stamp,
            client_ns,
            received_ns,
            sent_ns: self.0.clock.wall_ns(),
        }))
    }
}
