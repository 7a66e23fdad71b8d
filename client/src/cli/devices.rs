use anyhow::Result;
use console::{Style, Term};
use serde_json::{Value, json};
use tsukamu_client::connect::Client;
use tsukamu_client::view::Stamp;
use tsukamu_proto::v1::{
    Device, HandStream, ListDevicesRequest, ListDevicesResponse, WatchDevicesRequest,
};

use super::args::DevicesArgs;
use super::format::{printable, rate, size, span, table};
use super::{json, output, refusal};

pub(crate) async fn devices(client: &Client, args: &DevicesArgs, as_json: bool) -> Result<()> {
    if !args.watch {
        let answer = client.devices().list_devices(ListDevicesRequest {}).await;
        let answer = answer.map_err(|status| refusal(&status))?.into_inner();
        return show(&answer, as_json);
    }
    let stream = client.devices().watch_devices(WatchDevicesRequest {}).await;
    let mut stream = stream.map_err(|status| refusal(&status))?.into_inner();
    let terminal = Term::stdout();
    let in_place = terminal.is_term() && !as_json;
    let mut n_lines = 0;
    while let Some(answer) = stream.message().await.map_err(|status| refusal(&status))? {
        if in_place && n_lines > 0 {
            terminal.clear_last_lines(n_lines)?;
        }
        show(&answer, as_json)?;
        n_lines = answer.devices.len() + 1;
    }
    output::note("the daemon has ended the stream");
    Ok(())
}

fn show(answer: &ListDevicesResponse, as_json: bool) -> Result<()> {
    if as_json {
        let mut value = json::stamp(answer.stamp.as_ref().map(Stamp::from).unwrap_or_default());
        value["devices"] = answer.devices.iter().map(device_json).collect();
        output::json(&value)?;
        return Ok(());
    }
    if answer.devices.is_empty() {
        output::line(
            "no devices and no other sources: name a port in the daemon's settings, or `tsukamu send` a hand",
        )?;
        return Ok(());
    }
    let header = [
        "NAME", "KIND", "PLACE", "STATE", "RATE", "GAP", "AGE", "SAMPLES", "DROPPED", "RESYNCS",
        "BYTES", "HAND",
    ];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    rows.extend(answer.devices.iter().map(row));
    for line in table(&rows) {
        output::line(&line)?;
    }
    Ok(())
}

fn row(device: &Device) -> Vec<String> {
    let style = match device.state.as_str() {
        "running" => Style::new().green(),
        "stalled" | "absent" => Style::new().red(),
        "ended" => Style::new().dim(),
        _ => Style::new().yellow(),
    };
    let mut state = style.apply_to(printable(&device.state)).to_string();
    if !device.error.is_empty() {
        state += &format!(" ({})", printable(&device.error));
    }
    vec![
        printable(&device.name),
        printable(&device.kind),
        printable(&device.place),
        state,
        format!("{} Hz", rate((device.rate_hz * 10.0).round() / 10.0)),
        span(device.longest_gap_s),
        if device.age_s < 0.0 {
            "never".into()
        } else {
            span(device.age_s)
        },
        device.samples.to_string(),
        device.dropped.to_string(),
        device.resyncs.to_string(),
        size(device.bytes),
        device
            .hand
            .checked_sub(1)
            .map_or_else(|| "-".into(), |hand| hand.to_string()),
    ]
}

fn device_json(device: &Device) -> Value {
    json!({
        "name": device.name, "kind": device.kind, "place": device.place, "state": device.state,
        "error": (!device.error.is_empty()).then_some(&device.error), "rate_hz": device.rate_hz,
        "longest_gap_s": device.longest_gap_s, "age_s": (device.age_s >= 0.0).then_some(device.age_s),
        "samples": device.samples, "dropped": device.dropped, "superseded": device.superseded, "resyncs": device.resyncs, "bytes": device.bytes,
        "reconnects": device.reconnects, "hand_id": device.hand.checked_sub(1), "filter_lag_s": device.filter_lag_s,
        "wrist": device.wrist.as_ref().map(stream_json), "fingers": device.fingers.as_ref().map(stream_json),
    })
}

fn stream_json(stream: &HandStream) -> Value {
    json!({
        "delay_s": stream.delay_s, "lag_s": stream.lag_s, "filter_lag_s": stream.filter_lag_s, "lead_s": stream.lead_s,
        "age_s": (stream.age_s >= 0.0).then_some(stream.age_s),
        "position_error_m": stream.position_error_m, "angle_error_rad": stream.angle_error_rad,
        "unpredicted_position_error_m": stream.unpredicted_position_error_m,
        "unpredicted_angle_error_rad": stream.unpredicted_angle_error_rad,
    })
}
