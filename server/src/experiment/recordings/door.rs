//! One door recording: a free bar of the lever's size, where the lever begins, and no gravity.
//!
//! Without gravity a bar that is pushed and left drifts away for good, which no lever does; so the recordings are played a
//! second time with a bar that stands until it is grasped first.

use std::path::Path;
use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};
use serde::Serialize;
use tsukamu_motion::import::adroit_body::AdroitBody;
use tsukamu_motion::import::adroit_reference::{DoorReference, door_references};
use tsukamu_world::hand::joint::Side;
use tsukamu_world::polyhedron::shapes;
use tsukamu_world::scene::{ObjectSpec, Scene};
use tsukamu_world::state::ContactState;

use super::pick::model;
use super::replay::{Hold, Replay, replay};
use super::{Play, RecordingsFault, Runs, SetReport, Stands, data, points_name};

/// Shortest hold that counts as a grasp, seconds: the reference's own rule, five rows.
pub const HOLD_MIN_S: f64 = 0.05;
/// Least way of a held bar that counts as carried, metres.
pub const CARRY_MIN_M: f64 = 0.05;
/// The lever (a capsule of radius 20 mm and half length 100 mm) as a bar, along the latch's x, metres.
const BAR_M: [f64; 3] = [0.24, 0.04, 0.04];
/// `latch_from_bar`: the lever's middle in the latch's space, y up, metres.
const LATCH_FROM_BAR_M: [f64; 3] = [0.1, 0.0, 0.15];

/// What came of one door recording. Times in seconds, lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DoorRun {
    /// The recording's name.
    pub demo: String,
    /// When the first hold began that lasted.
    pub grasp_s: Option<f64>,
    /// When the simulator's contacts with the lever were opposed first.
    pub reference_grasp_s: Option<f64>,
    /// When the last hold was over; `None` if it outlasts the recording, or there was none.
    pub release_s: Option<f64>,
    /// After the last contact with the lever; `None` if held to the end.
    pub reference_release_s: Option<f64>,
    /// Time in which the bar was held, all holds together.
    pub held_s: f64,
    /// Number of holds.
    pub n_holds: usize,
    /// The largest angle between two contact normals when the first hold that lasted began, degrees.
    pub angle_deg: Option<f64>,
    /// How far the bar had been pushed from its place before that hold.
    pub pushed_m: Option<f64>,
    /// Way of the bar while held.
    pub carried_m: f64,
    /// Share of the reference's frames with contact that have opposed contacts.
    pub reference_opposed_share: Option<f64>,
    /// Held for [`HOLD_MIN_S`] in one piece.
    pub grasped: bool,
    /// Grasped, and carried for [`CARRY_MIN_M`].
    pub carried: bool,
}

/// Plays all recordings of the set.
pub(super) fn play_all(
    folder: &Path,
    play: &Play,
    progress: &mut dyn FnMut(&str),
) -> Result<SetReport, RecordingsFault> {
    let table = data::reference_text(folder)?;
    let references = data::read(folder, "reference.csv", door_references(&table))?;
    let mut runs = Vec::new();
    let mut n_absent = 0;
    for reference in &references {
        let run = data::adroit_run(folder, &reference.demo, play.points, AdroitBody::Latch)?;
        let Some((track, path)) = run else {
            n_absent += 1;
            continue;
        };
        if let (Some(hand), Some(start)) = (track.hand(Side::Right), path.first()) {
            let scene = scene(&reference.demo, &start.pose, play.rate_hz)?;
            let replay = replay(&reference.demo, scene, &model(play), play.stands, hand)?;
            runs.push(judge(reference, &replay));
        }
        progress(&reference.demo);
    }
    let n_carried = runs.iter().filter(|run| run.carried).count();
    Ok(SetReport {
        set: play.set.name(),
        points: points_name(play.points),
        point_radius_m: play.point_radius_m,
        rate_hz: play.rate_hz,
        stands_until_grasped: play.stands == Stands::UntilGrasped,
        n_runs: runs.len(),
        n_grasped: runs.iter().filter(|run| run.grasped).count(),
        n_carried,
        carried_share: n_carried as f64 / runs.len().max(1) as f64,
        n_absent,
        runs: Runs::Door(runs),
    })
}

fn scene(
    demo: &str,
    world_from_latch: &Isometry3<f64>,
    rate_hz: f64,
) -> Result<Scene, RecordingsFault> {
    let bar = shapes::cuboid(&Vector3::from(BAR_M)).map_err(|fault| RecordingsFault::Scene {
        demo: demo.to_owned(),
        why: fault.to_string(),
    })?;
    let [x, y, z] = LATCH_FROM_BAR_M;
    let object = ObjectSpec {
        name: "bar".to_owned(),
        shape: Arc::new(bar),
        pose: world_from_latch * Isometry3::translation(x, y, z),
        grasp_angle: None,
        density: 1000.0,
        colour: [0.5; 3],
    };
    let gravity = Vector3::zeros();
    Ok(Scene {
        name: demo.to_owned(),
        rate_hz,
        gravity,
        objects: vec![object],
        ..Scene::default()
    })
}

fn judge(reference: &DoorReference, replay: &Replay) -> DoorRun {
    let length_s = |hold: &Hold| hold.until_s.unwrap_or_else(|| replay.end_s()) - hold.from_s;
    let first = replay
        .holds
        .iter()
        .find(|hold| length_s(hold) >= HOLD_MIN_S);
    let last = replay.holds.last();
    let place = |t_s: f64| replay.at(t_s).map(|moment| moment.pose.translation.vector);
    let start = replay
        .moments
        .first()
        .map(|moment| moment.pose.translation.vector);
    let steps = replay.moments.windows(2).filter(|pair| {
        pair.iter()
            .all(|moment| moment.contact == ContactState::Grasped)
    });
    let carried_m = steps
        .map(|pair| (pair[1].pose.translation.vector - pair[0].pose.translation.vector).norm())
        .fold(0.0, |sum, way_m| sum + way_m);
    DoorRun {
        demo: reference.demo.clone(),
        grasp_s: first.map(|hold| hold.from_s),
        reference_grasp_s: reference.t_grasp_s,
        release_s: last.and_then(|hold| hold.until_s),
        reference_release_s: reference.t_release_s,
        held_s: replay
            .holds
            .iter()
            .map(length_s)
            .fold(0.0, |sum, length_s| sum + length_s),
        n_holds: replay.holds.len(),
        angle_deg: first.map(|hold| hold.angle.to_degrees()),
        pushed_m: first.and_then(|hold| Some((place(hold.from_s)? - start?).norm())),
        carried_m,
        reference_opposed_share: reference.contact_opp90_frac,
        grasped: first.is_some(),
        carried: first.is_some() && carried_m >= CARRY_MIN_M,
    }
}
