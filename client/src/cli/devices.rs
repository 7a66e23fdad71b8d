use anyhow::Result;
use console::{Style, Term};
use serde_json::{Value, json};
use tsukamu_client::connect::Client;
use tsukamu_client::view::Stamp;
use tsukamu_proto::v1::{
    Device, DeviceClock, DeviceWarning, HandStream, ListDevicesRequest, ListDevicesResponse,
    WatchDevicesRequest,
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
        let n_warnings = answer.devices.iter().map(|device| device.warnings.len());
        n_lines = answer.devices.len() + n_warnings.sum::<usize>() + 1;
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
        "NAME", "KIND", "PLACE", "STATE", "RATE", "JITTER", "GAP", "AGE", "CLOCK", "SAMPLES",
        "DROPPED", "RESYNCS", "BYTES", "HAND",
    ];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    rows.extend(answer.devices.iter().map(row));
    let mut lines = table(&rows).into_iter();
    lines
        .next()
        .map_or(Ok(()), |header| output::line(&header))?;
    for (device, line) in answer.devices.iter().zip(lines) {
        output::line(&line)?;
        for warning in &device.warnings {
            let text = printable(&format!("{}: {}", warning.code, warning.text));
            output::line(&format!("  {}", Style::new().yellow().apply_to(text)))?;
        }
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
        rates(device),
        span(device.jitter_s),
        span(device.longest_gap_s),
        if device.age_s < 0.0 {
            "never".into()
        } else {
            span(device.age_s)
        },
        device.clock.as_ref().map_or_else(|| "-".into(), clock),
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

/// The rate, and beside it the one that it should be: `62 of 100 Hz`.
fn rates(device: &Device) -> String {
    let rounded = |hz: f64| rate((hz * 10.0).round() / 10.0);
    let is_known = device.expected_rate_hz > 0.0;
    let expected = is_known.then(|| format!(" of {}", rounded(device.expected_rate_hz)));
    format!(
        "{}{} Hz",
        rounded(device.rate_hz),
        expected.unwrap_or_default()
    )
}

/// How samples get their times, how far these may be off, and how fast the device's clock is: `counter ±0.3 ms +42 ppm`.
fn clock(clock: &DeviceClock) -> String {
    let error = clock.error_s.map(|error_s| format!(" ±{}", span(error_s)));
    let drift = clock
        .drift_ppm
        .map(|drift_ppm| format!(" {drift_ppm:+.0} ppm"));
    let (error, drift) = (error.unwrap_or_default(), drift.unwrap_or_default());
    format!("{}{error}{drift}", printable(&clock.kind))
}

fn device_json(device: &Device) -> Value {
    json!({
        "name": device.name, "kind": device.kind, "place": device.place, "state": device.state,
        "error": (!device.error.is_empty()).then_some(&device.error), "rate_hz": device.rate_hz,
        "longest_gap_s": device.longest_gap_s, "age_s": (device.age_s >= 0.0).then_some(device.age_s),
        "samples": device.samples, "dropped": device.dropped, "superseded": device.superseded, "resyncs": device.resyncs, "bytes": device.bytes,
        "reconnects": device.reconnects, "hand_id": device.hand.checked_sub(1), "filter_lag_s": device.filter_lag_s,
        "expected_rate_hz": (device.expected_rate_hz > 0.0).then_some(device.expected_rate_hz), "jitter_s": device.jitter_s,
        "gap_bounds_s": device.gap_bounds_s, "gap_counts": device.gap_counts, "resyncs_per_s": device.resyncs_per_s,
        "out_of_range_share": device.out_of_range_share, "losses": device.losses,
        "warnings": device.warnings.iter().map(warning_json).collect::<Value>(),
        "clock": device.clock.as_ref().map(clock_json),
        "wrist": device.wrist.as_ref().map(stream_json), "fingers": device.fingers.as_ref().map(stream_json),
    })
}

fn warning_json(warning: &DeviceWarning) -> Value {
    json!({"code": warning.code, "text": warning.text})
}

fn clock_json(clock: &DeviceClock) -> Value {
    json!({
        "kind": clock.kind, "drift_ppm": clock.drift_ppm, "error_s": clock.error_s, "tick_s": clock.tick_s,
        "restarts": clock.restarts,
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
