//! From recorded sets of hand motion to tracks. Each importer documents its set's spaces and what it derives.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};

use crate::mistake::ImportError;
use crate::track::HandTrack;

/// The simulated Adroit hand: door recordings of people, and pick, carry and throw runs.
pub mod adroit;
/// The object's own path in the Adroit files.
pub mod adroit_body;
/// The Adroit sets' reference tables.
pub mod adroit_reference;
/// Twenty-one points from a video.
pub mod landmarks21;
/// Two bare hands seen by a Leap Motion controller.
pub mod leap;
/// A still hand pose of WebXR's joints.
pub mod webxr;

/// Which set a file is of, with that importer's options.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImportOptions {
    /// See [`adroit`].
    Adroit(adroit::AdroitOptions),
    /// See [`leap`].
    Leap(leap::LeapOptions),
    /// See [`landmarks21`].
    Landmarks21(landmarks21::Landmarks21Options),
    /// See [`webxr`].
    Webxr(webxr::WebxrOptions),
}

/// The names of the sets, as a command line says them.
pub const SET_NAMES: [&str; 4] = ["adroit", "leap", "landmarks21", "webxr"];

impl ImportOptions {
    /// A set's default options by its name in [`SET_NAMES`].
    pub fn by_name(name: &str) -> Option<Self> {
        match name {
            "adroit" => Some(Self::Adroit(adroit::AdroitOptions::default())),
            "leap" => Some(Self::Leap(leap::LeapOptions::default())),
            "landmarks21" => Some(Self::Landmarks21(landmarks21::Landmarks21Options::default())),
            "webxr" => Some(Self::Webxr(webxr::WebxrOptions::default())),
            _ => None,
        }
    }
}

/// Reads a file of any of the sets.
///
/// # Errors
/// Every mistake with its line and column, up to a limit.
pub fn import(text: &str, options: &ImportOptions) -> Result<HandTrack, ImportError> {
    match options {
        ImportOptions::Adroit(options) => adroit::import(text, options),
        ImportOptions::Leap(options) => leap::import(text, options),
        ImportOptions::Landmarks21(options) => landmarks21::import(text, options),
        ImportOptions::Webxr(options) => webxr::import(text, options),
    }
}

const HALF_SQRT: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// `y_up_from_z_up`: x stays, z becomes y, y becomes -z; a quarter turn about -x.
pub(crate) fn y_up_from_z_up() -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(HALF_SQRT, -HALF_SQRT, 0.0, 0.0))
}

/// `palm_from_wrist` for palm axes with +z to the fingers and -y out of the palm: half a turn about y gives
/// OpenXR's wrist axes, for both hands.
pub(crate) fn palm_from_wrist() -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 1.0, 0.0))
}

/// A point of a z-up space in the y-up one, without rounding.
pub(crate) fn y_up_point(point: &Point3<f64>) -> Point3<f64> {
    Point3::new(point.x, point.z, -point.y)
}

/// A vector of a z-up space in the y-up one, without rounding.
pub(crate) fn y_up_vector(vector: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(vector.x, vector.z, -vector.y)
}

/// `world_from_wrist`, y up, of a palm pose in a z-up space, with the origin kept.
pub(crate) fn wrist_of_palm(palm: &Isometry3<f64>) -> Isometry3<f64> {
    let rotation = y_up_from_z_up() * palm.rotation * palm_from_wrist();
    let origin = y_up_vector(&palm.translation.vector);
    Isometry3::from_parts(Translation3::from(origin), rotation)
}

#[cfg(test)]
pub(crate) mod tests {
    use std::path::PathBuf;

    use super::*;

    /// The text of a file of the recorded sets beside the workspace; `None`, and a line that says so, where they are not.
    #[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
    pub(crate) fn shared_data(name: &str) -> Option<String> {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join("../../../shared/data")
            .join(name);
        let text = std::fs::read_to_string(&path).ok();
        if text.is_none() {
            eprintln!("skipped: shared data not present ({name})");
        }
        text
    }

    /// The text of a file of this project's test data.
    pub(crate) fn own_data(name: &str) -> String {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join("../../tests/data")
            .join(name);
        std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    #[test]
    fn z_up_turns_to_y_up() {
        let turn = y_up_from_z_up();
        for point in [Point3::new(1.0, 2.0, 3.0), Point3::new(-0.5, 0.0, 1.0)] {
            assert!((turn * point - y_up_point(&point)).norm() < 1e-15);
        }
        // A palm flat over the table, z up: fingers to +y, back up, a right thumb to -x.
        let palm =
            UnitQuaternion::from_basis_unchecked(&[-Vector3::x(), Vector3::z(), Vector3::y()]);
        let wrist = wrist_of_palm(&Isometry3::from_parts(
            Translation3::new(0.1, 0.2, 0.3),
            palm,
        ));
        assert!(wrist.rotation.angle() < 1e-7, "{wrist}");
        assert!((wrist.translation.vector - Vector3::new(0.1, 0.3, -0.2)).norm() < 1e-15);
    }

    #[test]
    fn sets_go_by_name() {
        for name in SET_NAMES {
            assert!(ImportOptions::by_name(name).is_some(), "{name}");
        }
        assert_eq!(ImportOptions::by_name("mocap"), None);
        let options = ImportOptions::by_name("webxr").unwrap();
        assert!(import("", &options).is_err());
    }
}
