//! How far off predictions are, on recorded and on synthetic hands. `--nocapture` prints the table.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nalgebra::Isometry3;
use tsukamu_motion::import::adroit::{self, AdroitOptions, AdroitPoints};
use tsukamu_motion::import::leap::{self, LeapOptions};
use tsukamu_motion::synthetic::{SceneInfo, build};
use tsukamu_motion::track::{GAP_MAX_S, TrackHand};
use tsukamu_world::hand::sample::{JointAngles, ThumbAngles};

use super::super::moving::sizes;
use super::*;
use crate::emulate::wearing::joint_angles_of;
use crate::scene_file::load;

/// Leads that are looked at, in seconds.
const LEADS_S: [f64; 6] = [0.01, 0.02, 0.03, 0.05, 0.075, 0.1];

/// Angles of four fingers.
const N_FINGER_ANGLES: f64 = 16.0;

/// Sums of squared errors at one lead, of a change's two kinds.
#[derive(Clone, Copy, Default)]
struct Sum {
    n: f64,
    predicted: [f64; 2],
    still: [f64; 2],
}

/// The errors of predicting a stream of samples, at each lead. The truth is the recording itself, straight between samples.
fn errors<T: Moving<N>, const N: usize>(
    runs: &[Vec<(f64, T)>],
    habit: Habit,
) -> [Sum; LEADS_S.len()] {
    let mut sums = [Sum::default(); LEADS_S.len()];
    for run in runs {
        let mut trend = Trend::new(habit);
        for (k, (time_s, value)) in run.iter().enumerate() {
            let is_joined = k > 0 && time_s - run[k - 1].0 <= GAP_MAX_S;
            if !is_joined {
                trend.forget();
            }
            trend.push((time_s * 1.0e9) as i64, value);
            for (sum, lead_s) in sums.iter_mut().zip(LEADS_S) {
                let Some(truth) = truth_at(&run[k..], time_s + lead_s) else {
                    continue;
                };
                sum.n += 1.0;
                let squares = |from: &T| sizes::<T, N>(&truth.change_from(from)).map(|x| x * x);
                for (kind, square) in squares(&trend.ahead(value, lead_s)).into_iter().enumerate() {
                    sum.predicted[kind] += square;
                }
                for (kind, square) in squares(value).into_iter().enumerate() {
                    sum.still[kind] += square;
                }
            }
        }
    }
    sums
}

fn truth_at<T: Moving<N>, const N: usize>(rest: &[(f64, T)], time_s: f64) -> Option<T> {
    let after = rest.partition_point(|(time, _)| *time < time_s);
    let ((start, from), (end, to)) = (rest.get(after.checked_sub(1)?)?, rest.get(after)?);
    let is_whole = rest[..=after]
        .windows(2)
        .all(|pair| pair[1].0 - pair[0].0 <= GAP_MAX_S);
    is_whole.then(|| from.toward(to, (time_s - start) / (end - start)))
}

type Wrists = Vec<Vec<(f64, Isometry3<f64>)>>;
type Fingers = Vec<Vec<(f64, JointAngles)>>;

fn streams(hands: &[TrackHand]) -> (Wrists, Fingers) {
    let wrists = hands.iter().map(|hand| {
        let samples = hand.times_s.iter().zip(&hand.samples);
        samples
            .map(|(time, sample)| (*time, sample.wrist))
            .collect()
    });
    // Without the thumb: told from points, the two angles of its saddle joint flip where it lies along an axis.
    let four = |angles: JointAngles| JointAngles {
        thumb: ThumbAngles::default(),
        ..angles
    };
    let fingers = hands.iter().map(|hand| {
        let samples = hand.times_s.iter().zip(&hand.samples);
        let angles = |sample| joint_angles_of(sample, hand.side).map(four);
        samples
            .filter_map(|(time, sample)| Some((*time, angles(sample)?)))
            .collect()
    });
    (wrists.collect(), fingers.collect())
}

