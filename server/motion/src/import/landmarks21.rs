//! Twenty-one points of a right hand from a video: wrist and twenty joints in MANO's wrist space
//! (+z to the fingers, +y to the thumb, +x out of the palm), without times and without the hand's own motion.

use nalgebra::{Isometry3, Point3, Vector3};
use tsukamu_world::hand::joint::{N_JOINTS, Side};
use tsukamu_world::hand::sample::{FingerPose, HandSample};

use crate::mistake::{ImportError, MistakeKind, Mistakes, only};
use crate::rows::{RawRow, anatomical_name, joint_columns, joint_points, track_of};
use crate::table::{Column, Group, Table};
use crate::track::HandTrack;

/// How to read a file of points without times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landmarks21Options {
    /// Frames per second of the video, 1 to 1000; default 30.
    pub rate_hz: f64,
    /// `world_from_wrist` for the whole track: where to put the hand. Default: the world's origin.
    pub wrist: Isometry3<f64>,
}

impl Default for Landmarks21Options {
    fn default() -> Self {
        Self {
            rate_hz: 30.0,
            wrist: Isometry3::identity(),
        }
    }
}

/// Reads a file of twenty-one points. Time is the `frame` column less its first value, over the rate.
///
/// # Errors
/// Every mistake with its line and column, up to a limit; a rate out of bounds.
pub fn import(text: &str, options: &Landmarks21Options) -> Result<HandTrack, ImportError> {
    if !(1.0..=1000.0).contains(&options.rate_hz) {
        let kind = MistakeKind::OutOfBounds {
            value: options.rate_hz,
            bounds: "1 to 1000 Hz",
        };
        return Err(only(0, Some("rate_hz"), kind));
    }
    let mut mistakes = Mistakes::default();
    let table = Table::read(text, &mut mistakes)?;
    let frame = table.column("frame", &mut mistakes);
    let wrist = ["x", "y", "z"].map(|axis| table.column(&format!("wrist_{axis}"), &mut mistakes));
    let joints = joint_columns(&table, |joint| anatomical_name("", joint), &mut mistakes);
    mistakes.check_header()?;
    let rows = frame_rows(&table, &frame, (&wrist, &joints), &mut mistakes);
    let first = rows.first().map_or(0.0, |row| row.t_s);
    let rows = rows.into_iter().map(|row| RawRow {
        t_s: (row.t_s - first) / options.rate_hz,
        ..row
    });
    track_of(
        rows.collect(),
        "frame",
        |row| sample(row, &options.wrist),
        mistakes,
    )
}

/// Rows with the frame number for time, points relative to the wrist.
fn frame_rows(
    table: &Table,
    frame: &Column,
    (wrist, joints): (&[Column; 3], &[[Column; 3]]),
    mistakes: &mut Mistakes,
) -> Vec<RawRow> {
    let mut rows = Vec::new();
    for row in &table.rows {
        let frame = row.number(frame, mistakes);
        let wrist = row.group(wrist, mistakes);
        let points = joint_points(row, joints, mistakes);
        if let (Some(t_s), Group::Values(wrist)) = (frame, wrist) {
            let relative = |point: Point3<f64>| point - Vector3::from(wrist);
            rows.push(RawRow {
                line: row.line,
                t_s,
                side: Side::Right,
                body: Isometry3::identity(),
                points: points.map(|point| point.map(relative)),
            });
        }
    }
    rows
}

fn sample(row: &RawRow, wrist: &Isometry3<f64>) -> HandSample {
    let points: [Option<Point3<f64>>; N_JOINTS] = row
        .points
        .map(|point| point.map(|mano| wrist * Point3::new(-mano.y, -mano.x, -mano.z)));
    HandSample {
        wrist: *wrist,
        fingers: FingerPose::Points(points),
    }
}

#[cfg(test)]
mod tests {
    use tsukamu_world::hand::joint::JointId;
    use tsukamu_world::hand::kinematics::{angles_from_points, forward};
    use tsukamu_world::hand::skeleton::Skeleton;

    use super::super::tests::shared_data;
    use super::*;

    fn header() -> String {
        let mut text = String::from("frame,wrist_x,wrist_y,wrist_z");
        for joint in JointId::all() {
            let name = anatomical_name("", joint);
            text.push_str(&format!(",{name}_x,{name}_y,{name}_z"));
        }
        text.push('\n');
        text
    }

    #[test]
    fn frames_become_times_and_points_turn_to_the_wrists_axes() {
        let cells = ",0.01,0.02,0.09".repeat(20);
        let text = format!("{}5,0,0,0{cells}\n8,0.1,0,0{cells}\n", header());
        let track = import(&text, &Landmarks21Options::default()).unwrap();
        assert_eq!(track.hands[0].times_s, [0.0, 0.1]);
        let FingerPose::Points(points) = &track.hands[0].samples[0].fingers else {
            panic!("points")
        };
        // Toward the thumb is -x at a right hand, out of the palm -y, to the fingers -z.
        assert_eq!(points[4], Some(Point3::new(-0.02, -0.01, -0.09)));
        let FingerPose::Points(points) = &track.hands[0].samples[1].fingers else {
            panic!("points")
        };
        assert!(
            (points[4].unwrap().y - 0.09).abs() < 1e-15,
            "relative to the wrist"
        );
    }

    #[test]
    fn a_rate_out_of_bounds_and_a_frame_that_repeats_are_refused() {
        let zero = Landmarks21Options {
            rate_hz: 0.0,
            ..Landmarks21Options::default()
        };
        let error = import("", &zero).unwrap_err().to_string();
        assert_eq!(
            error,
            "option rate_hz: 0 is out of bounds: it must be 1 to 1000 Hz"
        );
        let row = format!("1,0,0,0{}\n", ",0,0,0".repeat(20));
        let error = import(&(header() + &row + &row), &Landmarks21Options::default()).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("line 3, column frame: time 0 s"),
            "{error}"
        );
    }

    #[test]
    fn the_recording_is_a_hand_whose_angles_can_be_found() {
        let Some(text) = shared_data("video_hand21/human_joint_right_000_369.csv") else {
            return;
        };
        let track = import(&text, &Landmarks21Options::default()).unwrap();
        assert_eq!(
            (track.validate(), track.hands[0].times_s.len()),
            (Ok(()), 370)
        );
        assert!((track.duration_s() - 369.0 / 30.0).abs() < 1e-9);
        let mut sum = 0.0;
        for sample in &track.hands[0].samples {
            let FingerPose::Points(points) = &sample.fingers else {
                panic!("points")
            };
            let points = points.map(|point| point.unwrap());
            assert!(
                points[8].z < -0.08 && points[4].x < 0.0 && points[16].x > 0.0,
                "a right hand"
            );
            let skeleton = Skeleton::adult(Side::Right).fitted(&points);
            let angles = angles_from_points(&skeleton, Side::Right, &points);
            assert!(angles.is_finite());
            let again = forward(&skeleton, Side::Right, &angles);
            sum += (again[7] - points[7]).norm();
        }
        let mean = sum / 370.0;
        assert!(
            mean < 0.01,
            "the index tip comes back within {mean} m on average"
        );
    }
}
