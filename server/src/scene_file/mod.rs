//! Scenes as TOML files or by built-in name.
//!
//! # Keys of a scene
//!
//! | key | unit, bounds | default |
//! | --- | --- | --- |
//! | `name` | text | the file's name |
//! | `model` | `"paper"` | `"paper"` |
//! | `rate_hz` | steps per second, 1 to 4000 | 240 |
//! | `gravity` | `[x, y, z]` m/s², y not above 0, within 1000 | `[0, -9.81, 0]` |
//! | `floor_height` | m, within 10 000 | 0 |
//! | `grasp_angle_deg` | °, above 0 up to 180: least angle between two contact normals that makes a grasp | 90 |
//! | `throw_window_s` | s, 0 to 0.5: window of the throw velocity; 0 is one step | 0 |
//! | `tracking_grace_s` | s, 0 to 60: how long a hand that is not seen keeps hold | 0.25 |
//! | `hands` | texts: `"synthetic:NAME"` or a hand CSV beside the scene, at most 64 | none |
//!
//! Each `[[object]]`:
//!
//! | key | unit, bounds | default |
//! | --- | --- | --- |
//! | `name` | text, unique in the scene | must be given |
//! | `shape` | `"box"`, `"prism"`, `"pyramid"`, `"l-shape"`, `"ellipsoid"` or `"mesh"` | must be given |
//! | `size` | `box`: `[x, y, z]` edges; `pyramid`: `[base x, height y, base z]`; `l-shape`: `[x, y, z]` outer edges; `ellipsoid`: `[x, y, z]` diameters; m, above 0 up to 1000 | must be given |
//! | `sides` | `prism`: 3 to 1000 | 6 |
//! | `radius` | `prism`: m from the axis to a corner, above 0 up to 1000 | must be given |
//! | `height` | `prism`: m along y, above 0 up to 1000 | must be given |
//! | `thickness` | `l-shape`: m, below the size's x and y | must be given |
//! | `file` | `mesh`: an .obj, .stl, .gltf or .glb file, relative to the scene | must be given |
//! | `scale` | `mesh`: m per unit of the file, above 0 up to 1000 | 1 |
//! | `position` | `[x, y, z]` m of the centre of gravity, within 10 000; with `on_floor`, y counts from the floor to the lowest point | must be given |
//! | `on_floor` | `true`: the object stands on the floor (or `position` y above it) | `false` |
//! | `rotation` | unit quaternion `[x, y, z, w]` | `[0, 0, 0, 1]` |
//! | `rotation_deg` | `[yaw, pitch, roll]` °: about y, then about its own x, then about its own z | `[0, 0, 0]` |
//! | `grasp_angle_deg` | °, above 0 up to 180 | the scene's |
//! | `density` | kg/m³, above 0 up to 100 000; `paper` knows no masses | 500 |
//! | `colour` | `[red, green, blue]`, 0 to 1 | one of eight |
//!
//! Each `[[target]]`:
//!
//! | key | unit, bounds | default |
//! | --- | --- | --- |
//! | `name` | text | `target` |
//! | `centre` | `[x, y, z]` m, within 10 000 | must be given |
//! | `normal` | direction toward the thrower, any length | `[0, 0, 1]` |
//! | `radius` | m, above 0 up to 1000 | 0.15 |

pub mod builtin;
pub mod hands;
pub mod mesh;

pub(crate) mod keys;
mod object;
mod target;

#[cfg(test)]
mod tests;

use std::path::Path;

use tsukamu_world::scene::Scene;

use crate::document::keys::with_top_table;
use crate::document::mistake::{Mistake, Mistakes, Sheet};
use hands::HandSourceSpec;

/// A scene that is ready to run.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// What the world is built from; [`Scene::validate`] finds no fault in it.
    pub scene: Scene,
    /// The hands that drive it unless the user names others.
    pub default_hands: Vec<HandSourceSpec>,
    /// Its text, for recordings.
    pub source_text: String,
}

/// The built-in scene of that name, or else the scene in that file.
///
/// # Errors
/// Every mistake in it, each with file, line, column and key.
pub fn load(name_or_file: &str) -> Result<LoadedScene, Mistakes> {
    if let Some(text) = builtin::text(name_or_file) {
        return parse(name_or_file, text, Path::new(""));
    }
    let path = Path::new(name_or_file);
    let text = std::fs::read_to_string(path).map_err(|fault| {
        let names = builtin::names().collect::<Vec<_>>().join(", ");
        Mistakes::one(
            name_or_file,
            format!("is no built-in scene ({names}), and no readable file: {fault}"),
        )
    })?;
    parse(
        name_or_file,
        &text,
        path.parent().unwrap_or_else(|| Path::new("")),
    )
}

/// A scene from its text. `origin` is how mistakes name it; files in it are looked for in `folder`.
///
/// # Errors
/// Every mistake in it.
pub fn parse(origin: &str, text: &str, folder: &Path) -> Result<LoadedScene, Mistakes> {
    let mut sheet = Sheet::new(origin, text);
    let (scene, default_hands) =
        with_top_table(&mut sheet, |top, sheet| keys::read(top, sheet, folder));
    let mut scene = scene;
    if scene.name.is_empty() {
        let stem = Path::new(origin)
            .file_stem()
            .map(|stem| stem.to_string_lossy().into_owned());
        scene.name = if builtin::text(origin).is_some() {
            origin.to_owned()
        } else {
            stem.unwrap_or_default()
        };
    }
    // What the keys let pass and the world still refuses would be a mistake of this reader; it is reported all the same.
    if sheet.is_clean() {
        for fault in scene.validate() {
            let (origin, message) = (origin.to_owned(), fault.to_string());
            sheet.fault_elsewhere(Mistake {
                origin,
                place: None,
                key: String::new(),
                message,
            });
        }
    }
    sheet.into_mistakes().or_value(LoadedScene {
        scene,
        default_hands,
        source_text: text.to_owned(),
    })
}
