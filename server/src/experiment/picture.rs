//! Colours and type that all pictures share: a light ground, dark text, few hues that are told apart in grey too.

use plotters::style::{Color, FontDesc, FontFamily, FontStyle, FontTransform, RGBColor, TextStyle};

/// The ground.
pub(super) const PAPER: RGBColor = RGBColor(255, 255, 255);
/// Titles.
pub(super) const INK: RGBColor = RGBColor(28, 33, 40);
/// Labels.
pub(super) const SOFT_INK: RGBColor = RGBColor(92, 101, 112);
/// Lines of the grid.
pub(super) const GRID: RGBColor = RGBColor(228, 231, 235);
/// What is compared with.
pub(super) const MARK: RGBColor = RGBColor(186, 53, 53);
/// Cold to warm.
pub(super) const SERIES: [RGBColor; 4] = [
    RGBColor(120, 134, 150),
    RGBColor(42, 111, 187),
    RGBColor(219, 137, 24),
    RGBColor(33, 138, 88),
];

/// The family that every viewer has.
const FAMILY: FontFamily<'static> = FontFamily::SansSerif;

/// Text of a size in pixels.
pub(super) fn text(size: u32, colour: RGBColor) -> TextStyle<'static> {
    styled(size, colour, FontStyle::Normal)
}

/// Bold text of a size in pixels.
pub(super) fn bold(size: u32, colour: RGBColor) -> TextStyle<'static> {
    styled(size, colour, FontStyle::Bold)
}

fn styled(size: u32, colour: RGBColor, style: FontStyle) -> TextStyle<'static> {
    let font = FontDesc::new(FAMILY, f64::from(size), style).transform(FontTransform::None);
    TextStyle {
        color: colour.to_backend_color(),
        ..TextStyle::from(font)
    }
}
