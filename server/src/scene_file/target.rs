//! One `[[target]]` of a scene.

use nalgebra::{Point3, Vector3};
use tsukamu_world::scene::Target;

use super::keys::COORDINATE;
use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Radius of the target of the 1998 game, in metres.
const RADIUS_DEFAULT_M: f64 = 0.15;

/// Reads one target; `None` when its place cannot be known, which the sheet then explains.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Target> {
    let name = keys
        .text(sheet, "name")
        .unwrap_or_else(|| "target".to_owned());
    keys.require(sheet, "centre", "[x, y, z] in metres");
    let centre = keys
        .numbers::<3>(sheet, "centre", "[x, y, z]", COORDINATE)
        .map(Point3::from);
    let radius = keys
        .number(sheet, "radius", Bounds::above(0.0, 1000.0, "m"))
        .unwrap_or(RADIUS_DEFAULT_M);
    let direction = keys
        .numbers::<3>(sheet, "normal", "[x, y, z]", COORDINATE)
        .map_or_else(Vector3::z, Vector3::from);
    let normal = direction.try_normalize(1.0e-9);
    if normal.is_none() {
        keys.fault(
            sheet,
            "normal",
            "is no direction; give a vector toward the thrower",
        );
    }
    Some(Target {
        name,
        centre: centre?,
        normal: normal?,
        radius,
    })
}
