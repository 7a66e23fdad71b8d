//! One `[[object]]` of a scene.

use std::path::Path;
use std::sync::Arc;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use tsukamu_world::polyhedron::fault::ShapeFault;
use tsukamu_world::polyhedron::{Polyhedron, shapes};
use tsukamu_world::scene::ObjectSpec;

use super::keys::{ANGLE_DEG, COORDINATE};
use super::mesh;
use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// What an object's keys are read against.
pub(super) struct Around<'a> {
    /// Where meshes are looked for.
    pub(super) folder: &'a Path,
    /// Height of the floor, in metres.
    pub(super) floor_height: f64,
    /// Which object of the scene it is, from 0.
    pub(super) index: usize,
}

/// Lengths of shapes, in metres.
const LENGTH: Bounds = Bounds::above(0.0, 1000.0, "m");
/// Densities: up to five times that of osmium.
const DENSITY: Bounds = Bounds::above(0.0, 100_000.0, "kg/m³");
/// Density of light wood, in kg/m³.
const DENSITY_DEFAULT: f64 = 500.0;
/// How far the length of a quaternion in a file may be from 1.
const UNIT_SLACK: f64 = 1.0e-3;
/// Words of the `shape` key.
const SHAPES: [&str; 6] = ["box", "prism", "pyramid", "l-shape", "ellipsoid", "mesh"];
/// Colours of objects that name none, taken in turn.
const PALETTE: [[f32; 3]; 8] = [
    [0.86, 0.37, 0.34],
    [0.33, 0.58, 0.84],
    [0.95, 0.74, 0.29],
    [0.42, 0.71, 0.46],
    [0.62, 0.47, 0.77],
    [0.93, 0.56, 0.33],
    [0.38, 0.73, 0.74],
    [0.84, 0.52, 0.67],
];

/// Reads one object; `None` when its shape or its place cannot be known, which the sheet then explains.
pub(super) fn read(
    keys: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    around: &Around<'_>,
) -> Option<ObjectSpec> {
    keys.require(sheet, "name", "a text, unique in the scene");
    let name = keys.text(sheet, "name").unwrap_or_default();
    if keys.has("name") && name.is_empty() {
        keys.fault(sheet, "name", "is empty; give a text, unique in the scene");
    }
    let shape = shape(keys, sheet, around.folder);
    let rotation = rotation(keys, sheet);
    keys.require(sheet, "position", "[x, y, z] in metres");
    let position = keys.numbers::<3>(sheet, "position", "[x, y, z]", COORDINATE);
    let on_floor = keys.flag(sheet, "on_floor").unwrap_or(false);
    let grasp_angle = keys
        .number(sheet, "grasp_angle_deg", ANGLE_DEG)
        .map(f64::to_radians);
    let density = keys
        .number(sheet, "density", DENSITY)
        .unwrap_or(DENSITY_DEFAULT);
    let share = Bounds::within(0.0, 1.0, "");
    let colour = keys
        .numbers::<3>(sheet, "colour", "[red, green, blue]", share)
        .map(|rgb| rgb.map(|part| part as f32));
    let (shape, mut position) = (shape?, position?);
    if on_floor {
        let lowest = shape
            .vertices()
            .iter()
            .map(|v| (rotation * v).y)
            .fold(f64::INFINITY, f64::min);
        position[1] += around.floor_height - lowest;
    }
    Some(ObjectSpec {
        name,
        shape: Arc::new(shape),
        pose: Isometry3::from_parts(Translation3::from(position), rotation),
        grasp_angle,
        density,
        colour: colour.unwrap_or(PALETTE[around.index % PALETTE.len()]),
    })
}

fn shape(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>, folder: &Path) -> Option<Polyhedron> {
    keys.require(
        sheet,
        "shape",
        "one of box, prism, pyramid, l-shape, ellipsoid, mesh",
    );
    let made = match keys.choice(sheet, "shape", &SHAPES)? {
        "box" => size(keys, sheet).map(|size| shapes::cuboid(&size)),
        "prism" => prism(keys, sheet),
        "pyramid" => size(keys, sheet).map(|size| shapes::pyramid(size.x, size.z, size.y)),
        "l-shape" => l_shape(keys, sheet),
        "ellipsoid" => size(keys, sheet).map(|size| shapes::ellipsoid(&(size * 0.5))),
        _ => return from_mesh(keys, sheet, folder),
    };
    made?
        .map_err(|fault| keys.fault(sheet, "shape", fault.to_string()))
        .ok()
}

fn size(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Vector3<f64>> {
    keys.require(sheet, "size", "[x, y, z] in metres");
    keys.numbers::<3>(sheet, "size", "[x, y, z]", LENGTH)
        .map(Vector3::from)
}

fn prism(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Result<Polyhedron, ShapeFault>> {
    let has_sides = keys.has("sides");
    let sides = keys.whole(sheet, "sides", Bounds::within(3.0, 1000.0, "sides"));
    let radius = length(keys, sheet, "radius");
    let height = length(keys, sheet, "height");
    let sides = if has_sides { sides } else { Some(6) };
    Some(shapes::prism(sides?, radius?, height?))
}

fn l_shape(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Result<Polyhedron, ShapeFault>> {
    let size = size(keys, sheet);
    let thickness = length(keys, sheet, "thickness");
    let (size, thickness) = (size?, thickness?);
    Some(shapes::l_shape(size.x, size.y, size.z, thickness))
}

fn length(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>, key: &'static str) -> Option<f64> {
    keys.require(sheet, key, "a length in metres");
    keys.number(sheet, key, LENGTH)
}

fn from_mesh(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>, folder: &Path) -> Option<Polyhedron> {
    keys.require(sheet, "file", "an .obj, .stl, .gltf or .glb file");
    let has_scale = keys.has("scale");
    let scale = keys.number(
        sheet,
        "scale",
        Bounds::above(0.0, 1000.0, "m per unit of the file"),
    );
    let file = keys.text(sheet, "file")?;
    let scale = if has_scale { scale? } else { 1.0 };
    mesh::load(&folder.join(file), scale)
        .map_err(|fault| keys.fault(sheet, "file", fault.to_string()))
        .ok()
}

/// The rotation about the centre of gravity; none where it is not given or wrong.
fn rotation(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> UnitQuaternion<f64> {
    let within_one = Bounds::within(-1.0 - UNIT_SLACK, 1.0 + UNIT_SLACK, "");
    let quaternion = keys.numbers::<4>(sheet, "rotation", "[x, y, z, w]", within_one);
    let degrees = Bounds::within(-360.0, 360.0, "°");
    let turns = keys.numbers::<3>(sheet, "rotation_deg", "[yaw, pitch, roll]", degrees);
    if keys.has("rotation") && keys.has("rotation_deg") {
        keys.fault(
            sheet,
            "rotation_deg",
            "is given beside rotation; give one of the two",
        );
    }
    if let Some([x, y, z, w]) = quaternion {
        let quaternion = Quaternion::new(w, x, y, z);
        if (quaternion.norm() - 1.0).abs() > UNIT_SLACK {
            keys.fault(
                sheet,
                "rotation",
                format!(
                    "has the length {:.4}; a unit quaternion has 1",
                    quaternion.norm()
                ),
            );
            return UnitQuaternion::identity();
        }
        return UnitQuaternion::new_normalize(quaternion);
    }
    let Some([yaw, pitch, roll]) = turns.map(|turns| turns.map(f64::to_radians)) else {
        return UnitQuaternion::identity();
    };
    let about = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
    about(Vector3::y_axis(), yaw) * about(Vector3::x_axis(), pitch) * about(Vector3::z_axis(), roll)
}
