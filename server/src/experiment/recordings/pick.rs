//! One pick run: a free object on the floor, where the run's object begins.

use std::path::Path;
use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};
use serde::Serialize;
use tsukamu_motion::import::adroit_body::{AdroitBody, BodyRow};
use tsukamu_motion::import::adroit_reference::{
    AdroitObject, OBJECT_MASS_KG, PickReference, pick_references,
};
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::polyhedron::{Polyhedron, shapes};
use tsukamu_world::scene::{ObjectSpec, Scene};
use tsukamu_world::state::ContactState;

use super::replay::{Replay, reference_place, replay};
use super::{Play, RecordingsFault, Runs, SetReport, Stands, data, points_name};

/// Least height above its start at which an object counts as lifted, metres.
pub const LIFT_MIN_M: f64 = 0.05;
/// How long before the end of the reference's hold the object must be held, seconds: a row of the recording.
pub const HOLD_MARGIN_S: f64 = 0.010;

/// What came of one pick run. Times in seconds, lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PickRun {
    /// The run's name.
    pub demo: String,
    /// When the object was grasped first.
    pub grasp_s: Option<f64>,
    /// When the simulator's contacts were opposed first.
    pub reference_grasp_s: Option<f64>,
    /// When the last hold that began before the reference's end was over; `None` if it was never, or never held.
    pub release_s: Option<f64>,
    /// When the simulator's contacts were opposed no more; `None` if held to the end.
    pub reference_release_s: Option<f64>,
    /// How often the object was let go of before the end of the reference's hold.
    pub n_lost: usize,
    /// How far it rose above its start before the end of the reference's hold.
    pub lift_m: f64,
    /// Distance from the reference's object when that leaves the table: what pushing before the grasp has made of it.
    pub lift_error_m: Option<f64>,
    /// Distance from the reference's object while both are held off the table, root mean square.
    pub path_error_rms_m: Option<f64>,
    /// The same at worst.
    pub path_error_max_m: Option<f64>,
    /// The floor for any geometric grasp: the reference's object against one glued to the palm, root mean square.
    pub rigid_error_rms_m: Option<f64>,
    /// The same at worst.
    pub rigid_error_max_m: Option<f64>,
    /// Grasped at all.
    pub grasped: bool,
    /// Grasped, lifted and carried to the end of the reference's hold.
    pub carried: bool,
}

/// Plays all runs of the set.
pub(super) fn play_all(
    folder: &Path,
    play: &Play,
    progress: &mut dyn FnMut(&str),
) -> Result<SetReport, RecordingsFault> {
    let table = data::reference_text(folder)?;
    let references = data::read(folder, "reference.csv", pick_references(&table))?;
    let mut runs = Vec::new();
    let mut n_absent = 0;
    for reference in &references {
        let run = data::adroit_run(folder, &reference.demo, play.points, AdroitBody::Object)?;
        let Some((track, path)) = run else {
            n_absent += 1;
            continue;
        };
        if let (Some(hand), Some(start)) = (track.hand(Side::Right), path.first()) {
            let scene = scene(reference, &start.pose, play.rate_hz)?;
            let replay = replay(&reference.demo, scene, &model(play), play.stands, hand)?;
            runs.push(judge(reference, &replay, &path));
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
        runs: Runs::Pick(runs),
    })
}

/// The hand of a play.
pub(super) fn model(play: &Play) -> HandModel {
    HandModel {
        point_radius: play.point_radius_m,
        ..HandModel::adult(Side::Right)
    }
}

fn solid(object: AdroitObject) -> Result<Polyhedron, tsukamu_world::polyhedron::fault::ShapeFault> {
    let half = Vector3::from(object.half_extents_m());
    match object {
        AdroitObject::Ball => shapes::ellipsoid(&half),
        AdroitObject::Cube | AdroitObject::Brick => shapes::cuboid(&(half * 2.0)),
    }
}

fn scene(
    reference: &PickReference,
    start: &Isometry3<f64>,
    rate_hz: f64,
) -> Result<Scene, RecordingsFault> {
    let refused = |why: String| RecordingsFault::Scene {
        demo: reference.demo.clone(),
        why,
    };
    let shape = solid(reference.object).map_err(|fault| refused(fault.to_string()))?;
    let mut pose = *start;
    // The simulator's contacts are soft: its objects begin a little inside the table.
    let lowest = shape
        .vertices()
        .iter()
        .map(|vertex| (pose * vertex).y)
        .fold(f64::INFINITY, f64::min);
    pose.translation.y -= lowest.min(0.0);
    let [x, y, z] = reference.object.half_extents_m();
    let object = ObjectSpec {
        name: reference.object.name().to_owned(),
        shape: Arc::new(shape),
        pose,
        grasp_angle: None,
        density: OBJECT_MASS_KG / (8.0 * x * y * z),
        colour: [0.5; 3],
    };
    Ok(Scene {
        name: reference.demo.clone(),
        rate_hz,
        objects: vec![object],
        ..Scene::default()
    })
}

fn judge(reference: &PickReference, replay: &Replay, path: &[BodyRow]) -> PickRun {
    let end_s = reference.t_grasp_end_s.unwrap_or_else(|| replay.end_s());
    let judged_s = end_s - HOLD_MARGIN_S;
    let until_end = || {
        replay
            .moments
            .iter()
            .take_while(|moment| moment.t_s <= judged_s)
    };
    let start = path.first().map_or(0.0, |row| row.pose.translation.y);
    let lift_m = until_end()
        .map(|moment| moment.pose.translation.y - start)
        .fold(0.0, f64::max);
    let held_at_end = replay
        .at(judged_s)
        .is_some_and(|moment| moment.contact == ContactState::Grasped);
    let lifted_s = reference.t_lift_s.unwrap_or(f64::INFINITY);
    let together = until_end()
        .filter(|moment| moment.t_s > lifted_s && moment.contact == ContactState::Grasped);
    let errors: Vec<f64> = together
        .filter_map(|moment| {
            Some(
                (moment.pose.translation.vector - reference_place(path, moment.t_s)?.coords).norm(),
            )
        })
        .collect();
    let rms =
        (errors.iter().map(|error| error * error).sum::<f64>() / errors.len().max(1) as f64).sqrt();
    let known = !errors.is_empty();
    let lost = replay
        .holds
        .iter()
        .filter(|hold| hold.until_s.is_some_and(|until| until <= judged_s));
    PickRun {
        demo: reference.demo.clone(),
        grasp_s: replay.holds.first().map(|hold| hold.from_s),
        reference_grasp_s: reference.t_grasp_s,
        release_s: replay.hold_at(judged_s).and_then(|hold| hold.until_s),
        reference_release_s: reference.t_grasp_end_s,
        n_lost: lost.count(),
        lift_m,
        lift_error_m: errors.first().copied(),
        path_error_rms_m: known.then_some(rms),
        path_error_max_m: errors.iter().copied().reduce(f64::max),
        rigid_error_rms_m: reference.rigid_err_rms_m,
        rigid_error_max_m: reference.rigid_err_max_m,
        grasped: !replay.holds.is_empty(),
        carried: held_at_end && lift_m > LIFT_MIN_M,
    }
}
