use anyhow::Result;
use serde_json::json;
use tsukamu_client::connect::Client;
use tsukamu_proto::v1::{
    ListRecordingsRequest, PlayRecordingRequest, StartRecordingRequest, StopRecordingRequest,
};

use super::args::{PlayArgs, RecordCommand};
use super::format::{count, printable, size, span, table};
use super::{control, output, refusal};

pub(crate) async fn record(client: &Client, command: RecordCommand, as_json: bool) -> Result<()> {
    match command {
        RecordCommand::Start { name, frames, raw } => {
            let request = StartRecordingRequest {
                name: name.unwrap_or_default(),
                frames,
                raw,
            };
            start(client, request, as_json).await
        }
        RecordCommand::Stop => stop(client, as_json).await,
        RecordCommand::List => list(client, as_json).await,
    }
}

async fn start(client: &Client, request: StartRecordingRequest, as_json: bool) -> Result<()> {
    let answer = client
        .recordings()
        .start_recording(request)
        .await
        .map_err(|status| refusal(&status))?
        .into_inner();
    if as_json {
        output::json(&json!({"name": answer.name}))?;
    } else {
        output::line(&format!(
            "recording to {}; finish with `tsukamu record stop`",
            printable(&answer.name)
        ))?;
    }
    Ok(())
}

async fn stop(client: &Client, as_json: bool) -> Result<()> {
    let answer = client
        .recordings()
        .stop_recording(StopRecordingRequest {})
        .await;
    let answer = answer.map_err(|status| refusal(&status))?.into_inner();
    if as_json {
        output::json(&json!({
            "name": answer.name, "bytes": answer.bytes, "messages": answer.messages, "dropped": answer.dropped,
        }))?;
        return Ok(());
    }
    let dropped = match answer.dropped {
        0 => String::new(),
        n => format!("; the disk was too slow for {}", count(n, "message")),
    };
    let (name, bytes) = (printable(&answer.name), size(answer.bytes));
    output::line(&format!(
        "{name} is finished: {bytes}, {}{dropped}",
        count(answer.messages, "message")
    ))?;
    Ok(())
}

async fn list(client: &Client, as_json: bool) -> Result<()> {
    let answer = client
        .recordings()
        .list_recordings(ListRecordingsRequest {})
        .await;
    let recordings = answer
        .map_err(|status| refusal(&status))?
        .into_inner()
        .recordings;
    if as_json {
        let recordings = recordings
            .iter()
            .map(|recording| json!({"name": recording.name, "bytes": recording.bytes, "modified_ns": recording.modified_ns}))
            .collect();
        output::json(&recordings)?;
        return Ok(());
    }
    if recordings.is_empty() {
        output::note("there are no recordings; begin one with `tsukamu record start`");
        return Ok(());
    }
    let now_ns = client.clock().now_ns();
    let mut rows = vec![["NAME", "SIZE", "LAST CHANGE"].map(str::to_owned).to_vec()];
    for recording in &recordings {
        let age_s = now_ns.saturating_sub(recording.modified_ns) as f64 * 1e-9;
        rows.push(vec![
            printable(&recording.name),
            size(recording.bytes),
            format!("{} ago", span(age_s)),
        ]);
    }
    for line in table(&rows) {
        output::line(&line)?;
    }
    Ok(())
}

pub(crate) async fn play(client: &Client, args: PlayArgs, as_json: bool) -> Result<()> {
    let name = file_name(args.name);
    let what = format!("{name} is being played");
    let answer = client
        .recordings()
        .play_recording(PlayRecordingRequest { name })
        .await;
    control::done(answer, &what, as_json)
}

/// The file's name, which ends as every recording's does.
fn file_name(name: String) -> String {
    if name.ends_with(".mcap") {
        name
    } else {
        format!("{name}.mcap")
    }
}
