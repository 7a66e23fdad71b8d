//! The Leap Motion set: one row per hand and frame, x right, y away from the user, z up, at about 110 frames a second.
//!
//! The device gives the palm's centre, not the wrist. Its palm is rigid, with the thumb's base near the wrist, so the
//! wrist is put on the palm's long axis through its centre, behind the middle finger's knuckle by
//! [`WRIST_REACH`](crate::import::leap::WRIST_REACH) times the way from the thumb's base to that knuckle along this axis (about 95 mm for the
//! device's standard hand); where either is not tracked, [`WRIST_BEHIND_PALM_M`](crate::import::leap::WRIST_BEHIND_PALM_M) behind the palm's centre. An estimate.

use nalgebra::{Isometry3, Translation3, Vector3};
use tsukamu_world::hand::joint::{Finger, JointId};
use tsukamu_world::hand::sample::{FingerPose, HandSample};

use super::{wrist_of_palm, y_up_point};
use crate::mistake::{ImportError, MistakeKind, Mistakes, only};
use crate::rows::{HandColumns, RawRow, anatomical_name, hand_rows, track_of};
use crate::table::{Column, Table};
use crate::track::HandTrack;

/// What to take from a Leap file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeapOptions {
    /// Rows of less confidence, 0 to 1, are "not tracked"; rows without one are taken. Default 0: all.
    pub min_confidence: f64,
}

/// Way from the knuckle to the wrist over that from the knuckle to the thumb's base, along the palm.
pub const WRIST_REACH: f64 = 1.25;
/// Way from the palm's centre to the wrist where the hand's points are not there to tell, metres.
pub const WRIST_BEHIND_PALM_M: f64 = 0.070;

/// Reads a Leap file of one hand or two.
///
/// # Errors
/// Every mistake with its line and column, up to a limit; two hands of one side in one frame are one.
pub fn import(text: &str, options: &LeapOptions) -> Result<HandTrack, ImportError> {
    if !(0.0..=1.0).contains(&options.min_confidence) {
        let kind = MistakeKind::OutOfBounds {
            value: options.min_confidence,
            bounds: "0 to 1",
        };
        return Err(only(0, Some("min_confidence"), kind));
    }
    let mut mistakes = Mistakes::default();
    let mut table = Table::read(text, &mut mistakes)?;
    table.column("hand", &mut mistakes);
    let confidence = table.column("confidence", &mut mistakes);
    let columns = HandColumns::find(
        &table,
        "palm",
        |joint| anatomical_name("", joint),
        &mut mistakes,
    );
    mistakes.check_header()?;
    keep_confident(
        &mut table,
        &confidence,
        options.min_confidence,
        &mut mistakes,
    );
    let rows = hand_rows(&table, &columns, &mut mistakes);
    track_of(rows, "t_s", sample, mistakes)
}

fn keep_confident(table: &mut Table, column: &Column, least: f64, mistakes: &mut Mistakes) {
    table.rows.retain(|row| {
        row.optional(column, mistakes)
            .is_none_or(|given| given >= least)
    });
}

fn sample(row: &RawRow) -> HandSample {
    let palm = Isometry3::from_parts(
        Translation3::from(
            row.body * Vector3::new(0.0, 0.0, wrist_along_palm(row)) + row.body.translation.vector,
        ),
        row.body.rotation,
    );
    let points = row.points.map(|point| point.map(|p| y_up_point(&p)));
    HandSample {
        wrist: wrist_of_palm(&palm),
        fingers: FingerPose::Points(points),
    }
}

