//! The hand CSV: one row per hand and time.
//!
//! Header: `t_s,hand,wrist_x,wrist_y,wrist_z,wrist_qx,wrist_qy,wrist_qz,wrist_qw`, then `<joint>_x,<joint>_y,<joint>_z`
//! for the twenty joints of [`JOINT_NAMES`](tsukamu_world::hand::joint::JOINT_NAMES). Seconds and metres, world space, y up; the wrist has OpenXR's axes;
//! `hand` is `left` or `right`. Columns may come in any order, others are ignored. A joint with empty cells is not tracked
//! in that row; a row whose wrist has empty cells is no sample.

use std::fmt::Write as _;

use tsukamu_world::hand::joint::{JOINT_NAMES, JointId};
use tsukamu_world::hand::sample::{FingerPose, HandSample};
use tsukamu_world::hand::skeleton::Skeleton;

use crate::mistake::{ImportError, Mistakes};
use crate::rows::{HandColumns, RawRow, hand_rows, track_of};
use crate::table::Table;
use crate::track::{HandTrack, TrackHand, world_points};

/// Reads a hand CSV. The track's hands are in the order left, right.
///
/// # Errors
/// Every mistake with its line and column, up to a limit: a missing, double or empty column, a row of another length than
/// the header, a number that is none or not finite, a hand other than left or right, a time that does not rise
/// within its hand, a zero quaternion, a file without a sample.
pub fn read(text: &str) -> Result<HandTrack, ImportError> {
    let mut mistakes = Mistakes::default();
    let table = Table::read(text, &mut mistakes)?;
    // Both hands have the same columns, so which one it is must be said.
    table.column("hand", &mut mistakes);
    let columns = HandColumns::find(
        &table,
        "wrist",
        |joint| joint.name().to_owned(),
        &mut mistakes,
    );
    mistakes.check_header()?;
    let rows = hand_rows(&table, &columns, &mut mistakes);
    track_of(rows, "t_s", sample, mistakes)
}

/// Writes a hand CSV, rows in the order of time. Every number is the shortest that reads back as itself.
/// Joint angles are written as the joint places of an adult's skeleton
/// ([`HandTrack::with_points`] puts in another wearer's).
pub fn write(track: &HandTrack) -> String {
    let mut rows: Vec<(f64, &TrackHand, usize)> = Vec::new();
    for hand in &track.hands {
        let n_rows = hand.times_s.len().min(hand.samples.len());
        rows.extend((0..n_rows).map(|index| (hand.times_s[index], hand, index)));
    }
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut text = header();
    for (t_s, hand, index) in rows {
        push_row(&mut text, t_s, hand, &hand.samples[index]);
    }
    text
}

/// The header line, with its line end.
pub fn header() -> String {
    let mut text =
        String::from("t_s,hand,wrist_x,wrist_y,wrist_z,wrist_qx,wrist_qy,wrist_qz,wrist_qw");
    for name in JOINT_NAMES {
        push(&mut text, format_args!(",{name}_x,{name}_y,{name}_z"));
    }
    text.push('\n');
    text
}

fn sample(row: &RawRow) -> HandSample {
    HandSample {
        wrist: row.body,
        fingers: FingerPose::Points(row.points),
    }
}

fn push_row(text: &mut String, t_s: f64, hand: &TrackHand, sample: &HandSample) {
    let place = sample.wrist.translation.vector;
    let q = sample.wrist.rotation.coords;
    push(text, format_args!("{t_s},{}", hand.side.name()));
    for number in [place.x, place.y, place.z, q.x, q.y, q.z, q.w] {
        push(text, format_args!(",{number}"));
    }
    let points = world_points(sample, &Skeleton::adult(hand.side), hand.side);
    for joint in JointId::all() {
        match points[joint.index()] {
            Some(point) => push(text, format_args!(",{},{},{}", point.x, point.y, point.z)),
            None => text.push_str(",,,"),
        }
    }
    text.push('\n');
}

