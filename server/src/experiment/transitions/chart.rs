//! The picture: for each object a step line over four levels, free at the bottom, grasped on top.

use plotters::coord::Shift;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::{DrawingArea, IntoDrawingArea, PathElement, Rectangle, SVGBackend, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, RGBColor, ShapeStyle};
use tsukamu_world::state::ContactState;

use super::{ObjectStates, Span, Transitions};
use crate::experiment::picture::{GRID, INK, PAPER, SERIES, SOFT_INK, bold, text};

/// Width in pixels.
const WIDTH: u32 = 1100;
/// Left end of the time axis, in pixels.
const LEFT: i32 = 210;
/// Right end of the time axis, in pixels.
const RIGHT: i32 = WIDTH as i32 - 36;
/// Where the first row begins, in pixels.
const TOP: i32 = 84;
/// Height of one level, in pixels.
const LEVEL: i32 = 22;
/// Height of an object's row, in pixels.
const ROW: i32 = 4 * LEVEL;
/// Between two rows, in pixels.
const ROW_GAP: i32 = 22;
/// Room for the time axis, in pixels.
const BOTTOM: i32 = 62;
/// Half the thickness of a bar, in pixels.
const HALF_BAR: i32 = 6;
/// Most rows drawn.
const ROWS_MAX: usize = 40;
/// The levels from the bottom to the top.
const LEVELS: [ContactState; 4] = [
    ContactState::Free,
    ContactState::PushedAtOne,
    ContactState::PushedAtSeveral,
    ContactState::Grasped,
];
/// Steps of the time axis, seconds, of which the first that gives few enough labels is taken.
const TIME_STEPS_S: [f64; 12] = [
    0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 120.0, 300.0, 600.0,
];
/// Most labels on the time axis.
const TIME_LABELS_MAX: f64 = 14.0;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Outcome = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// The picture as SVG. Objects that no hand touched have no row, unless none was touched.
///
/// # Errors
/// When the picture cannot be drawn.
pub fn draw(transitions: &Transitions) -> anyhow::Result<String> {
    let any = transitions.objects.iter().any(ObjectStates::is_touched);
    let shown = transitions
        .objects
        .iter()
        .filter(|object| !any || object.is_touched());
    let rows: Vec<&ObjectStates> = shown.take(ROWS_MAX).collect();
    let bottom = TOP + rows.len() as i32 * (ROW + ROW_GAP);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, (bottom + BOTTOM) as u32))
            .into_drawing_area();
        area.fill(&PAPER)?;
        head(&area, transitions, transitions.objects.len() - rows.len())?;
        let axis = TimeAxis {
            duration_s: transitions.duration_s.max(f64::MIN_POSITIVE),
        };
        axis.draw(&area, bottom)?;
        for (index, object) in rows.iter().enumerate() {
            row(&area, &axis, object, TOP + index as i32 * (ROW + ROW_GAP))?;
        }
        area.present()?;
    }
    Ok(svg)
}

const fn colour(state: ContactState) -> RGBColor {
    match state {
        ContactState::Free => SERIES[0],
        ContactState::PushedAtOne => SERIES[1],
        ContactState::PushedAtSeveral => SERIES[2],
        ContactState::Grasped => SERIES[3],
    }
}

fn head(area: &Area<'_>, transitions: &Transitions, n_hidden: usize) -> Outcome {
    let title = format!("Contact states over time: {}", transitions.title);
    area.draw(&Text::new(title, (24, 18), bold(21, INK)))?;
    let mut what =
        "free, pushed at one point (push-1), pushed at several (push-n), grasped".to_owned();
    match n_hidden {
        0 => {}
        1 => what.push_str("; 1 more object is never touched"),
        n => what.push_str(&format!("; {n} more objects are never touched")),
    }
    area.draw(&Text::new(what, (24, 46), text(14, SOFT_INK)))
}

/// From seconds to pixels.
struct TimeAxis {
    duration_s: f64,
}

impl TimeAxis {
    fn x(&self, time_s: f64) -> i32 {
        LEFT + ((time_s / self.duration_s) * f64::from(RIGHT - LEFT)).round() as i32
    }

    fn draw(&self, area: &Area<'_>, bottom: i32) -> Outcome {
        let few = |step: &&f64| self.duration_s / **step <= TIME_LABELS_MAX;
        let widest = TIME_STEPS_S[TIME_STEPS_S.len() - 1];
        let step_s = TIME_STEPS_S
            .iter()
            .find(few)
            .copied()
            .unwrap_or_else(|| (self.duration_s / 10.0).max(widest));
        let decimals = usize::from(step_s < 1.0);
        let style = text(13, SOFT_INK).pos(Pos::new(HPos::Center, VPos::Top));
        for index in 0..=(self.duration_s / step_s + 1.0e-9).floor() as u32 {
            let time_s = f64::from(index) * step_s;
            let x = self.x(time_s);
            area.draw(&PathElement::new(
                [(x, TOP - 8), (x, bottom - ROW_GAP + 12)],
                GRID,
            ))?;
            area.draw(&Text::new(
                format!("{time_s:.decimals$}"),
                (x, bottom - ROW_GAP + 18),
                style.clone(),
            ))?;
        }
        let middle = ((LEFT + RIGHT) / 2, bottom - ROW_GAP + 40);
        area.draw(&Text::new(
            "world time in seconds",
            middle,
            text(14, INK).pos(Pos::new(HPos::Center, VPos::Top)),
        ))
    }
}

fn row(area: &Area<'_>, axis: &TimeAxis, object: &ObjectStates, top: i32) -> Outcome {
    let right = Pos::new(HPos::Right, VPos::Center);
    let height = |state| {
        let level = LEVELS.iter().position(|known| *known == state).unwrap_or(0) as i32;
        top + ROW - LEVEL / 2 - level * LEVEL
    };
    area.draw(&Text::new(
        short(&object.name),
        (24, height(ContactState::Grasped)),
        bold(15, INK).pos(Pos::new(HPos::Left, VPos::Center)),
    ))?;
    for state in LEVELS {
        let y = height(state);
        area.draw(&Text::new(
            state.name(),
            (LEFT - 14, y),
            text(12, SOFT_INK).pos(right),
        ))?;
        area.draw(&PathElement::new([(LEFT, y), (RIGHT, y)], GRID))?;
    }
    let riser = ShapeStyle::from(SOFT_INK.mix(0.55)).stroke_width(1);
    for pair in object
        .spans
        .windows(2)
        .filter(|pair| follows(&pair[0], &pair[1]))
    {
        let x = axis.x(pair[1].from_s);
        area.draw(&PathElement::new(
            [(x, height(pair[0].state)), (x, height(pair[1].state))],
            riser,
        ))?;
    }
    for span in &object.spans {
        let (from, until, y) = (
            axis.x(span.from_s),
            axis.x(span.until_s),
            height(span.state),
        );
        // A state of one step is seen, too.
        let corners = [(from, y - HALF_BAR), (until.max(from + 2), y + HALF_BAR)];
        area.draw(&Rectangle::new(corners, colour(span.state).filled()))?;
    }
    Ok(())
}

/// Whether the second span begins where the first one ends.
fn follows(first: &Span, second: &Span) -> bool {
    second.from_s - first.until_s < 0.5 * (second.until_s - second.from_s)
}

/// A name that fits beside its row.
fn short(name: &str) -> String {
    const CHARS_MAX: usize = 14;
    if name.chars().count() <= CHARS_MAX {
        return name.to_owned();
    }
    name.chars().take(CHARS_MAX - 1).chain(['…']).collect()
}
