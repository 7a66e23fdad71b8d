use console::{Style, style};
use tsukamu_client::names;
use tsukamu_client::view::{HandView, ObjectView, WorldView};
use tsukamu_proto::v1::{ContactState, Tracking};

use super::super::format::{pad, pad_left, span};
use super::model::WatchModel;

/// Where the tips of thumb and index finger stand among the joints.
const THUMB_TIP: usize = 3;
const INDEX_TIP: usize = 7;
/// A pinch wider than this has an empty bar, metres.
const WIDE_PINCH: f64 = 0.12;
/// Below this an object is shown as still, m/s.
const STILL: f64 = 0.005;

/// The table of hands: a header and a row per hand.
pub(super) fn hands(model: &WatchModel, view: &WorldView) -> Vec<String> {
    let mut lines = vec![header(&format!(
        "{} {} {} {} {}",
        pad("HANDS", 25),
        pad("TRACKING", 9),
        pad("HOLDS", 16),
        pad("PINCH", 13),
        "SAMPLE AGE"
    ))];
    lines.extend(view.hands.iter().map(|hand| hand_row(model, hand)));
    if view.hands.is_empty() {
        lines.push(
            style("no hands: plug in a glove, or try `tsukamu send`")
                .dim()
                .to_string(),
        );
    }
    lines
}

fn hand_row(model: &WatchModel, hand: &HandView) -> String {
    let holds = hand.holds.map_or_else(
        || style(pad("-", 16)).dim().to_string(),
        |id| {
            style(pad(&model.names().object(id), 16))
                .green()
                .to_string()
        },
    );
    let tracking = format!("● {}", names::tracking(hand.tracking));
    format!(
        "{} {} {} {holds} {} {}",
        pad(names::side(hand.side), 6),
        pad(&model.names().hand(hand.id), 18),
        tracking_style(hand.tracking).apply_to(pad(&tracking, 9)),
        pad(&pinch(hand), 13),
        span(hand.sample_age_s)
    )
}

fn tracking_style(tracking: Tracking) -> Style {
    match tracking {
        Tracking::Tracked => Style::new().green(),
        Tracking::Held => Style::new().yellow(),
        Tracking::Lost => Style::new().red(),
        Tracking::Never | Tracking::Unspecified => Style::new().dim(),
    }
}

/// The distance between the tips of thumb and index finger, and a bar that fills as they close.
fn pinch(hand: &HandView) -> String {
    let (Some(thumb), Some(index)) = (hand.shown[THUMB_TIP], hand.shown[INDEX_TIP]) else {
        return "-".into();
    };
    let distance = (thumb - index).norm();
    let n_full = ((1.0 - distance / WIDE_PINCH).clamp(0.0, 1.0) * 5.0).round() as usize;
    format!(
        "{}{} {:.0} mm",
        "▰".repeat(n_full),
        "▱".repeat(6 - n_full),
        distance * 1e3
    )
}

/// The table of objects in at most that many lines: a header, rows, and how many are not shown. Where not all fit,
/// those that are touched or move come first.
pub(super) fn objects(model: &WatchModel, view: &WorldView, n_lines: usize) -> Vec<String> {
    let n_resting = view
        .objects
        .values()
        .filter(|object| object.resting)
        .count();
    let n_held = view
        .objects
        .values()
        .filter(|object| object.state == ContactState::Grasped)
        .count();
    let mut lines = vec![header(&format!(
        "{} {} {} {} {}",
        pad("OBJECTS", 20),
        pad("STATE", 8),
        pad("      X       Y       Z m", 25),
        pad_left("m/s", 6),
        "HOLDER"
    ))];
    let n_rows = n_lines.saturating_sub(1);
    let mut rows: Vec<(&u64, &ObjectView)> = view.objects.iter().collect();
    let all_fit = rows.len() <= n_rows;
    if !all_fit {
        rows.sort_by_key(|(id, object)| (urgency(object), **id));
        rows.truncate(n_rows.saturating_sub(1));
    }
    lines.extend(
        rows.iter()
            .map(|(id, object)| object_row(model, **id, object)),
    );
    if !all_fit {
        let n_more = view.objects.len() - rows.len();
        lines.push(
            style(format!(
                "… and {n_more} more; {n_held} held and {n_resting} resting in all"
            ))
            .dim()
            .to_string(),
        );
    }
    lines
}

const fn urgency(object: &ObjectView) -> u8 {
    match object.state {
        ContactState::Grasped => 0,
        ContactState::PushedAtOne | ContactState::PushedAtSeveral => 1,
        ContactState::Free | ContactState::Unspecified => {
            if object.resting {
                3
            } else {
                2
            }
        }
    }
}

fn object_row(model: &WatchModel, id: u64, object: &ObjectView) -> String {
    let [red, green, blue] = model
        .scene
        .objects
        .iter()
        .find(|o| o.id == id)
        .map_or([200; 3], |o| colour_of(&o.colour));
    let swatch = Style::new().true_color(red, green, blue).apply_to("■");
    let state = if object.resting {
        "resting"
    } else {
        names::contact_state(object.state)
    };
    let p = object.pose.translation;
    let speed = model
        .speed(id)
        .filter(|speed| *speed >= STILL)
        .map_or_else(|| "-".into(), |speed| format!("{speed:.2}"));
    let holder = object
        .holder
        .map_or_else(|| "-".into(), |hand| model.names().hand(hand));
    format!(
        "{swatch} {} {} {:7.3} {:7.3} {:7.3}   {} {}",
        pad(&model.names().object(id), 18),
        state_style(object).apply_to(pad(state, 8)),
        p.x,
        p.y,
        p.z,
        pad_left(&speed, 6),
        pad(&holder, 16)
    )
}

fn state_style(object: &ObjectView) -> Style {
    match object.state {
        ContactState::Grasped => Style::new().green().bold(),
        ContactState::PushedAtOne | ContactState::PushedAtSeveral => Style::new().yellow(),
        ContactState::Free | ContactState::Unspecified if object.resting => Style::new().dim(),
        ContactState::Free | ContactState::Unspecified => Style::new().cyan(),
    }
}

/// Red, green, blue, 0 to 255; grey where the scene gives none.
pub(super) fn colour_of(colour: &[f32]) -> [u8; 3] {
    match colour {
        [red, green, blue, ..] => {
            [*red, *green, *blue].map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8)
        }
        _ => [200; 3],
    }
}

fn header(text: &str) -> String {
    style(text.trim_end()).bold().underlined().to_string()
}
