use console::style;
use tsukamu_client::view::WorldView;

use super::super::events;
use super::super::format::{count, pad, printable, rate, span, span_ns};
use super::meter::sparkline;
use super::model::WatchModel;
use super::{picture, tables};

/// Columns that the tables need.
const TABLE_WIDTH: usize = 88;
/// The picture stands beside the tables where it gets this many columns.
const PICTURE_MIN_WIDTH: usize = 32;
/// Lines of events that are kept free where there is room for more than the objects.
const EVENT_LINES: usize = 7;
/// Lines that hands may take.
const HAND_LINES: usize = 6;
/// Lines of a picture that stands under the tables.
const PICTURE_MIN_HEIGHT: usize = 10;

/// The model as lines of a terminal of that size: never more lines, never wider.
pub(super) fn lines(
    model: &mut WatchModel,
    now_ns: u64,
    width: usize,
    height: usize,
) -> Vec<String> {
    let mut lines = vec![title(model, width)];
    lines.extend(measures(model, now_ns));
    lines.push(String::new());
    let n_left = height.saturating_sub(lines.len());
    match model.view().cloned() {
        Some(view) => lines.extend(body(model, &view, width, n_left)),
        None => lines.push(style("waiting for the first frame").dim().to_string()),
    }
    lines.truncate(height);
    lines
        .iter()
        .map(|line| console::truncate_str(line, width, "…").into_owned())
        .collect()
}

fn title(model: &WatchModel, width: usize) -> String {
    let left = match &model.status {
        Some(status) => format!(
            " 掴む tsukamu   {} · {} · {} {} Hz{}",
            printable(&status.scene),
            printable(&status.model),
            printable(&status.mode),
            rate(status.rate_hz),
            if status.paused { " · PAUSED" } else { "" }
        ),
        None => " 掴む tsukamu".into(),
    };
    let right = match &model.status {
        Some(status) if !status.recording.is_empty() => format!(
            "● recording {}   {} ",
            printable(&status.recording),
            model.address
        ),
        _ => format!("{} ", model.address),
    };
    let room = width.saturating_sub(console::measure_text_width(&right));
    style(format!("{}{right}", pad(&left, room)))
        .reverse()
        .to_string()
}

/// Two lines: the daemon's steps, and the way of its frames to us.
fn measures(model: &mut WatchModel, now_ns: u64) -> Vec<String> {
    if let Some(reason) = &model.lost {
        let words = format!("connection lost ({}); trying again", printable(reason));
        return vec![style(words).red().bold().to_string(), String::new()];
    }
    let stamp = model.view().map(|view| view.stamp).unwrap_or_default();
    let mut steps = format!(
        "world {:.2} s   tick {}   epoch {}",
        stamp.world_time_s, stamp.tick, stamp.epoch
    );
    if let Some(status) = &model.status {
        steps += &format!(
            "   {:.1} steps/s   {}   step {} p50 · {} p99   up {}",
            status.measured_rate_hz,
            count(status.overruns, "overrun"),
            span(status.step_time_p50_s),
            span(status.step_time_p99_s),
            span(status.uptime_s)
        );
    }
    let latency = match model.meter.latency_ns(now_ns) {
        Some((median, worst)) => format!("latency {} · {} worst", span_ns(median), span_ns(worst)),
        None => "latency ?".into(),
    };
    let clock = match model.clock() {
        Some(clock) => format!(
            "clock {} ± {}",
            span_ns(clock.offset_ns as f64),
            span_ns(clock.error_ns as f64)
        ),
        None => "clock ?".into(),
    };
    let skipped = format!("{} skipped", model.counts.skipped);
    let skipped = if model.counts.skipped > 0 {
        style(skipped).yellow().to_string()
    } else {
        skipped
    };
    let frames = format!(
        "{:.1} frames/s   {latency}   jitter {}   {clock}   {skipped}   {}",
        model.meter.rate_hz(now_ns),
        span_ns(model.jitter_ns()),
        style(sparkline(model.meter.history())).cyan()
    );
    vec![steps, frames]
}

fn body(model: &mut WatchModel, view: &WorldView, width: usize, height: usize) -> Vec<String> {
    let beside = width
        .checked_sub(TABLE_WIDTH + 2)
        .filter(|width| *width >= PICTURE_MIN_WIDTH);
    let mut lines = tables::hands(model, view);
    lines.truncate(HAND_LINES);
    lines.push(String::new());
    let n_left = height.saturating_sub(lines.len());
    let n_events = EVENT_LINES.min(n_left / 2);
    let object_lines = tables::objects(model, view, n_left.saturating_sub(n_events + 1));
    lines.extend(object_lines);
    lines.push(String::new());
    // Under the tables, a picture takes what neither objects nor a handful of events need.
    let n_spare = height.saturating_sub(lines.len() + n_events);
    let below = (beside.is_none() && n_spare > PICTURE_MIN_HEIGHT).then(|| n_spare - 1);
    if let Some(picture_height) = below {
        lines.extend(picture::picture(
            &model.scene,
            view,
            &mut model.fit,
            width.min(100),
            picture_height,
        ));
        lines.push(String::new());
    }
    let n_left = height.saturating_sub(lines.len());
    lines.extend(event_lines(model, n_left));
    match beside {
        Some(picture_width) => side_by_side(model, view, lines, (picture_width, height)),
        None => lines,
    }
}

fn event_lines(model: &WatchModel, n_lines: usize) -> Vec<String> {
    let mut lines = vec![style("EVENTS").bold().underlined().to_string()];
    lines.extend(
        model
            .last_events(n_lines.saturating_sub(1))
            .map(|event| events::line(event, model.names())),
    );
    lines.truncate(n_lines);
    lines
}

/// The tables on the left, the picture on the right of the upper lines, events across below it.
fn side_by_side(
    model: &mut WatchModel,
    view: &WorldView,
    left: Vec<String>,
    (width, height): (usize, usize),
) -> Vec<String> {
    let picture = picture::picture(&model.scene, view, &mut model.fit, width, height);
    let mut lines = Vec::with_capacity(height);
    for row in 0..height.max(left.len()) {
        let words = pad(left.get(row).map_or("", String::as_str), TABLE_WIDTH);
        let drawing = picture.get(row).map_or("", String::as_str);
        lines.push(format!("{words}  {drawing}"));
    }
    lines
}

#[cfg(test)]
#[path = "screen_tests.rs"]
mod tests;
