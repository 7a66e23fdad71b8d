//! Commands.

use std::path::Path;

use tonic::{Request, Response, Status};
use tsukamu_proto::v1;
use tsukamu_proto::v1::control_server::Control;
use tsukamu_proto::v1::load_scene_request::Source;
use tsukamu_world::input::Command;
use tsukamu_world::state::ObjectId;

use crate::convert::fault::status_text;
use crate::convert::scene::{added_object, model_from};
use crate::plan::{Cast, plan};
use crate::scene_file::{self, builtin};
use crate::ticker::request::{Plan, Request as Ask};

use super::{Backend, off_thread};

/// Longest text of a scene, bytes: as many objects as a scene may have, each with a line for every key.
const SCENE_BYTES_MAX: usize = 16 << 20;

/// The service.
#[derive(Clone, Debug)]
pub struct ControlService(pub Backend);

type Answer<T> = Result<Response<T>, Status>;

#[tonic::async_trait]
impl Control for ControlService {
    async fn step(&self, request: Request<v1::StepRequest>) -> Answer<v1::StepResponse> {
        let n = request.into_inner().n.max(1);
        let done = self.0.ticker.ask(|reply| Ask::Step { n, reply }).await?;
        Ok(Response::new(v1::StepResponse {
            stamp: Some(done.stamp),
            digest: done.digest,
        }))
    }

    async fn reset(&self, _: Request<v1::ResetRequest>) -> Answer<v1::CommandResponse> {
        self.command(Command::Reset).await
    }

    async fn pause(&self, _: Request<v1::PauseRequest>) -> Answer<v1::CommandResponse> {
        done(self.0.ticker.ask(Ask::Pause).await?)
    }

    async fn resume(&self, _: Request<v1::ResumeRequest>) -> Answer<v1::CommandResponse> {
        done(self.0.ticker.ask(Ask::Resume).await?)
    }

    async fn load_scene(
        &self,
        request: Request<v1::LoadSceneRequest>,
    ) -> Answer<v1::CommandResponse> {
        let is_realtime = self.0.status.now().mode == "realtime";
        let request = request.into_inner();
        let plan = Box::new(off_thread(move || requested_plan(&request, is_realtime)).await??);
        done(self.0.ticker.ask(|reply| Ask::Load { plan, reply }).await?)
    }

    async fn add_object(
        &self,
        request: Request<v1::AddObjectRequest>,
    ) -> Answer<v1::AddObjectResponse> {
        let request = request.into_inner();
        let spec = Box::new(off_thread(move || added_object(&request)).await??);
        let (stamp, id) = self
            .0
            .ticker
            .ask(|reply| Ask::AddObject { spec, reply })
            .await?;
        Ok(Response::new(v1::AddObjectResponse {
            stamp: Some(stamp),
            id: id.to_bits(),
        }))
    }

    async fn remove_object(
        &self,
        request: Request<v1::RemoveObjectRequest>,
    ) -> Answer<v1::CommandResponse> {
        self.command(Command::RemoveObject(ObjectId::from_bits(
            request.into_inner().id,
        )))
        .await
    }

    async fn release(&self, request: Request<v1::ReleaseRequest>) -> Answer<v1::CommandResponse> {
        self.command(Command::Release(ObjectId::from_bits(
            request.into_inner().id,
        )))
        .await
    }

    async fn set_model(
        &self,
        request: Request<v1::SetModelRequest>,
    ) -> Answer<v1::CommandResponse> {
        self.command(Command::SetModel(model_from(&request.into_inner().model)?))
            .await
    }
}

impl ControlService {
    async fn command(&self, command: Command) -> Answer<v1::CommandResponse> {
        done(
            self.0
                .ticker
                .ask(|reply| Ask::Command { command, reply })
                .await?,
        )
    }
}

fn done(stamp: v1::Stamp) -> Answer<v1::CommandResponse> {
    Ok(Response::new(v1::CommandResponse { stamp: Some(stamp) }))
}

/// What an epoch of the scene that is asked for begins with.
fn requested_plan(request: &v1::LoadSceneRequest, is_realtime: bool) -> Result<Plan, Status> {
    let loaded = match &request.source {
        Some(Source::Name(name)) if builtin::text(name).is_none() => {
            let names: Vec<&str> = builtin::names().collect();
            let names = names.join(", ");
            let text = format!("there is no scene of that name; there are {names}: {name:?}");
            return Err(Status::not_found(status_text(&text)));
        }
        Some(Source::Name(name)) => scene_file::load(name)?,
        Some(Source::Toml(text)) if text.len() > SCENE_BYTES_MAX => {
            return Err(Status::invalid_argument(format!(
                "the scene has {} bytes: at most {SCENE_BYTES_MAX}",
                text.len()
            )));
        }
        Some(Source::Toml(text)) => scene_file::parse("scene", text, Path::new(""))?,
        None => return Err(Status::invalid_argument("give a scene's name or its text")),
    };
    let own = Cast::Default {
        repeats: is_realtime,
    };
    Ok(plan(
        &loaded,
        if request.with_default_hands {
            own
        } else {
            Cast::Nobody
        },
    )?)
}
