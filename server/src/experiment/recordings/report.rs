//! The tables.

use std::fmt;

use super::door::DoorRun;
use super::pick::PickRun;
use super::{Runs, SetReport};
use crate::experiment::table::{Lean, NONE, Table, number};

/// A set's headline and its table.
pub(super) fn write(set: &SetReport, out: &mut fmt::Formatter<'_>) -> fmt::Result {
    let SetReport {
        set: name,
        points,
        rate_hz,
        n_runs,
        n_grasped,
        n_carried,
        ..
    } = set;
    let radius = set.point_radius_m * 1000.0;
    writeln!(
        out,
        "{name}: {points} points of radius {radius:.1} mm, {rate_hz} steps/s"
    )?;
    match &set.runs {
        Runs::Pick(runs) => write!(out, "{}", pick_table(runs))?,
        Runs::Door(runs) => {
            let free = if set.stands_until_grasped {
                "from the first grasp on"
            } else {
                "from the start"
            };
            writeln!(
                out,
                "a bar of the lever's size, free {free}, without gravity"
            )?;
            write!(out, "{}", door_table(runs))?;
        }
    }
    let share = 100.0 * set.carried_share;
    writeln!(
        out,
        "grasped {n_grasped} of {n_runs}, grasped and carried {n_carried} of {n_runs} ({share:.0} %)"
    )?;
    if set.n_absent > 0 {
        writeln!(
            out,
            "{} more runs are named in reference.csv but are not there",
            set.n_absent
        )?;
    }
    Ok(())
}

fn milli(value: Option<f64>) -> String {
    number(value.map(|value| value * 1000.0), 1)
}

/// Ours minus the reference's, in milliseconds with a sign.
fn later(own: Option<f64>, reference: Option<f64>) -> String {
    match (own, reference) {
        (Some(own), Some(reference)) => format!("{:+.0}", (own - reference) * 1000.0),
        _ => NONE.to_owned(),
    }
}

fn pick_table(runs: &[PickRun]) -> Table {
    let right = Lean::Right;
    let mut table = Table::new(&[
        ("run", Lean::Left),
        ("grasp s", right),
        ("reference s", right),
        ("later ms", right),
        ("release s", right),
        ("reference s", right),
        ("later ms", right),
        ("lost", right),
        ("lift cm", right),
        ("path error mm at lift", right),
        ("rms", right),
        ("max", right),
        ("rigid rms mm", right),
        ("max", right),
        ("verdict", Lean::Left),
    ]);
    for run in runs {
        table.add(vec![
            run.demo.clone(),
            number(run.grasp_s, 3),
            number(run.reference_grasp_s, 2),
            later(run.grasp_s, run.reference_grasp_s),
            number(run.release_s, 3),
            number(run.reference_release_s, 2),
            later(run.release_s, run.reference_release_s),
            run.n_lost.to_string(),
            format!("{:.1}", run.lift_m * 100.0),
            milli(run.lift_error_m),
            milli(run.path_error_rms_m),
            milli(run.path_error_max_m),
            milli(run.rigid_error_rms_m),
            milli(run.rigid_error_max_m),
            verdict(run.grasp_s, run.carried).to_owned(),
        ]);
    }
    table
}

fn door_table(runs: &[DoorRun]) -> Table {
    let right = Lean::Right;
    let mut table = Table::new(&[
        ("recording", Lean::Left),
        ("grasp s", right),
        ("reference s", right),
        ("later ms", right),
        ("release s", right),
        ("reference s", right),
        ("held s", right),
        ("holds", right),
        ("angle °", right),
        ("pushed cm", right),
        ("carried cm", right),
        ("reference opposed %", right),
        ("verdict", Lean::Left),
    ]);
    for run in runs {
        table.add(vec![
            run.demo.clone(),
            number(run.grasp_s, 3),
            number(run.reference_grasp_s, 2),
            later(run.grasp_s, run.reference_grasp_s),
            number(run.release_s, 3),
            number(run.reference_release_s, 2),
            format!("{:.2}", run.held_s),
            run.n_holds.to_string(),
            number(run.angle_deg, 0),
            number(run.pushed_m.map(|way| way * 100.0), 1),
            format!("{:.1}", run.carried_m * 100.0),
            number(run.reference_opposed_share.map(|share| share * 100.0), 0),
            verdict(run.grasp_s, run.carried).to_owned(),
        ]);
    }
    table
}

/// What a run came to, given when it was grasped, in seconds.
const fn verdict(grasp_s: Option<f64>, carried: bool) -> &'static str {
    match (grasp_s, carried) {
        (_, true) => "carried",
        (Some(_), false) => "grasped only",
        (None, false) => "not grasped",
    }
}
