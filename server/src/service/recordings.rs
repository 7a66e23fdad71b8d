//! Recordings.

use tonic::{Request, Response, Status};
use tsukamu_proto::v1;
use tsukamu_proto::v1::recordings_server::Recordings;

use crate::recorder_handle::RecordOptions;
use crate::ticker::request::{Beginning, Request as Ask};

use super::{Backend, off_thread, to_its_end};

/// The service.
#[derive(Clone, Debug)]
pub struct RecordingsService(pub Backend);

type Answer<T> = Result<Response<T>, Status>;

#[tonic::async_trait]
impl Recordings for RecordingsService {
    async fn start_recording(
        &self,
        request: Request<v1::StartRecordingRequest>,
    ) -> Answer<v1::StartRecordingResponse> {
        let v1::StartRecordingRequest { name, frames, raw } = request.into_inner();
        let (desk, ticker) = (self.0.recordings.clone(), self.0.ticker.clone());
        let options = RecordOptions { frames, raw };
        let (stamp, name) = to_its_end(async move {
            desk.start(&ticker, name, options, Beginning::AsItStands)
                .await
        })
        .await??;
        Ok(Response::new(v1::StartRecordingResponse {
            stamp: Some(stamp),
            name,
        }))
    }

    async fn stop_recording(
        &self,
        _: Request<v1::StopRecordingRequest>,
    ) -> Answer<v1::StopRecordingResponse> {
        let (desk, ticker) = (self.0.recordings.clone(), self.0.ticker.clone());
        let (stamp, name, written) = to_its_end(async move { desk.stop(&ticker).await }).await??;
        Ok(Response::new(v1::StopRecordingResponse {
            stamp: Some(stamp),
            name,
            bytes: written.bytes,
            messages: written.messages,
            dropped: written.dropped,
        }))
    }

    async fn list_recordings(
        &self,
        _: Request<v1::ListRecordingsRequest>,
    ) -> Answer<v1::ListRecordingsResponse> {
        let desk = self.0.recordings.clone();
        let recordings = off_thread(move || desk.list()).await??;
        Ok(Response::new(v1::ListRecordingsResponse {
            stamp: Some(self.0.status.stamp()),
            recordings,
        }))
    }

    async fn play_recording(
        &self,
        request: Request<v1::PlayRecordingRequest>,
    ) -> Answer<v1::CommandResponse> {
        let desk = self.0.recordings.clone();
        let name = request.into_inner().name;
        let plan = Box::new(off_thread(move || desk.playback(&name)).await??);
        let stamp = self.0.ticker.ask(|reply| Ask::Load { plan, reply }).await?;
        Ok(Response::new(v1::CommandResponse { stamp: Some(stamp) }))
    }
}
