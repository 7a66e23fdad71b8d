use anyhow::Result;
use console::{Style, Term, measure_text_width};
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
        show(&answer, as_json)?;
        return Ok(());
    }
    let stream = client.devices().watch_devices(WatchDevicesRequest {}).await;
    let mut stream = stream.map_err(|status| refusal(&status))?.into_inner();
    let terminal = Term::stdout();
    let in_place = terminal.is_term() && !as_json;
    let mut shown: Vec<String> = Vec::new();
    while let Some(answer) = stream.message().await.map_err(|status| refusal(&status))? {
        if in_place {
            // A long line takes several of the terminal's.
            let width = usize::from(terminal.size().1).max(1);
            let rows = |line: &String| measure_text_width(line).div_ceil(width).max(1);
            terminal.clear_last_lines(shown.iter().map(rows).sum())?;
        }
        shown = show(&answer, as_json)?;
    }
    output::note("the daemon has ended the stream");
    Ok(())
}

/// Prints it and answers with its lines.
fn show(answer: &ListDevicesResponse, as_json: bool) -> Result<Vec<String>> {
    if as_json {
        let mut value = json::stamp(answer.stamp.as_ref().map(Stamp::from).unwrap_or_default());
        value["devices"] = answer.devices.iter().map(device_json).collect();
        output::json(&value)?;
        return Ok(Vec::new());
    }
    let lines = lines(answer);
    lines.iter().try_for_each(|line| output::line(line))?;
    Ok(lines)
}

/// A table; below each row what is wrong with the device.
fn lines(answer: &ListDevicesResponse) -> Vec<String> {
    if answer.devices.is_empty() {
        let words = "no devices and no other sources: name a port in the daemon's settings, or `tsukamu send` a hand";
        return vec![words.to_owned()];
    }
    let header = [
        "NAME", "KIND", "PLACE", "STATE", "RATE", "JITTER", "GAP", "AGE", "CLOCK", "SAMPLES",
        "DROPPED", "RESYNCS", "BYTES", "HAND",
    ];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    rows.extend(answer.devices.iter().map(row));
    let mut table = table(&rows).into_iter();
    let mut lines = Vec::from_iter(table.next());
    for (device, line) in answer.devices.iter().zip(table) {
        lines.push(line);
        let is_told = |warning: &DeviceWarning| warning.text.contains(&device.error);
        if !device.error.is_empty() && !device.warnings.iter().any(is_told) {
            let error = state_style(device).apply_to(printable(&device.error));
            lines.push(format!("  {error}"));
        }
        for warning in &device.warnings {
            let text = printable(&format!("{}: {}", warning.code, warning.text));
            lines.push(format!("  {}", Style::new().yellow().apply_to(text)));
        }
    }
    lines
}

fn state_style(device: &Device) -> Style {
    match device.state.as_str() {
        "running" => Style::new().green(),
        "stalled" | "absent" => Style::new().red(),
        "ended" => Style::new().dim(),
        _ => Style::new().yellow(),
    }
}

fn row(device: &Device) -> Vec<String> {
    let state = state_style(device).apply_to(printable(&device.state));
    vec![
        printable(&device.name),
        printable(&device.kind),
        printable(&device.place),
        state.to_string(),
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
