use anyhow::{Context, Result};
use serde_json::json;
use tonic::Response;
use tsukamu_client::connect::Client;
use tsukamu_client::view::Stamp;
use tsukamu_proto::v1::{
    CommandResponse, LoadSceneRequest, PauseRequest, ResetRequest, ResumeRequest, StepRequest,
    load_scene_request,
};

use super::args::{LoadArgs, StepArgs};
use super::format::count;
use super::{json, output, refusal};

pub(crate) async fn step(client: &Client, args: &StepArgs, as_json: bool) -> Result<()> {
    let answer = client
        .control()
        .step(StepRequest { n: args.n })
        .await
        .map_err(|status| refusal(&status))?;
    let answer = answer.into_inner();
    let stamp = answer.stamp.as_ref().map(Stamp::from).unwrap_or_default();
    if as_json {
        let mut value = json::stamp(stamp);
        value["digest"] = json!(format!("{:016x}", answer.digest));
        output::json(&value)?;
    } else {
        let steps = count(args.n.into(), "step");
        output::line(&format!(
            "{steps} done: tick {}, {:.3} s, digest {:016x}",
            stamp.tick, stamp.world_time_s, answer.digest
        ))?;
    }
    Ok(())
}

pub(crate) async fn load(client: &Client, args: &LoadArgs, as_json: bool) -> Result<()> {
    let source = match args.file() {
        Some(path) => {
            let text = std::fs::read_to_string(&path)
                .with_context(|| format!("cannot read {}", path.display()))?;
            load_scene_request::Source::Toml(text)
        }
        None => load_scene_request::Source::Name(args.scene.clone()),
    };
    let request = LoadSceneRequest {
        source: Some(source),
        with_default_hands: !args.no_hands,
    };
    let answer = client.control().load_scene(request).await;
    done(answer, &format!("{} is loaded", args.scene), as_json)
}

pub(crate) async fn reset(client: &Client, as_json: bool) -> Result<()> {
    done(
        client.control().reset(ResetRequest {}).await,
        "the scene is back at its start",
        as_json,
    )
}

pub(crate) async fn pause(client: &Client, as_json: bool) -> Result<()> {
    done(
        client.control().pause(PauseRequest {}).await,
        "the world stands still",
        as_json,
    )
}

pub(crate) async fn resume(client: &Client, as_json: bool) -> Result<()> {
    done(
        client.control().resume(ResumeRequest {}).await,
        "the world runs",
        as_json,
    )
}

/// Says that a command was carried out, and when.
pub(crate) fn done(
    answer: Result<Response<CommandResponse>, tonic::Status>,
    what: &str,
    as_json: bool,
) -> Result<()> {
    let answer = answer.map_err(|status| refusal(&status))?.into_inner();
    let stamp = answer.stamp.as_ref().map(Stamp::from).unwrap_or_default();
    if as_json {
        output::json(&json::stamp(stamp))?;
    } else {
        output::line(&format!(
            "{what}: epoch {}, tick {}, {:.3} s",
            stamp.epoch, stamp.tick, stamp.world_time_s
        ))?;
    }
    Ok(())
}
