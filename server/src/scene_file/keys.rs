//! The keys of a scene, read into the world's types.

use std::collections::BTreeSet;
use std::path::Path;

use nalgebra::Vector3;
use tsukamu_world::scene::{
    COORDINATE_MAX_M, Model, ObjectSpec, RATE_HZ_MAX, RATE_HZ_MIN, Scene, SceneFault,
    THROW_WINDOW_MAX_S,
};

use super::hands::HandSourceSpec;
use super::{object, target};
use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Longest grace time, in seconds.
pub(crate) const GRACE_MAX_S: f64 = 60.0;
/// Most hands that a scene names.
const HANDS_MAX: usize = 64;
/// Strongest gravity, in m/s²: 100 times that of the earth.
const GRAVITY_MAX: f64 = 1000.0;
/// Grasp angles, in degrees.
pub(super) const ANGLE_DEG: Bounds = Bounds::above(0.0, 180.0, "°");
/// Coordinates, in metres.
pub(super) const COORDINATE: Bounds = Bounds::within(-COORDINATE_MAX_M, COORDINATE_MAX_M, "m");
/// Step rates.
pub(crate) const RATE: Bounds = Bounds::within(RATE_HZ_MIN, RATE_HZ_MAX, "steps per second");
/// Grace times.
pub(crate) const GRACE: Bounds = Bounds::within(0.0, GRACE_MAX_S, "s");

/// Reads the whole scene. Where a key is wrong the default stands in, and the sheet holds the mistake.
pub(super) fn read(
    top: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    folder: &Path,
) -> (Scene, Vec<HandSourceSpec>) {
    let mut scene = surroundings(top, sheet);
    let hands = hands(top, sheet, folder);
    let mut names = BTreeSet::new();
    for (index, mut keys) in top.tables(sheet, "object").into_iter().enumerate() {
        let spec = object::read(
            &mut keys,
            sheet,
            &object::Around {
                folder,
                floor_height: scene.floor_height,
                index,
            },
        );
        keys.finish(sheet);
        let Some(spec) = spec else { continue };
        let is_new = names.insert(spec.name.clone());
        check_among_others(&spec, is_new, scene.floor_height, &keys, sheet);
        scene.objects.push(spec);
    }
    for mut keys in top.tables(sheet, "target") {
        scene.targets.extend(target::read(&mut keys, sheet));
        keys.finish(sheet);
    }
    (scene, hands)
}

fn surroundings(top: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Scene {
    let default = Scene::default();
    let within_s = Bounds::within(0.0, THROW_WINDOW_MAX_S, "s");
    let models = Model::ALL.map(Model::name);
    Scene {
        name: top.text(sheet, "name").unwrap_or_default(),
        model: top
            .choice(sheet, "model", &models)
            .and_then(Model::from_name)
            .unwrap_or_default(),
        rate_hz: top
            .number(sheet, "rate_hz", RATE)
            .unwrap_or(default.rate_hz),
        gravity: gravity(top, sheet).unwrap_or(default.gravity),
        floor_height: top
            .number(sheet, "floor_height", COORDINATE)
            .unwrap_or(default.floor_height),
        grasp_angle: top
            .number(sheet, "grasp_angle_deg", ANGLE_DEG)
            .map_or(default.grasp_angle, f64::to_radians),
        throw_window_s: top
            .number(sheet, "throw_window_s", within_s)
            .unwrap_or(default.throw_window_s),
        tracking_grace_s: top
            .number(sheet, "tracking_grace_s", GRACE)
            .unwrap_or(default.tracking_grace_s),
        objects: Vec::new(),
        targets: Vec::new(),
    }
}

fn gravity(top: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Vector3<f64>> {
    let bounds = Bounds::within(-GRAVITY_MAX, GRAVITY_MAX, "m/s²");
    let gravity = Vector3::from(top.numbers::<3>(sheet, "gravity", "[x, y, z]", bounds)?);
    if gravity.y > 0.0 {
        top.fault(
            sheet,
            "gravity",
            format!("points upward (y is {}); y must not be above 0", gravity.y),
        );
        return None;
    }
    Some(gravity)
}

fn hands(top: &mut Keys<'_>, sheet: &mut Sheet<'_>, folder: &Path) -> Vec<HandSourceSpec> {
    let texts = top.texts(sheet, "hands").unwrap_or_default();
    if texts.len() > HANDS_MAX {
        top.fault(
            sheet,
            "hands",
            format!("names {} hands; at most {HANDS_MAX}", texts.len()),
        );
    }
    let mut hands = Vec::new();
    for (index, (span, text)) in texts.into_iter().enumerate() {
        let key = format!("hands[{index}]");
        match HandSourceSpec::parse(&text, folder) {
            Ok(HandSourceSpec::Csv(path)) if !path.is_file() => {
                sheet.fault(
                    &span,
                    key,
                    format!("names {text:?}; there is no such file, and no synthetic:NAME"),
                );
            }
            Ok(spec) => hands.push(spec),
            Err(fault) => sheet.fault(&span, key, fault.to_string()),
        }
    }
    hands
}

/// Faults that show only beside the scene and the other objects, each at the key that causes it.
fn check_among_others(
    spec: &ObjectSpec,
    is_new: bool,
    floor_height: f64,
    keys: &Keys<'_>,
    sheet: &mut Sheet<'_>,
) {
    if !is_new {
        keys.fault(
            sheet,
            "name",
            format!(
                "is {:?}, which another object carries; names must be unique",
                spec.name
            ),
        );
    }
    let mut faults = Vec::new();
    spec.validate(floor_height, &mut faults);
    for fault in faults {
        let key = match &fault {
            SceneFault::Pose { .. } | SceneFault::BelowFloor { .. } => "position",
            SceneFault::GraspAngle { .. } => "grasp_angle_deg",
            SceneFault::Density { .. } => "density",
            _ => "name",
        };
        keys.fault(sheet, key, fault.to_string());
    }
}