/// Where the wrist is on the palm's long axis (+z to the fingers) from the palm's centre, metres.
fn wrist_along_palm(row: &RawRow) -> f64 {
    let along = |finger| {
        let point = row.points[JointId::of(finger, 0).index()]?;
        Some(row.body.inverse_transform_point(&point).z)
    };
    match (along(Finger::Middle), along(Finger::Thumb)) {
        (Some(knuckle), Some(thumb)) if thumb < knuckle => {
            knuckle - WRIST_REACH * (knuckle - thumb)
        }
        _ => -WRIST_BEHIND_PALM_M,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use tsukamu_world::hand::joint::Side;

    use super::super::tests::shared_data;
    use super::*;
    use crate::hand_csv;

    const FINGERS: [&str; 5] = ["thumb", "index", "middle", "ring", "little"];

    fn header() -> String {
        let mut names: Vec<String> =
            "t_s,hand,confidence,palm_x,palm_y,palm_z,palm_qw,palm_qx,palm_qy,palm_qz"
                .split(',')
                .map(str::to_owned)
                .collect();
        for finger in FINGERS {
            let second = if finger == "thumb" {
                ["cmc", "mcp", "ip", "tip"]
            } else {
                ["mcp", "pip", "dip", "tip"]
            };
            names.extend(
                second.iter().flat_map(|joint| {
                    ["x", "y", "z"].map(|axis| format!("{finger}_{joint}_{axis}"))
                }),
            );
        }
        names.join(",") + "\n"
    }

    /// A palm at (0, 0.3, 0.2), fingers away from the user, back up; thumb base and middle knuckle given along it.
    fn row(t_s: f64, hand: &str, confidence: &str, tracked: bool) -> String {
        // Columns of the rotation: x to -x, y to z, z to y: half a turn about (0, 1, 1).
        let palm = "0,0.3,0.2,0,0,0.70710678118654757,0.70710678118654757";
        let mut cells = vec![String::from(",,"); 20];
        if tracked {
            cells[0] = String::from("-0.02,0.24,0.2");
            cells[8] = String::from("0,0.32,0.2");
        }
        format!("{t_s},{hand},{confidence},{palm},{}\n", cells.join(","))
    }

    fn wrist(text: &str) -> Isometry3<f64> {
        import(text, &LeapOptions::default()).unwrap().hands[0].samples[0].wrist
    }

    #[test]
    fn the_wrist_is_behind_the_palm() {
        let whole = wrist(&(header() + &row(0.0, "right", "1", true)));
        // y: 0.32 - 1.25 * 0.08 = 0.22 away from the user, which is -z.
        assert!(
            (Point3::from(whole.translation.vector) - Point3::new(0.0, 0.2, -0.22)).norm() < 1e-12,
            "{whole}"
        );
        assert!(whole.rotation.angle() < 1e-7, "{whole}");
        let bare = wrist(&(header() + &row(0.0, "right", "", false)));
        assert!((bare.translation.vector.z + 0.23).abs() < 1e-12, "{bare}");
    }

    #[test]
    fn doubtful_rows_can_be_left_out_and_two_hands_kept() {
        let text = header()
            + &row(0.0, "right", "0.2", true)
            + &row(0.0, "left", "0.9", true)
            + &row(0.01, "right", "", true);
        let track = import(
            &text,
            &LeapOptions {
                min_confidence: 0.5,
            },
        )
        .unwrap();
        assert_eq!(track.hand(Side::Right).unwrap().times_s, [0.01]);
        assert_eq!(track.hand(Side::Left).unwrap().times_s, [0.0]);
        let error = import(
            &text,
            &LeapOptions {
                min_confidence: 2.0,
            },
        )
        .unwrap_err()
        .to_string();
        assert_eq!(
            error,
            "option min_confidence: 2 is out of bounds: it must be 0 to 1"
        );
        let twice = header() + &row(0.0, "left", "1", true) + &row(0.0, "left", "1", true);
        let error = import(&twice, &LeapOptions::default())
            .unwrap_err()
            .to_string();
        assert!(
            error.starts_with("line 3, column t_s: time 0 s is not after"),
            "{error}"
        );
    }

    #[test]
    fn the_recordings_are_read() {
        for (name, n_right, n_left) in [
            ("grab", 374, 0),
            ("flapping", 328, 328),
            ("brian", 500, 0),
            ("wave", 111, 0),
        ] {
            let Some(text) = shared_data(&format!("leap_hand/{name}.csv")) else {
                return;
            };
            let track = import(&text, &LeapOptions::default()).unwrap();
            assert_eq!(track.validate(), Ok(()));
            for (side, n_rows) in [(Side::Right, n_right), (Side::Left, n_left)] {
                let hand = track.hand(side);
                assert_eq!(
                    hand.map_or(0, |h| h.times_s.len()),
                    n_rows,
                    "{name} {side:?}"
                );
                for sample in hand.iter().flat_map(|h| &h.samples) {
                    check_is_a_hand(sample, side);
                }
            }
            assert_eq!(
                hand_csv::read(&hand_csv::write(&track)).as_ref(),
                Ok(&track)
            );
        }
    }

    fn check_is_a_hand(sample: &HandSample, side: Side) {
        let FingerPose::Points(points) = &sample.fingers else {
            panic!("points")
        };
        let local = |finger| {
            sample
                .wrist
                .inverse_transform_point(&points[JointId::of(finger, 0).index()].unwrap())
        };
        let (middle, index, little) = (
            local(Finger::Middle),
            local(Finger::Index),
            local(Finger::Little),
        );
        assert!(
            middle.z < -0.08 && middle.z > -0.12 && middle.x.abs() < 0.01,
            "{middle}"
        );
        let to_thumb = if side == Side::Right { -1.0 } else { 1.0 };
        assert!(
            index.x * to_thumb > 0.02 && little.x * to_thumb < -0.02,
            "{side:?} {index} {little}"
        );
    }
}
