use anyhow::Result;
use serde_json::json;
use tsukamu_client::clock_sync::{ClockSync, PingSample};
use tsukamu_client::connect::Client;
use tsukamu_client::view::Stamp;
use tsukamu_proto::v1::{GetStatusResponse, PingRequest};

use super::args::PingArgs;
use super::format::{count, printable, rate, span, span_ns};
use super::{json, output, refusal};

pub(crate) async fn status(client: &Client, as_json: bool) -> Result<()> {
    let status = client.status().await?;
    if as_json {
        output::json(&status_json(&status))?;
        return Ok(());
    }
    for line in status_lines(&status, client.address()) {
        output::line(&line)?;
    }
    Ok(())
}

fn status_json(status: &GetStatusResponse) -> serde_json::Value {
    let mut value = json::stamp(status.stamp.as_ref().map(Stamp::from).unwrap_or_default());
    let rest = json!({
        "version": status.version, "protocol_major": status.protocol_major, "protocol_minor": status.protocol_minor,
        "scene": status.scene, "model": status.model, "mode": status.mode, "paused": status.paused,
        "rate_hz": status.rate_hz, "measured_rate_hz": status.measured_rate_hz, "overruns": status.overruns,
        "step_time_p50_s": status.step_time_p50_s, "step_time_p99_s": status.step_time_p99_s,
        "n_objects": status.n_objects, "n_hands": status.n_hands,
        "n_frame_subscribers": status.n_frame_subscribers, "n_event_subscribers": status.n_event_subscribers,
        "recording": (!status.recording.is_empty()).then_some(&status.recording), "uptime_s": status.uptime_s,
    });
    if let (Some(all), serde_json::Value::Object(rest)) = (value.as_object_mut(), rest) {
        all.extend(rest);
    }
    value
}

fn status_lines(status: &GetStatusResponse, address: &str) -> Vec<String> {
    let stamp = status.stamp.as_ref().map(Stamp::from).unwrap_or_default();
    let clock = match status.mode.as_str() {
        "lockstep" => format!(
            "lockstep, {} steps per second of world time",
            rate(status.rate_hz)
        ),
        mode => format!(
            "{} at {} Hz, measured {:.1} Hz, {}{}",
            printable(mode),
            rate(status.rate_hz),
            status.measured_rate_hz,
            count(status.overruns, "overrun"),
            if status.paused { ", paused" } else { "" }
        ),
    };
    let recording = if status.recording.is_empty() {
        "none".into()
    } else {
        printable(&status.recording)
    };
    vec![
        format!(
            "daemon      tsukamud {} at {address}, up {}",
            printable(&status.version),
            span(status.uptime_s)
        ),
        format!(
            "protocol    {}.{}",
            status.protocol_major, status.protocol_minor
        ),
        format!(
            "scene       {} ({}), {}, {}",
            printable(&status.scene),
            printable(&status.model),
            count(status.n_objects.into(), "object"),
            count(status.n_hands.into(), "hand")
        ),
        format!("clock       {clock}"),
        format!(
            "world       {:.3} s, tick {}, epoch {}",
            stamp.world_time_s, stamp.tick, stamp.epoch
        ),
        format!(
            "step time   {} median, {} p99",
            span(status.step_time_p50_s),
            span(status.step_time_p99_s)
        ),
        format!(
            "watched by  {}, {}",
            count(status.n_frame_subscribers.into(), "frame subscriber"),
            count(status.n_event_subscribers.into(), "event subscriber")
        ),
        format!("recording   {recording}"),
    ]
}

pub(crate) async fn ping(client: &Client, args: &PingArgs, as_json: bool) -> Result<()> {
    let mut sync = ClockSync::new(args.count as usize);
    let mut round_trips = Vec::new();
    for _ in 0..args.count {
        let sample = exchange(client).await.map_err(|status| refusal(&status))?;
        if sync.push(sample).is_ok() {
            round_trips.push(sample.round_trip_ns());
        }
    }
    round_trips.sort_unstable();
    let Some(estimate) = sync.estimate() else {
        anyhow::bail!("a clock was set during every exchange");
    };
    let at = |share: f64| round_trips[((round_trips.len() - 1) as f64 * share).round() as usize];
    let (median, worst) = (at(0.5), at(1.0));
    if as_json {
        output::json(&json!({
            "n": round_trips.len(), "round_trip_min_ns": estimate.round_trip_ns, "round_trip_p50_ns": median,
            "round_trip_max_ns": worst, "offset_ns": estimate.offset_ns, "offset_error_ns": estimate.error_ns,
        }))?;
        return Ok(());
    }
    output::line(&format!(
        "round trip  {} least, {} median, {} most ({})",
        span_ns(estimate.round_trip_ns as f64),
        span_ns(median as f64),
        span_ns(worst as f64),
        count(round_trips.len() as u64, "exchange")
    ))?;
    let (offset, error) = (
        span_ns(estimate.offset_ns as f64),
        span_ns(estimate.error_ns as f64),
    );
    output::line(&format!(
        "its clock   {offset} ahead of ours, within {error}"
    ))?;
    Ok(())
}

/// One exchange of times with the daemon.
pub(crate) async fn exchange(client: &Client) -> Result<PingSample, tonic::Status> {
    let t0_ns = client.clock().now_ns();
    let answer = client
        .daemon_clock()
        .ping(PingRequest { client_ns: t0_ns })
        .await?
        .into_inner();
    let t3_ns = client.clock().now_ns();
    Ok(PingSample {
        t0_ns,
        t1_ns: answer.received_ns,
        t2_ns: answer.sent_ns,
        t3_ns,
    })
}
