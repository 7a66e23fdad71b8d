//! A still pose of WebXR's twenty-five joints as JSON: `hand`, and per joint `pos_m` and `rot_columns` in the hand's
//! pose space (metres, y up). WebXR's wrist axes are OpenXR's.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use tsukamu_world::hand::joint::{Finger, JointId, N_JOINTS, Side};
use tsukamu_world::hand::sample::{FingerPose, HandSample};

use crate::mistake::{ImportError, MistakeKind, Mistakes, only};
use crate::track::{HandTrack, TrackHand};

/// How to make a track of a still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WebxrOptions {
    /// How long the hand stays, seconds, 0 to 3600; default 1.
    pub duration_s: f64,
    /// `world_from_pose`: where to put the hand's pose space. Default: the world's origin.
    pub pose_space: Isometry3<f64>,
}

impl Default for WebxrOptions {
    fn default() -> Self {
        Self {
            duration_s: 1.0,
            pose_space: Isometry3::identity(),
        }
    }
}

/// Samples per second of a still's track.
const RATE_HZ: f64 = 60.0;
/// How far axes may be from unit length and right angles.
const ROTATION_TOLERANCE: f64 = 1e-3;

#[derive(Debug, Deserialize)]
struct Still {
    hand: Hand,
    joints: Joints,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Hand {
    Left,
    Right,
}

/// By name; `None` for a joint that the file does not have.
type Joints = std::collections::BTreeMap<String, Joint>;

#[derive(Debug, Deserialize)]
struct Joint {
    pos_m: [f64; 3],
    rot_columns: [[f64; 3]; 3],
}

/// Reads a still pose. A joint that the file does not have is not tracked; the wrist must be there.
///
/// # Errors
/// What is wrong with the text, by line and column; a wrist that is missing or whose axes are no rotation; a
/// duration out of bounds.
pub fn import(text: &str, options: &WebxrOptions) -> Result<HandTrack, ImportError> {
    if !(0.0..=3600.0).contains(&options.duration_s) {
        let kind = MistakeKind::OutOfBounds {
            value: options.duration_s,
            bounds: "0 to 3600 s",
        };
        return Err(only(0, Some("duration_s"), kind));
    }
    let still: Still = serde_json::from_str(text).map_err(|error| {
        let line = u64::try_from(error.line()).unwrap_or(u64::MAX);
        only(line, None, MistakeKind::Syntax(error.to_string()))
    })?;
    let sample = still_sample(&still, &options.pose_space)?;
    let side = match still.hand {
        Hand::Left => Side::Left,
        Hand::Right => Side::Right,
    };
    let n_steps = (options.duration_s * RATE_HZ).ceil() as usize;
    let mut times_s: Vec<f64> = (0..=n_steps)
        .map(|step| (step as f64 / RATE_HZ).min(options.duration_s))
        .collect();
    times_s.dedup();
    let samples = vec![sample; times_s.len()];
    Ok(HandTrack {
        hands: vec![TrackHand {
            side,
            times_s,
            samples,
        }],
    })
}

fn still_sample(still: &Still, pose_space: &Isometry3<f64>) -> Result<HandSample, ImportError> {
    let mut mistakes = Mistakes::default();
    let wrist = still.joints.get("wrist");
    if wrist.is_none() {
        mistakes.add(1, Some("wrist"), MistakeKind::MissingColumn);
    }
    let rotation = wrist.and_then(|joint| rotation(&joint.rot_columns));
    if wrist.is_some() && rotation.is_none() {
        mistakes.add(1, Some("wrist"), MistakeKind::NotARotation);
    }
    mistakes.check()?;
    let place = wrist.map_or_else(Vector3::zeros, |joint| Vector3::from(joint.pos_m));
    let wrist = Isometry3::from_parts(Translation3::from(place), rotation.unwrap_or_default());
    let mut points = [None; N_JOINTS];
    for joint in JointId::all() {
        let found = still.joints.get(&webxr_name(joint));
        points[joint.index()] = found.map(|joint| pose_space * Point3::from(joint.pos_m));
    }
    Ok(HandSample {
        wrist: pose_space * wrist,
        fingers: FingerPose::Points(points),
    })
}

/// `thumb-phalanx-proximal`, `index-finger-tip`, `pinky-finger-phalanx-distal`.
fn webxr_name(joint: JointId) -> String {
    let finger = match joint.finger() {
        Finger::Thumb => "thumb",
        Finger::Index => "index-finger",
        Finger::Middle => "middle-finger",
        Finger::Ring => "ring-finger",
        Finger::Little => "pinky-finger",
    };
    let (_, part) = joint.name().split_once('_').unwrap_or_default();
    match part {
        "tip" | "metacarpal" => format!("{finger}-{part}"),
        _ => format!("{finger}-phalanx-{part}"),
    }
}

/// The rotation with these columns, if they are near one.
fn rotation(columns: &[[f64; 3]; 3]) -> Option<UnitQuaternion<f64>> {
    let [x, y, z] = columns.map(Vector3::from);
    let off = (Matrix3::from_columns(&[x, y, z]).transpose() * Matrix3::from_columns(&[x, y, z]))
        - Matrix3::identity();
    // Written so that NaN fails.
    let is_rotation = off.iter().all(|e| e.abs() < ROTATION_TOLERANCE) && x.cross(&y).dot(&z) > 0.0;
    if !is_rotation {
        return None;
    }
    let x = x.normalize();
    let y = (y - x * x.dot(&y)).normalize();
    let matrix = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    Some(UnitQuaternion::from_rotation_matrix(
        &Rotation3::from_matrix_unchecked(matrix),
    ))
}

#[cfg(test)]
mod tests {
    use super::super::tests::shared_data;
    use super::*;
    use crate::track::Outside;

