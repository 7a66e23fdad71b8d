//! The Adroit sets: a simulated right hand with 24 joints, 100 rows per second, z up.
//!
//! The palm's origin is the wrist's flexion axis and is taken as the wrist. Positions turn from (x, y, z) to
//! (x, z, -y); the table top stays the plane y = 0.

use tsukamu_world::hand::sample::{FingerPose, HandSample};

use super::{wrist_of_palm, y_up_point};
use crate::mistake::{ImportError, Mistakes};
use crate::rows::{HandColumns, RawRow, anatomical_name, hand_rows, track_of};
use crate::table::Table;
use crate::track::HandTrack;

/// What to take from an Adroit file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AdroitOptions {
    /// Which joint places.
    pub points: AdroitPoints,
}

/// Which joint places of an Adroit file make the hand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AdroitPoints {
    /// Where the simulated fingers were; they stop at the object's surface.
    #[default]
    Reached,
    /// Where the glove or the policy asked them to be, inside the object while it is held.
    /// The first row of the pick runs has none: its joints are not tracked.
    Commanded,
}

/// Reads an Adroit file of either set.
///
/// # Errors
/// Every mistake with its line and column, up to a limit.
pub fn import(text: &str, options: &AdroitOptions) -> Result<HandTrack, ImportError> {
    let mut mistakes = Mistakes::default();
    let table = Table::read(text, &mut mistakes)?;
    let prefix = match options.points {
        AdroitPoints::Reached => "",
        AdroitPoints::Commanded => "cmd_",
    };
    let name = |joint| anatomical_name(prefix, joint);
    let columns = HandColumns::find(&table, "palm", name, &mut mistakes);
    mistakes.check_header()?;
    let rows = hand_rows(&table, &columns, &mut mistakes);
    track_of(rows, "t_s", sample, mistakes)
}

fn sample(row: &RawRow) -> HandSample {
    let points = row.points.map(|point| point.map(|p| y_up_point(&p)));
    HandSample {
        wrist: wrist_of_palm(&row.body),
        fingers: FingerPose::Points(points),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use tsukamu_world::hand::joint::{Finger, JointId, N_JOINTS, Side};

    use super::super::tests::{own_data, shared_data};
    use super::*;
    use crate::hand_csv;

    const COMMANDED: AdroitOptions = AdroitOptions {
        points: AdroitPoints::Commanded,
    };

    fn points(sample: &HandSample) -> &[Option<Point3<f64>>; N_JOINTS] {
        match &sample.fingers {
            FingerPose::Points(points) => points,
            FingerPose::Angles(_) => panic!("importers give points"),
        }
    }

    /// In the wrist's space a right hand has its fingers at -z and its thumb at -x, all knuckles near the palm's plane.
    fn check_is_a_right_hand(sample: &HandSample) {
        let place = |finger, step| {
            let point = points(sample)[JointId::of(finger, step).index()].unwrap();
            sample.wrist.inverse_transform_point(&point)
        };
        let (index, little) = (place(Finger::Index, 0), place(Finger::Little, 0));
        assert!(
            index.z < -0.08 && index.z > -0.12 && index.x < -0.02,
            "{index}"
        );
        assert!(little.z < -0.06 && little.x > 0.02, "{little}");
        assert!(place(Finger::Thumb, 0).x < -0.02);
        assert!((place(Finger::Middle, 1) - place(Finger::Middle, 0)).norm() > 0.04);
    }

    fn check_run(text: &str, n_rows: usize) {
        let reached = import(text, &AdroitOptions::default()).unwrap();
        let commanded = import(text, &COMMANDED).unwrap();
        for track in [&reached, &commanded] {
            assert_eq!(track.validate(), Ok(()));
            assert_eq!((track.hands.len(), track.hands[0].side), (1, Side::Right));
            assert_eq!(track.hands[0].times_s.len(), n_rows);
            assert!((track.duration_s() - 0.01 * (n_rows - 1) as f64).abs() < 1e-9);
            check_is_a_right_hand(&track.hands[0].samples[n_rows / 2]);
            assert_eq!(hand_csv::read(&hand_csv::write(track)).as_ref(), Ok(track));
        }
        assert!(
            points(&reached.hands[0].samples[0])
                .iter()
                .all(Option::is_some)
        );
    }

    #[test]
    fn the_sampled_runs_are_read() {
        for (name, n_rows) in [("cube_carry_07", 201), ("ball_throw_01", 221)] {
            let text = own_data(&format!("adroit_pick_policy/{name}.csv"));
            check_run(&text, n_rows);
            let commanded = import(&text, &COMMANDED).unwrap();
            assert!(
                points(&commanded.hands[0].samples[0])
                    .iter()
                    .all(Option::is_none)
            );
            assert!(
                points(&commanded.hands[0].samples[1])
                    .iter()
                    .all(Option::is_some)
            );
        }
        let track = import(
            &own_data("adroit_pick_policy/cube_carry_07.csv"),
            &AdroitOptions::default(),
        )
        .unwrap();
        let first = &track.hands[0].samples[0];
        // palm_x, palm_y, palm_z = 0, -0.27, 0.20034 with z up; index_tip = -0.033, -0.079, 0.2004.
        assert_eq!(
            first.wrist.translation.vector.as_slice(),
            [0.0, 0.20034, 0.27]
        );
        assert_eq!(points(first)[7], Some(Point3::new(-0.033, 0.2004, 0.079)));
    }

    #[test]
    fn a_door_recording_is_read() {
        if let Some(text) = shared_data("adroit_door_human/door_01.csv") {
            check_run(&text, 300);
        }
    }

    #[test]
    fn mistakes_are_named() {
        let text = own_data("adroit_pick_policy/cube_carry_07.csv");
        let spoilt =
            text.replacen("palm_qw", "palm_w", 1)
                .replacen("cmd_index_tip_y", "index_tip_yy", 1);
        let error = import(&spoilt, &COMMANDED).unwrap_err().to_string();
        assert_eq!(
            error,
            "line 1, column palm_qw: the column is missing\nline 1, column cmd_index_tip_y: the column is missing"
        );
    }
}
