//! Fig. 13 again: steps per second against the number of objects, both on logarithmic axes.

use plotters::coord::Shift;
use plotters::coord::combinators::LogCoord;
use plotters::prelude::{
    Cartesian2d, ChartBuilder, ChartContext, Circle, DashedLineSeries, DrawingArea,
    IntoDrawingArea, IntoLogRange, LineSeries, PathElement, SVGBackend, Text,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, RGBColor, ShapeStyle};

use super::measure::CostShape;
use super::{CostReport, CostRow, PAPER_FLOOR_FPS, PAPER_FPS, PAPER_OBJECTS};
use crate::experiment::picture::{GRID, INK, MARK, PAPER, SERIES, SOFT_INK, bold, text};
use crate::experiment::table::grouped;

/// Width and height in pixels.
const SIZE: (u32, u32) = (960, 620);
/// Room to the right of the lines for their names, in pixels.
const LABELS_PX: u32 = 150;
/// Least distance between two names, in pixels.
const LABEL_GAP_PX: i32 = 17;
/// Bounds of the vertical axis, steps per second.
const Y_RANGE: std::ops::Range<f64> = 5.0..1.0e6;

type Plane = Cartesian2d<LogCoord<f64>, LogCoord<f64>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Plane>;
type Outcome<'a> = Result<(), plotters::drawing::DrawingAreaErrorKind<std::io::Error>>;

/// The picture as SVG.
///
/// # Errors
/// When the picture cannot be drawn.
pub fn draw(report: &CostReport) -> anyhow::Result<String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&PAPER)?;
        title(&area)?;
        let most = report
            .rows
            .iter()
            .map(|row| row.objects)
            .max()
            .unwrap_or(10)
            .max(10) as f64;
        let mut chart = ChartBuilder::on(&area)
            .margin_top(72)
            .margin_right(LABELS_PX)
            .margin_left(14)
            .margin_bottom(14)
            .x_label_area_size(48)
            .y_label_area_size(78)
            .build_cartesian_2d((0.9..most * 1.1).log_scale(), Y_RANGE.log_scale())?;
        grid(&mut chart)?;
        marks(&mut chart, most)?;
        let mut names = Vec::new();
        for shape in CostShape::ALL {
            for held in 0..=2 {
                names.extend(series(&mut chart, report, shape, held)?);
            }
        }
        label(&area, names)?;
        area.present()?;
    }
    Ok(svg)
}

fn title(area: &Area<'_>) -> Outcome<'static> {
    area.draw(&Text::new(
        "Cost of a step against the number of objects",
        (24, 18),
        bold(21, INK),
    ))?;
    let how = "two hands of 20 judgement points and 60 judgement segments each, one core, shown hand included";
    area.draw(&Text::new(how, (24, 46), text(14, SOFT_INK)))
}

fn grid(chart: &mut Chart<'_, '_>) -> Outcome<'static> {
    chart
        .configure_mesh()
        .x_desc("objects in the world")
        .y_desc("steps per second")
        .x_labels(6)
        .y_labels(8)
        .axis_desc_style(text(14, INK))
        .label_style(text(13, SOFT_INK))
        .axis_style(SOFT_INK)
        .bold_line_style(GRID)
        .light_line_style(PAPER)
        .x_label_formatter(&|x| grouped(*x))
        .y_label_formatter(&|y| grouped(*y))
        .draw()
}

/// What the paper reports: lines across the picture, and a ring where its own measurement is.
fn marks(chart: &mut Chart<'_, '_>, most: f64) -> Outcome<'static> {
    let lines = [
        (
            PAPER_FPS,
            "1998: 17 frames/s with 10 objects, 2 held",
            VPos::Bottom,
            1.05,
        ),
        (
            PAPER_FLOOR_FPS,
            "12 frames/s: the least for interaction",
            VPos::Top,
            0.93,
        ),
    ];
    for (fps, words, side, lift) in lines {
        let ends = [(0.9, fps), (most * 1.1, fps)];
        chart.draw_series(DashedLineSeries::new(
            ends,
            5,
            4,
            ShapeStyle::from(MARK).stroke_width(1),
        ))?;
        let style = text(13, MARK).pos(Pos::new(HPos::Right, side));
        chart.draw_series([Text::new(words, (most, fps * lift), style)])?;
    }
    let ring = ShapeStyle::from(MARK).stroke_width(2);
    chart.draw_series([Circle::new((PAPER_OBJECTS as f64, PAPER_FPS), 5, ring)])?;
    Ok(())
}

/// A name at the end of a line: pixel height, text, colour.
type Name = (i32, i32, String, RGBColor);

fn series(
    chart: &mut Chart<'_, '_>,
    report: &CostReport,
    shape: CostShape,
    held: usize,
) -> Result<Option<Name>, plotters::drawing::DrawingAreaErrorKind<std::io::Error>> {
    let is_own = |row: &&CostRow| row.shape == shape.name() && row.held == held;
    let places: Vec<(f64, f64)> = report
        .rows
        .iter()
        .filter(is_own)
        .map(|row| (row.objects as f64, row.steps_per_s))
        .collect();
    let Some(last) = places.last() else {
        return Ok(None);
    };
    let colour = SERIES[held];
    let line = ShapeStyle::from(colour).stroke_width(2);
    match shape {
        CostShape::Cube => {
            chart.draw_series(LineSeries::new(places.iter().copied(), line))?;
            chart.draw_series(
                places
                    .iter()
                    .map(|place| Circle::new(*place, 3, colour.filled())),
            )?;
        }
        CostShape::Ellipsoid => {
            chart.draw_series(DashedLineSeries::new(places.iter().copied(), 7, 4, line))?;
            chart.draw_series(
                places
                    .iter()
                    .map(|place| Circle::new(*place, 4, PAPER.filled())),
            )?;
            chart.draw_series(places.iter().map(|place| Circle::new(*place, 4, line)))?;
        }
    }
    let (x, y) = chart.backend_coord(last);
    Ok(Some((
        x,
        y,
        format!("{}, {held} held", shape.name()),
        colour,
    )))
}

/// Writes the names at the ends of their lines, moved apart where they would meet.
fn label(area: &Area<'_>, mut names: Vec<Name>) -> Outcome<'static> {
    names.sort_by_key(|name| name.1);
    let mut at = i32::MIN / 2;
    for (x, y, words, colour) in names {
        at = y.max(at + LABEL_GAP_PX);
        let style = text(13, colour).pos(Pos::new(HPos::Left, VPos::Center));
        area.draw(&PathElement::new(
            [(x + 8, y), (x + 22, at)],
            colour.mix(0.5),
        ))?;
        area.draw(&Text::new(words, (x + 26, at), style))?;
    }
    Ok(())
}