    const STILL: &str = r#"{ "hand": "left", "pose": "relaxed", "joints": {
        "wrist": { "pos_m": [0.1, 0.2, 0.3], "rot_columns": [[0,0,-1],[0,1,0],[1,0,0]], "radius_m": 0.02 },
        "index-finger-phalanx-proximal": { "pos_m": [0, 0, 0], "rot_columns": [[1,0,0],[0,1,0],[0,0,1]], "radius_m": 0.01 }
    } }"#;

    #[test]
    fn a_still_becomes_a_short_track() {
        let track = import(
            STILL,
            &WebxrOptions {
                duration_s: 0.5,
                ..WebxrOptions::default()
            },
        )
        .unwrap();
        assert_eq!((track.validate(), track.duration_s()), (Ok(()), 0.5));
        let hand = track.hand(Side::Left).unwrap();
        let sample = hand.sample_at(0.333, Outside::NoSample).unwrap();
        assert!((sample.wrist.rotation * Vector3::x() + Vector3::z()).norm() < 1e-12);
        let FingerPose::Points(points) = &hand.samples[0].fingers else {
            panic!("points")
        };
        assert_eq!(points.iter().flatten().count(), 1);
        assert_eq!(points[4], Some(Point3::origin()));
    }

    #[test]
    fn mistakes_are_named() {
        let check = |text: &str, words: &str| {
            let error = import(text, &WebxrOptions::default())
                .unwrap_err()
                .to_string();
            assert!(error.contains(words), "{error} does not say {words}");
        };
        check("", "line 1: EOF");
        check(&STILL.replace("left", "upper"), "unknown variant `upper`");
        check(
            &STILL.replace("\"wrist\"", "\"wirst\""),
            "column wrist: the column is missing",
        );
        check(
            &STILL.replace("[0,0,-1]", "[0,0,1]"),
            "column wrist: the axes are no rotation",
        );
        check(
            &STILL.replace("[0.1, 0.2, 0.3]", "[0.1, 0.2]"),
            "line 2: invalid length 2",
        );
    }

    #[test]
    fn the_three_poses_are_left_hands() {
        for name in ["relaxed", "pinch", "point"] {
            let Some(text) = shared_data(&format!("webxr_hand_poses/{name}.json")) else {
                return;
            };
            let track = import(&text, &WebxrOptions::default()).unwrap();
            let sample = &track.hand(Side::Left).unwrap().samples[0];
            let FingerPose::Points(points) = &sample.fingers else {
                panic!("points")
            };
            let local = points.map(|point| sample.wrist.inverse_transform_point(&point.unwrap()));
            // A left thumb is at +x; the middle knuckle 96 mm before the wrist.
            assert!(
                local[0].x > 0.02 && local[16].x < -0.02 && (local[8].z + 0.0956).abs() < 0.001,
                "{local:?}"
            );
        }
    }
}