/// Root mean squares in mm, ° of rotation and ° per joint at each lead: (predicted, still).
fn table(
    name: &str,
    (wrists, fingers): &(Wrists, Fingers),
    text: &mut String,
) -> Vec<[(f64, f64); 3]> {
    let (wrist, finger) = (errors(wrists, WRIST), errors(fingers, FINGERS));
    let mut rows = Vec::new();
    for ((lead_s, wrist), finger) in LEADS_S.iter().zip(wrist).zip(finger) {
        let rms = |sum: &Sum, kind: usize, scale: f64| {
            let of = |squares: [f64; 2]| scale * (squares[kind] / sum.n).sqrt();
            (of(sum.predicted), of(sum.still))
        };
        let degrees = 1.0_f64.to_degrees();
        let per_joint = degrees / N_FINGER_ANGLES.sqrt();
        let row = [
            rms(&wrist, 0, 1000.0),
            rms(&wrist, 1, degrees),
            rms(&finger, 0, per_joint),
        ];
        writeln!(
            text,
            "{name:10} {:3.0} ms  wrist {:6.2} ({:6.2}) mm {:5.2} ({:5.2}) deg  joint {:5.2} ({:5.2}) deg",
            lead_s * 1000.0,
            row[0].0, row[0].1, row[1].0, row[1].1, row[2].0, row[2].1,
        )
        .expect("a string takes every text");
        rows.push(row);
    }
    rows
}

#[expect(
    clippy::print_stderr,
    reason = "the table is for whoever runs the test"
)]
fn show(text: &str) {
    eprintln!("rms error with prediction (without)\n{text}");
}

/// The folder beside the workspace that the recorded sets are in, if it is there; a line says so where it is not.
#[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
fn shared_data() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: the recorded sets are not here");
    None
}

/// Every track of the folder's CSV files that an importer can read.
fn recorded(folder: &Path, read: impl Fn(&str) -> Option<Vec<TrackHand>>) -> Vec<TrackHand> {
    let files = std::fs::read_dir(folder).unwrap();
    let texts = files.filter_map(|file| std::fs::read_to_string(file.unwrap().path()).ok());
    texts.filter_map(|text| read(&text)).flatten().collect()
}

#[test]
fn recorded_hands_are_predicted_better_than_not() {
    let Some(data) = shared_data() else { return };
    let adroit = |text: &str| {
        let points = AdroitPoints::Reached;
        let track = adroit::import(text, &AdroitOptions { points }).ok()?;
        Some(track.hands)
    };
    let leap = |text: &str| Some(leap::import(text, &LeapOptions::default()).ok()?.hands);
    let mut text = String::new();
    for (name, hands) in [
        ("door", recorded(&data.join("adroit_door_human"), adroit)),
        ("leap", recorded(&data.join("leap_hand"), leap)),
    ] {
        assert!(hands.len() >= 5, "{name}: {}", hands.len());
        let rows = table(name, &streams(&hands), &mut text);
        for (row, lead_s) in rows.iter().zip(LEADS_S) {
            // Beyond, hands change their mind.
            for (predicted, still) in row.iter().filter(|_| lead_s <= 0.05) {
                assert!(
                    predicted < still,
                    "{name} {lead_s} s: {predicted}, {still}\n{text}"
                );
            }
        }
    }
    show(&text);
}

#[test]
fn synthetic_hands_are_predicted_better_than_not() {
    let mut text = String::new();
    for (scene, spec) in [
        ("operations/free", "free"),
        ("operations/grasp-throw", "grasp-throw"),
    ] {
        let hand = build(spec, &SceneInfo::from(&load(scene).unwrap().scene)).unwrap();
        let track = hand.track(100.0).hands;
        let rows = table(spec, &streams(&track), &mut text);
        for (row, lead_s) in rows.iter().zip(LEADS_S) {
            for (predicted, still) in row.iter().filter(|_| lead_s <= 0.05) {
                assert!(
                    predicted <= still,
                    "{spec} {lead_s} s: {predicted}, {still}"
                );
            }
        }
    }
    show(&text);
}

#[test]
fn a_steady_motion_is_predicted_and_a_bound_is_kept() {
    let place = |x: f64| Isometry3::translation(x, 0.0, 0.0);
    let mut trend = Trend::new(WRIST);
    for k in 0..100_i64 {
        trend.push(k * 10_000_000, &place(0.01 * k as f64));
    }
    let ahead = |lead_s: f64| trend.ahead(&place(0.99), lead_s).translation.x - 0.99;
    assert_eq!(ahead(0.0), 0.0);
    assert!((ahead(0.02) - 0.02).abs() < 0.0012, "{}", ahead(0.02));
    assert!(
        ahead(0.1) < 0.1 && ahead(0.1) > 0.07,
        "damped: {}",
        ahead(0.1)
    );
    assert_eq!(ahead(5.0), ahead(LEAD_MAX_S), "bounded");
}
