//! Where a tracker's transmitter stands: two keys of its `[[device]]`, or a file of these two alone.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use tsukamu_devices::calibration::place::yaw_pitch_roll_deg;

use crate::document::bounds::Bounds;
use crate::document::keys::{Keys, with_top_table};
use crate::document::mistake::{Mistakes, Sheet};

/// The keys of a place.
const KEYS: [&str; 2] = ["transmitter_position", "transmitter_rotation_deg"];

/// `world_from_transmitter` of a tracker, and the file that it came from.
pub(super) fn read(
    keys: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    folder: &Path,
) -> (Isometry3<f64>, Option<PathBuf>) {
    let own = place(keys, sheet);
    let Some(file) = keys.text(sheet, "room").map(|file| folder.join(file)) else {
        return (own, None);
    };
    if let Some(key) = KEYS.into_iter().find(|key| keys.has(key)) {
        keys.fault(
            sheet,
            key,
            "is the room file's to say: leave out one of both",
        );
    }
    let found = load(&file).unwrap_or_else(|mistakes| {
        mistakes
            .0
            .into_iter()
            .for_each(|mistake| sheet.fault_elsewhere(mistake));
        own
    });
    (found, Some(file))
}

/// The place in this file.
///
/// # Errors
/// When it cannot be read, or every mistake in it.
pub fn load(file: &Path) -> Result<Isometry3<f64>, Mistakes> {
    let origin = file.display().to_string();
    let text = std::fs::read_to_string(file)
        .map_err(|fault| Mistakes::one(&origin, format!("cannot be read: {fault}")))?;
    let mut sheet = Sheet::new(origin, &text);
    let found = with_top_table(&mut sheet, place);
    sheet.into_mistakes().or_value(found)
}

/// `transmitter_rotation_deg` of a place: yaw, pitch, roll.
pub fn yaw_pitch_roll(world_from_transmitter: &Isometry3<f64>) -> [f64; 3] {
    yaw_pitch_roll_deg(&world_from_transmitter.rotation)
}

/// The two keys as text.
pub fn text(world_from_transmitter: &Isometry3<f64>) -> String {
    let numbers = |values: [f64; 3], digits: usize| {
        // Rounded first, so that no `-0.0` is left; a rounded number can always be read again.
        let scale = 10.0_f64.powi(digits as i32);
        let rounded = values.map(|value| (value * scale).round() / scale + 0.0);
        rounded.map(|value| format!("{value:?}")).join(", ")
    };
    let position = numbers(world_from_transmitter.translation.vector.into(), 6);
    let rotation = numbers(yaw_pitch_roll(world_from_transmitter), 5);
    format!("{} = [{position}]\n{} = [{rotation}]\n", KEYS[0], KEYS[1])
}

fn place(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Isometry3<f64> {
    let metres = Bounds::within(-100.0, 100.0, "m");
    let degrees = Bounds::within(-360.0, 360.0, "°");
    let position = keys
        .numbers::<3>(sheet, KEYS[0], "[x, y, z]", metres)
        .unwrap_or_default();
    let turns = keys.numbers::<3>(sheet, KEYS[1], "[yaw, pitch, roll]", degrees);
    let [yaw, pitch, roll] = turns.unwrap_or_default().map(f64::to_radians);
    let about = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
    let rotation = about(Vector3::y_axis(), yaw)
        * about(Vector3::x_axis(), pitch)
        * about(Vector3::z_axis(), roll);
    Isometry3::from_parts(Translation3::from(position), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_room_is_written_and_read() {
        let there = Isometry3::from_parts(
            Vector3::new(0.1234567, -0.0, 99.0).into(),
            UnitQuaternion::from_euler_angles(0.3, -2.0, 0.1),
        );
        let file = std::env::temp_dir().join(format!("tsukamu-room-{}.toml", std::process::id()));
        std::fs::write(&file, text(&there)).unwrap();
        let back = load(&file);
        std::fs::write(&file, "transmitter_position = [0, 0, 101]\nroom = 1\n").unwrap();
        let wrong = load(&file).unwrap_err().to_string();
        std::fs::remove_file(&file).unwrap();
        let back = back.unwrap();
        assert!((back.translation.vector - there.translation.vector).norm() < 1e-6);
        assert!(back.rotation.angle_to(&there.rotation) < 1e-6);
        assert!(
            wrong.contains("transmitter_position") && wrong.contains("room"),
            "{wrong}"
        );
        assert!(!text(&there).contains("-0.0,"), "{}", text(&there));
    }
}
