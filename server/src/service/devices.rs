//! Gloves, trackers and other sources.

use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};
use tonic::{Request, Response, Status};
use tsukamu_proto::v1;
use tsukamu_proto::v1::devices_server::Devices;

use super::{Answers, Backend};

/// How often watchers hear of the devices when nothing changes.
const PERIOD: Duration = Duration::from_secs(1);

/// The service.
#[derive(Clone, Debug)]
pub struct DevicesService(pub Backend);

#[tonic::async_trait]
impl Devices for DevicesService {
    type WatchDevicesStream = Answers<v1::ListDevicesResponse>;

    async fn list_devices(
        &self,
        _: Request<v1::ListDevicesRequest>,
    ) -> Result<Response<v1::ListDevicesResponse>, Status> {
        Ok(Response::new(self.0.devices_now()))
    }

    async fn watch_devices(
        &self,
        _: Request<v1::WatchDevicesRequest>,
    ) -> Result<Response<Self::WatchDevicesStream>, Status> {
        let mut period = interval(PERIOD);
        period.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let start = (self.0.clone(), self.0.sources.changes(), period);
        let lists =
            futures_util::stream::unfold(start, |(mut backend, mut changes, mut period)| async {
                tokio::select! {
                    _ = period.tick() => {}
                    changed = changes.changed() => changed.ok()?,
                    _ = backend.stopping.wait_for(|stops| *stops) => return None,
                }
                let list = backend.devices_now();
                Some((Ok(list), (backend, changes, period)))
            });
        Ok(Response::new(Box::pin(lists)))
    }
}

impl Backend {
    /// All sources as they are now.
    pub fn devices_now(&self) -> v1::ListDevicesResponse {
        let devices = self.sources.devices(self.clock.monotonic_ns());
        v1::ListDevicesResponse {
            stamp: Some(self.status.stamp()),
            devices,
        }
    }
}
