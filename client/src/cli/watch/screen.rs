use console::{measure_text_width, style};
use tsukamu_client::view::WorldView;

use super::super::events;
use super::super::format::{count, pad, printable, rate, span, span_ns};
use super::meter::sparkline;
use super::model::WatchModel;
use super::{picture, tables};

/// Columns that the tables need.
const TABLE_WIDTH: usize = 80;
/// Between tables and picture.
const GAP: usize = 2;
/// The picture stands beside the tables where it gets this many columns, else under them.
const PICTURE_MIN_WIDTH: usize = 32;
/// Larger would only be emptier: 200 by 160 dots.
const PICTURE_MAX_WIDTH: usize = 100;
const PICTURE_MAX_HEIGHT: usize = 40;
/// Fewer lines of picture than this show nothing.
const PICTURE_MIN_HEIGHT: usize = 9;
/// Lines of events that are kept free where there is room for more than the objects.
const EVENT_LINES: usize = 8;
/// Lines that hands may take.
const HAND_LINES: usize = 6;

/// The model as lines of a terminal of that size: never more lines, never wider.
pub(super) fn lines(
    model: &mut WatchModel,
    now_ns: u64,
    width: usize,
    height: usize,
) -> Vec<String> {
    let mut lines = vec![title(model, width)];
    lines.extend(measures(model, now_ns, width));
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
            " tsukamu   {} · {} · {} {} Hz{}",
            printable(&status.scene),
            printable(&status.model),
            printable(&status.mode),
            rate(status.rate_hz),
            if status.paused { " · PAUSED" } else { "" }
        ),
        None => " tsukamu".into(),
    };
    let right = match &model.status {
        Some(status) if !status.recording.is_empty() => format!(
            "● recording {}   {} ",
            printable(&status.recording),
            model.address
        ),
        _ => format!("{} ", model.address),
    };
    let room = width.saturating_sub(measure_text_width(&right));
    style(format!("{}{right}", pad(&left, room)))
        .reverse()
        .to_string()
}

/// The daemon's steps, and the way of its frames to us.
fn measures(model: &mut WatchModel, now_ns: u64, width: usize) -> Vec<String> {
    if let Some(reason) = &model.lost {
        let words = format!("connection lost ({}); trying again", printable(reason));
        return vec![style(words).red().bold().to_string(), String::new()];
    }
    let stamp = model.view().map(|view| view.stamp).unwrap_or_default();
    let mut steps = vec![
        format!("world {:.2} s", stamp.world_time_s),
        format!("tick {}", stamp.tick),
        format!("epoch {}", stamp.epoch),
    ];
    if let Some(status) = &model.status {
        steps.extend([
            format!("{:.1} steps/s", status.measured_rate_hz),
            count(status.overruns, "overrun"),
            format!(
                "step {} p50 · {} p99",
                span(status.step_time_p50_s),
                span(status.step_time_p99_s)
            ),
            format!("up {}", span(status.uptime_s)),
        ]);
    }
    let mut lines = flow(&steps, width);
    lines.extend(flow(&way(model, now_ns), width));
    lines
}

/// Rate, latency and losses of the frames.
fn way(model: &mut WatchModel, now_ns: u64) -> Vec<String> {
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
    vec![
        format!("{:.1} frames/s", model.meter.rate_hz(now_ns)),
        skipped,
        latency,
        style(sparkline(model.meter.history())).cyan().to_string(),
        format!("jitter {}", span_ns(model.jitter_ns())),
        clock,
    ]
}

/// Words three spaces apart, in as many lines as they need.
fn flow(words: &[String], width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words.iter().filter(|word| !word.is_empty()) {
        match lines.last_mut() {
            Some(line) if measure_text_width(line) + 3 + measure_text_width(word) <= width => {
                line.push_str("   ");
                line.push_str(word);
            }
            _ => lines.push(word.clone()),
        }
    }
    lines
}

fn body(model: &mut WatchModel, view: &WorldView, width: usize, height: usize) -> Vec<String> {
    let mut lines = tables::hands(model, view);
    lines.truncate(HAND_LINES);
    lines.push(String::new());
    let n_left = height.saturating_sub(lines.len());
    let n_events = EVENT_LINES.min(n_left / 2);
    lines.extend(tables::objects(
        model,
        view,
        n_left.saturating_sub(n_events + 1),
    ));
    lines.push(String::new());
    let n_spare = height.saturating_sub(lines.len() + n_events);
    match width
        .checked_sub(TABLE_WIDTH + GAP)
        .filter(|beside| *beside >= PICTURE_MIN_WIDTH)
    {
        Some(beside) => {
            let size = (
                beside.min(PICTURE_MAX_WIDTH),
                (lines.len() + n_spare).min(PICTURE_MAX_HEIGHT),
            );
            lines = side_by_side(
                &lines,
                &picture::picture(&model.scene, view, &mut model.fit, size.0, size.1),
            );
        }
        // Under the tables, a picture takes what neither objects nor a handful of events need.
        None if n_spare > PICTURE_MIN_HEIGHT => {
            let size = (
                width.min(PICTURE_MAX_WIDTH),
                (n_spare - 1).min(PICTURE_MAX_HEIGHT),
            );
            lines.extend(picture::picture(
                &model.scene,
                view,
                &mut model.fit,
                size.0,
                size.1,
            ));
            lines.push(String::new());
        }
        None => {}
    }
    let n_left = height.saturating_sub(lines.len());
    lines.extend(event_lines(model, n_left));
    lines
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

fn side_by_side(left: &[String], right: &[String]) -> Vec<String> {
    let row = |lines: &[String], row: usize| lines.get(row).cloned().unwrap_or_default();
    let rows = 0..left.len().max(right.len());
    rows.map(|n| {
        format!(
            "{}{}{}",
            pad(&row(left, n), TABLE_WIDTH),
            " ".repeat(GAP),
            row(right, n)
        )
    })
    .collect()
}

#[cfg(test)]
#[path = "screen_tests.rs"]
mod tests;
