use std::path::{Path, PathBuf};

use super::*;

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

fn played(data: PathBuf, play: Play) -> SetReport {
    let report = run(
        &RecordingsOptions {
            data: Some(data),
            plays: vec![play],
        },
        |_| {},
    )
    .unwrap();
    report.sets.into_iter().next().unwrap()
}

#[test]
fn four_in_five_pick_runs_are_carried() {
    let Some(data) = shared_data() else { return };
    let set = played(data, Play::reached(SetName::Pick));
    assert!(set.n_runs >= 36, "{}", set.n_runs);
    assert!(
        set.carried_share >= 0.8,
        "{} of {}",
        set.n_carried,
        set.n_runs
    );
    let Runs::Pick(runs) = &set.runs else {
        panic!("pick runs")
    };
    for run in runs.iter().filter(|run| run.carried) {
        assert!(
            run.lift_m > pick::LIFT_MIN_M && run.grasp_s < run.release_s.or(Some(f64::INFINITY)),
            "{}",
            run.demo
        );
        assert!(run.path_error_rms_m <= run.path_error_max_m, "{}", run.demo);
    }
}

#[test]
fn the_project_s_own_sample_is_carried() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data");
    let set = played(data, Play::reached(SetName::Pick));
    assert!(
        set.n_runs >= 1 && set.n_carried == set.n_runs,
        "{} of {}",
        set.n_carried,
        set.n_runs
    );
}

#[test]
fn most_levers_are_grasped() {
    let Some(data) = shared_data() else { return };
    let set = played(data, Play::commanded(SetName::Door));
    assert!(set.n_runs >= 15);
    assert!(
        2 * set.n_grasped > set.n_runs,
        "{} of {}",
        set.n_grasped,
        set.n_runs
    );
    let text = RecordingsReport { sets: vec![set] }.to_string();
    assert!(
        text.contains("door_01") && text.contains("without gravity"),
        "{text}"
    );
}

#[test]
fn absent_recordings_are_said_to_be_absent() {
    let check = |data: &Path, expected: &str| {
        let options = RecordingsOptions {
            data: Some(data.to_owned()),
            plays: vec![Play::reached(SetName::Pick)],
        };
        let fault = run(&options, |_| {}).unwrap_err().to_string();
        assert!(fault.contains(expected), "{fault}");
    };
    check(Path::new("no/such/folder"), "--data DIR");
    check(
        Path::new(env!("CARGO_MANIFEST_DIR")),
        "the set pick is read from it",
    );
}

#[test]
fn a_radius_out_of_bounds_is_refused() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data");
    let play = Play {
        point_radius_m: 1.0,
        ..Play::reached(SetName::Pick)
    };
    let fault = run(
        &RecordingsOptions {
            data: Some(data),
            plays: vec![play],
        },
        |_| {},
    )
    .unwrap_err();
    assert!(fault.to_string().contains("point_radius is 1 m"), "{fault}");
}