fn push(text: &mut String, words: std::fmt::Arguments<'_>) {
    text.write_fmt(words)
        .expect("a String takes all that is written to it");
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Point3, Vector3};
    use tsukamu_world::hand::joint::{N_JOINTS, Side};
    use tsukamu_world::hand::sample::JointAngles;

    use super::*;

    fn hand(side: Side, times_s: &[f64]) -> TrackHand {
        let sample = |t: &f64| {
            let wrist = Isometry3::new(
                Vector3::new(*t, 1.0 / 3.0, -0.1),
                Vector3::new(0.1, *t, 2.0),
            );
            let points = std::array::from_fn(|i| {
                (i != 7).then(|| wrist * Point3::new(0.01 * i as f64, -1e-7, 1.0 / (1.0 + t)))
            });
            HandSample {
                wrist,
                fingers: FingerPose::Points(points),
            }
        };
        TrackHand {
            side,
            times_s: times_s.to_vec(),
            samples: times_s.iter().map(sample).collect(),
        }
    }

    fn two_hands() -> HandTrack {
        HandTrack {
            hands: vec![
                hand(Side::Left, &[0.0, 0.02, 0.04]),
                hand(Side::Right, &[0.01, 0.02, 0.1 + 0.2]),
            ],
        }
    }

    /// A file of one right hand with one row per line of cells up to the wrist; the joints are empty.
    fn file(rows: &[&str]) -> String {
        let mut text = header();
        for row in rows {
            text.push_str(row);
            text.push_str(&",".repeat(3 * N_JOINTS));
            text.push('\n');
        }
        text
    }

    fn check(text: &str, expected: &[&str]) {
        let error = read(text).expect_err("a file with mistakes");
        let found: Vec<String> = error.to_string().lines().map(str::to_owned).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn what_is_written_reads_back_bit_for_bit() {
        let track = two_hands();
        let text = write(&track);
        assert_eq!(read(&text).as_ref(), Ok(&track));
        assert_eq!(write(&read(&text).unwrap()), text);
    }

    #[test]
    fn the_header_is_the_documented_one() {
        assert!(header().starts_with("t_s,hand,wrist_x,wrist_y,wrist_z,wrist_qx,wrist_qy,wrist_qz,wrist_qw,thumb_metacarpal_x,"));
        assert!(header().ends_with(",little_tip_x,little_tip_y,little_tip_z\n"));
        assert_eq!(header().split(',').count(), 9 + 60);
    }

    #[test]
    fn columns_may_come_in_any_order_beside_others() {
        let text = write(&two_hands());
        let turned: String = text
            .lines()
            .enumerate()
            .map(|(line, row)| {
                let mut cells: Vec<&str> = row.split(',').rev().collect();
                cells.push(if line == 0 { "comment" } else { "a word" });
                format!(" {} \r\n", cells.join(" , "))
            })
            .collect();
        assert_eq!(read(&format!("\u{feff}{turned}")), Ok(two_hands()));
    }

    #[test]
    fn angles_are_written_as_places() {
        let rest = HandSample {
            wrist: Isometry3::identity(),
            fingers: FingerPose::Angles(JointAngles::default()),
        };
        let track = HandTrack {
            hands: vec![TrackHand {
                side: Side::Left,
                times_s: vec![0.0],
                samples: vec![rest],
            }],
        };
        assert_eq!(read(&write(&track)), Ok(track.with_points(Skeleton::adult)));
    }

    #[test]
    fn a_row_without_a_wrist_is_no_sample_and_quaternions_become_unit() {
        let track = read(&file(&[
            "0,right,0,0,0,0,0,0,2",
            "0.01,right,,,,,,,",
            "0.02,right,0,0,0,0,0,0,1",
        ]))
        .unwrap();
        assert_eq!(track.hands[0].times_s, [0.0, 0.02]);
        assert_eq!(track.hands[0].samples[0].wrist, Isometry3::identity());
    }

    #[test]
    fn every_mistake_is_named_by_line_and_column() {
        check(
            &file(&[
                "0,right,0,0,0,0,0,0,1",
                "x,right,inf,0,0,0,0,0,1",
                "",
                "0.1,Right,0,0,0,0,0,0,1",
                "0.2,right,0,0,0,0,0,0,0",
                "0.3,right,0,,0,0,0,0,1",
                "0.3,right,0,0,0,0,0,0,1",
                "0.2,right,0,0,0,0,0,0,1",
                "0.2,left,0,0,0,0,0,0,1,7",
                ",right,0,0,0,0,0,0,1",
            ]),
            &[
                "line 3, column t_s: \"x\" is not a number",
                "line 3, column wrist_x: \"inf\" is not finite",
                "line 4: the row has 61 cells, the header has 69",
                "line 5, column hand: \"Right\" is none of left, right",
                "line 6, column wrist_qx: the quaternion is zero",
                "line 7, column wrist_y: the cell is empty while others of the same position or pose are not",
                "line 9, column t_s: time 0.2 s is not after this hand's previous time 0.3 s",
                "line 10: the row has 70 cells, the header has 69",
                "line 11, column t_s: the cell is empty",
            ],
        );
    }

    #[test]
    fn broken_files_are_refused_as_a_whole() {
        check("", &["line 1: the file is empty"]);
        check(&header(), &["line 1: no row has a tracked hand"]);
        check(
            &file(&["0,right,,,,,,,"]),
            &["line 1: no row has a tracked hand"],
        );
        let lacking = header()
            .replace("hand,", "")
            .replace("ring_tip_z", "ring_tip_x");
        check(
            &lacking,
            &[
                "line 1, column hand: the column is missing",
                "line 1, column ring_tip_x: the column is there more than once",
                "line 1, column ring_tip_z: the column is missing",
            ],
        );
        check(
            "a,b\n1,2\n3\n",
            &["line 1: 69 columns are missing, the first of them hand, t_s, wrist_x"],
        );
        let double = header().replacen("thumb_", "index_", 4 * 3);
        let error = read(&double).unwrap_err().to_string();
        assert!(
            error.starts_with(
                "line 1: 12 columns are missing, the first of them thumb_metacarpal_x,"
            ),
            "{error}"
        );
        assert_eq!(
            error.lines().count(),
            1 + 9,
            "and nine are there twice: {error}"
        );
    }

    #[test]
    fn a_file_cut_or_spoilt_anywhere_is_read_or_refused() {
        let text = write(&two_hands());
        let mut n_refused = 0;
        for cut in (0..text.len()).step_by(41) {
            n_refused += usize::from(read(&text[..cut]).is_err());
            for junk in ["\n", "\"", ",", "nan", "\u{0}", "é"] {
                let spoilt = format!("{}{junk}{}", &text[..cut], &text[cut..]);
                if let Ok(track) = read(&spoilt) {
                    assert_eq!(track.validate(), Ok(()));
                }
            }
        }
        assert!(n_refused > 30, "{n_refused}");
    }
}
