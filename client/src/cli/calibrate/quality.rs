use console::Style;
use serde_json::{Value, json};
use tsukamu_proto::v1::SensorQuality;

use super::picture::label;
use crate::cli::format::{printable, table};

/// A table of all sensors.
pub(super) fn lines(qualities: &[SensorQuality]) -> Vec<String> {
    let header = ["SENSOR", "TRAVEL", "NOISE", "BETWEEN", "ERROR", "SCORE", ""];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    rows.extend(qualities.iter().map(row));
    table(&rows)
}

fn row(quality: &SensorQuality) -> Vec<String> {
    let (style, word) = match quality.verdict.as_str() {
        "good" => (Style::new().green(), "good".to_owned()),
        "weak" => (Style::new().yellow(), "weak".to_owned()),
        "dead" => (Style::new().red(), "dead: taken for absent".to_owned()),
        "saturated" => (
            Style::new().red(),
            "saturated: bends beyond its end unseen".to_owned(),
        ),
        "not_asked" => (
            Style::new().dim(),
            "not asked: no pose is for it".to_owned(),
        ),
        other => (Style::new(), printable(other)),
    };
    let number = |value: f64| {
        if value >= 100.0 {
            format!("{value:.0}")
        } else {
            format!("{value:.2}")
        }
    };
    let is_judged = quality.verdict != "not_asked";
    let or_dash = |text: String| if is_judged { text } else { "-".to_owned() };
    let mut cells = vec![label(&printable(&quality.sensor))];
    cells.push(number(quality.travel));
    cells.push(number(quality.noise));
    cells.push(or_dash(number(quality.separation)));
    cells.push(
        quality
            .error_deg
            .map_or_else(|| "-".to_owned(), |deg| format!("{deg:.1}°")),
    );
    cells.push(or_dash(format!("{:.2}", quality.score)));
    cells.push(style.apply_to(word).to_string());
    cells
}

/// What to do about the sensors that are not good, in one line; nothing where all are.
pub(super) fn advice(qualities: &[SensorQuality]) -> Option<String> {
    let of = |verdict: &str| {
        let bad = qualities
            .iter()
            .filter(|quality| quality.verdict == verdict);
        bad.map(|quality| label(&printable(&quality.sensor)))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let parts: Vec<String> = [
        ("weak", "weak"),
        ("dead", "dead"),
        ("saturated", "saturated"),
    ]
    .into_iter()
    .map(|(verdict, word)| (of(verdict), word))
    .filter(|(sensors, _)| !sensors.is_empty())
    .map(|(sensors, word)| format!("{word}: {sensors}"))
    .collect();
    (!parts.is_empty()).then(|| {
        let text = parts.join("; ");
        format!("{text}. If the glove has them, do the poses again, farther and stiller.")
    })
}

/// The same for programs.
pub(super) fn values(qualities: &[SensorQuality]) -> Value {
    let value = |quality: &SensorQuality| {
        json!({
            "sensor": quality.sensor, "travel": quality.travel, "noise": quality.noise,
            "separation": quality.separation, "error_deg": quality.error_deg, "score": quality.score,
            "verdict": quality.verdict,
        })
    };
    qualities.iter().map(value).collect()
}
