use std::collections::BTreeMap;

use console::Style;
use tsukamu_proto::v1::WatchReadingsResponse;

use crate::cli::format::{pad, pad_left, printable};

/// Columns of one sensor: name, bar, angle, raw value and the spaces between.
const NAME_WIDTH: usize = 12;
const BAR_WIDTH: usize = 12;
const CELL_WIDTH: usize = NAME_WIDTH + BAR_WIDTH + 14;
/// Between two columns of sensors.
const GAP: usize = 2;
/// Lines above the sensors.
const HEAD_LINES: usize = 6;

/// What is on the terminal while a glove is calibrated.
#[derive(Clone, Debug, Default)]
pub(super) struct Picture {
    /// The first line.
    pub(super) title: String,
    /// What the wearer is to do.
    pub(super) words: String,
    /// How that goes.
    pub(super) state: String,
    /// How far it is, 0 to 1; nothing while it has not begun.
    pub(super) share: Option<f64>,
    /// Sensors that are not still.
    pub(super) moving: Vec<String>,
    sensors: Vec<Bar>,
    extremes: BTreeMap<String, (f64, f64)>,
}

/// One sensor as it is drawn.
#[derive(Clone, Debug, PartialEq)]
struct Bar {
    name: String,
    raw: f64,
    angle_deg: f64,
    clamped: bool,
    share: f64,
}

impl Picture {
    /// Takes the newest readings.
    pub(super) fn take(&mut self, readings: &WatchReadingsResponse) {
        let mut bars = Vec::with_capacity(readings.sensors.len());
        for sensor in readings
            .sensors
            .iter()
            .filter(|sensor| sensor.raw.is_finite())
        {
            let extremes = self.extremes.entry(sensor.sensor.clone());
            let (low, high) = extremes.or_insert((sensor.raw, sensor.raw));
            (*low, *high) = (low.min(sensor.raw), high.max(sensor.raw));
            let span = *high - *low;
            bars.push(Bar {
                name: printable(&sensor.sensor),
                raw: sensor.raw,
                angle_deg: sensor.angle_deg,
                clamped: sensor.clamped,
                share: if span > 0.0 {
                    (sensor.raw - *low) / span
                } else {
                    0.0
                },
            });
        }
        self.sensors = bars;
    }

    /// The lines of a terminal of that size.
    pub(super) fn lines(&self, width: usize, height: usize) -> Vec<String> {
        let mut lines = vec![Style::new().bold().apply_to(&self.title).to_string()];
        lines.extend(wrapped(&self.words, width));
        lines.resize(
            lines.len().clamp(HEAD_LINES - 3, HEAD_LINES - 2),
            String::new(),
        );
        lines.push(self.state_line(width));
        lines.push(String::new());
        let room = height.saturating_sub(lines.len()).max(1);
        let fitting = ((width + GAP) / (CELL_WIDTH + GAP)).max(1);
        let n_columns = self.sensors.len().div_ceil(room).clamp(1, fitting);
        let n_rows = self.sensors.len().div_ceil(n_columns);
        for row in 0..n_rows {
            let cells = (0..n_columns).filter_map(|column| self.sensors.get(column * n_rows + row));
            let cells: Vec<String> = cells.map(|bar| self.cell(bar)).collect();
            lines.push(cells.join(&" ".repeat(GAP)));
        }
        lines.truncate(height);
        lines
            .into_iter()
            .map(|line| console::truncate_str(&line, width, "").into_owned())
            .collect()
    }

    fn state_line(&self, width: usize) -> String {
        let Some(share) = self.share else {
            return self.state.clone();
        };
        let n = width.saturating_sub(2).min(30);
        let full = ((share.clamp(0.0, 1.0) * n as f64).round() as usize).min(n);
        let bar = Style::new().green().apply_to("█".repeat(full));
        format!("{bar}{} {}", "░".repeat(n - full), self.state)
    }

    fn cell(&self, bar: &Bar) -> String {
        let full = ((bar.share * BAR_WIDTH as f64).round() as usize).min(BAR_WIDTH);
        let style = match bar {
            _ if bar.clamped => Style::new().red(),
            _ if self.moving.contains(&bar.name) => Style::new().yellow(),
            _ => Style::new().cyan(),
        };
        format!(
            "{} {}{} {}° {}",
            pad(&label(&bar.name), NAME_WIDTH),
            style.apply_to("█".repeat(full)),
            "·".repeat(BAR_WIDTH - full),
            pad_left(&format!("{:.0}", bar.angle_deg), 4),
            pad_left(&raw_text(bar.raw), 6),
        )
    }
}

/// A raw value in six columns: whole counts as they are, fractions with the digits that fit.
fn raw_text(raw: f64) -> String {
    match raw.abs() {
        _ if raw.fract() == 0.0 => format!("{raw:.0}"),
        size if size >= 1000.0 => format!("{raw:.0}"),
        size if size >= 10.0 => format!("{raw:.1}"),
        _ => format!("{raw:.3}"),
    }
}

/// A sensor's name in few letters.
pub(super) fn label(name: &str) -> String {
    let short = [
        ("middle_index_abduction", "mid-ind abd"),
        ("ring_middle_abduction", "ring-mid abd"),
        ("little_ring_abduction", "lit-ring abd"),
        ("thumb_abduction", "thumb abd"),
        ("thumb_rotation", "thumb rot"),
        ("wrist_abduction", "wrist abd"),
        ("wrist_flexion", "wrist flex"),
    ];
    let found = short.iter().find(|(long, _)| *long == name);
    found.map_or_else(|| name.replace('_', " "), |(_, label)| (*label).to_owned())
}

/// A text in lines of at most that many columns, broken between words.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use tsukamu_proto::v1::SensorReading;

    use super::*;

    fn picture(n_sensors: usize) -> Picture {
        let mut picture = Picture {
            title: "calibrating glove".into(),
            words: "Lay the hand flat on the table: fingers straight and together, the thumb against the index finger."
                .into(),
            state: "hold still".into(),
            share: Some(0.5),
            ..Picture::default()
        };
        for raw in [10.0, 200.0, 105.0] {
            let sensor = |k: usize| SensorReading {
                sensor: if k == 0 {
                    "index_mcp".into()
                } else {
                    format!("sensor_{k}")
                },
                raw,
                angle_deg: raw / 2.0,
                ..SensorReading::default()
            };
            picture.take(&WatchReadingsResponse {
                sensors: (0..n_sensors).map(sensor).collect(),
                ..WatchReadingsResponse::default()
            });
        }
        picture
    }

    #[test]
    fn twenty_two_sensors_fit_an_ordinary_terminal() {
        let lines = picture(22).lines(80, 24);
        assert!(lines.len() <= 24, "{}", lines.len());
        assert!(
            lines
                .iter()
                .all(|line| console::measure_text_width(line) <= 80)
        );
        let text = console::strip_ansi_codes(&lines.join("\n")).into_owned();
        assert!(
            text.contains("index mcp    ██████······   52°    105"),
            "{text}"
        );
        assert!(text.contains("sensor 21"), "{text}");
        assert!(
            text.contains("███████████████░░░░░░░░░░░░░░░ hold still"),
            "{text}"
        );
        // Few sensors take one column; a tiny terminal is not overrun.
        assert_eq!(picture(5).lines(80, 24).len(), 10);
        for (width, height) in [(0, 0), (1, 1), (20, 5), (300, 2)] {
            let lines = picture(22).lines(width, height);
            assert!(lines.len() <= height);
            assert!(
                lines
                    .iter()
                    .all(|line| console::measure_text_width(line) <= width)
            );
        }
    }
}
