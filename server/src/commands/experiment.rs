//! `tsukamud experiment`

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, Subcommand, ValueEnum};
use serde::Serialize;
use tsukamu_server::experiment::cost::{self, CostOptions};
use tsukamu_server::experiment::operations;
use tsukamu_server::experiment::recordings::{self, Play, RecordingsOptions, SetName, Stands};
use tsukamu_server::experiment::transitions::{self, Transitions};
use tsukamu_server::record::reader;

use super::Failure;
use super::given::{ensure_recording, rate};
use super::output::{progress_bar, say, tell};

/// Arguments of `tsukamud experiment`.
#[derive(Debug, Args)]
pub(super) struct ExperimentArgs {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(Debug, Subcommand)]
enum Experiment {
    /// Play recorded hands onto objects: the share in which the object is grasped and carried.
    Recordings(RecordingsArgs),
    /// Run the five operations and the target game, and compare with the paper.
    Operations(OperationsArgs),
    /// Draw how hands touch each object over time (Fig. 12).
    Transitions(TransitionsArgs),
    /// Measure steps per second against the number of objects (Fig. 13).
    Cost(CostArgs),
}

#[derive(Debug, Args)]
struct RecordingsArgs {
    /// The folder of the recorded sets. Default: shared/data in the working directory or above it.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Which set. `all` plays both, the pick runs with reached and with commanded points.
    #[arg(long, value_enum, default_value_t = Set::All)]
    set: Set,
    /// Which finger points. Default: reached for pick, commanded for door (with a bar that is free from the start, and
    /// with one that is free from its first grasp on).
    #[arg(long, value_enum)]
    points: Option<Points>,
    /// Radius of the judgement points in metres, 0 to 0.05. Default: 0.010 for reached points, 0 for commanded ones.
    #[arg(long, value_name = "M")]
    point_radius: Option<f64>,
    /// Steps per second, 1 to 4000.
    #[arg(long, alias = "rate-hz", value_name = "HZ", value_parser = rate, allow_negative_numbers = true, default_value_t = recordings::RATE_HZ)]
    rate: f64,
    /// Print one JSON object in place of the tables.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Set {
    /// Simulated pick runs.
    Pick,
    /// People at a door.
    Door,
    /// Both.
    All,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Points {
    /// Where the fingers were.
    Reached,
    /// Where the fingers were asked to be.
    Commanded,
}

#[derive(Debug, Args)]
struct OperationsArgs {
    /// Steps per second, 1 to 4000, in place of the scenes'.
    #[arg(long, alias = "rate-hz", value_name = "HZ", value_parser = rate, allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Print one JSON object in place of the table.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct TransitionsArgs {
    /// A recording; or name a scene with --scene.
    #[arg(
        value_name = "FILE.mcap",
        required_unless_present = "scene",
        conflicts_with = "scene"
    )]
    file: Option<PathBuf>,
    /// A built-in scene or a scene file, played with its own hands.
    #[arg(long, value_name = "S")]
    scene: Option<String>,
    /// Steps per second, 1 to 4000, in place of the scene's.
    #[arg(long, alias = "rate-hz", value_name = "HZ", value_parser = rate, allow_negative_numbers = true, requires = "scene")]
    rate: Option<f64>,
    /// The picture; a file that is there is replaced.
    #[arg(short, long, value_name = "OUT.svg")]
    output: Option<PathBuf>,
    /// Print one JSON object in place of the table.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct CostArgs {
    /// Write cost.json and cost.svg into this folder; files that are there are replaced.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Fewer numbers of objects, shorter repeats.
    #[arg(long)]
    quick: bool,
    /// Print one JSON object in place of the table.
    #[arg(long)]
    json: bool,
}

/// Carries an experiment out.
pub(super) fn experiment(args: ExperimentArgs) -> Result<(), Failure> {
    match args.experiment {
        Experiment::Recordings(args) => recordings(&args),
        Experiment::Operations(args) => operations(&args),
        Experiment::Transitions(args) => transitions(&args),
        Experiment::Cost(args) => cost(&args),
    }
}

fn recordings(args: &RecordingsArgs) -> Result<(), Failure> {
    let options = RecordingsOptions {
        data: args.data.clone(),
        plays: plays(args),
    };
    let bar = progress_bar(0, "runs");
    let report = recordings::run(&options, |_| bar.inc(1))?;
    bar.finish_and_clear();
    show(&report, &report.to_string(), args.json)
}

fn plays(args: &RecordingsArgs) -> Vec<Play> {
    let mut plays: Vec<Play> = match (args.set, args.points) {
        (Set::Pick, None) => vec![Play::reached(SetName::Pick)],
        (Set::Door, None) => doors().to_vec(),
        (Set::All, None) => {
            let picks = [Play::reached(SetName::Pick), Play::commanded(SetName::Pick)];
            picks.into_iter().chain(doors()).collect()
        }
        (set, Some(points)) => sets(set).iter().map(|set| play(*set, points)).collect(),
    };
    for play in &mut plays {
        play.rate_hz = args.rate;
        play.point_radius_m = args.point_radius.unwrap_or(play.point_radius_m);
    }
    plays
}

/// A bar that is free all the time, and one that stands like a lever until it is grasped.
const fn doors() -> [Play; 2] {
    let free = Play::commanded(SetName::Door);
    [
        free,
        Play {
            stands: Stands::UntilGrasped,
            ..free
        },
    ]
}

const fn sets(set: Set) -> &'static [SetName] {
    match set {
        Set::Pick => &[SetName::Pick],
        Set::Door => &[SetName::Door],
        Set::All => &[SetName::Pick, SetName::Door],
    }
}

const fn play(set: SetName, points: Points) -> Play {
    match points {
        Points::Reached => Play::reached(set),
        Points::Commanded => Play::commanded(set),
    }
}

fn operations(args: &OperationsArgs) -> Result<(), Failure> {
    let bar = progress_bar(operations::OPERATIONS.len() as u64, "scenes");
    let report = operations::run(args.rate, |_| bar.inc(1))?;
    bar.finish_and_clear();
    show(&report, &report.to_string(), args.json)?;
    if report.operations.iter().all(|operation| operation.agrees) {
        Ok(())
    } else {
        Err(Failure::Negative)
    }
}

fn transitions(args: &TransitionsArgs) -> Result<(), Failure> {
    let found = match (&args.file, &args.scene) {
        (Some(file), _) => of_file(file)?,
        (None, Some(scene)) => transitions::of_scene(scene, args.rate)?,
        (None, None) => return Err(Failure::Usage("name a recording or a scene".to_owned())),
    };
    if let Some(path) = &args.output {
        write(path, &transitions::chart::draw(&found)?)?;
    }
    show(&found, found.to_string().trim_end(), args.json)
}

fn of_file(file: &Path) -> Result<Transitions, Failure> {
    ensure_recording(file)?;
    let recording = reader::open(file)?;
    let bar = progress_bar(std::fs::metadata(file)?.len(), "bytes");
    let title = file
        .file_name()
        .unwrap_or(file.as_os_str())
        .to_string_lossy();
    let found = transitions::of_recording(&title, recording, |n_read| bar.set_position(n_read));
    bar.finish_and_clear();
    Ok(found.with_context(|| file.display().to_string())?)
}

fn cost(args: &CostArgs) -> Result<(), Failure> {
    if cfg!(debug_assertions) {
        tell("this is a debug build: a release build (cargo run --release) is many times as fast");
    }
    let options = CostOptions { quick: args.quick };
    let bar = progress_bar(options.loads().len() as u64, "measurements");
    let report = cost::run(options, |done, _| bar.set_position(done as u64))?;
    bar.finish_and_clear();
    if let Some(folder) = &args.output {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        write(
            &folder.join("cost.json"),
            &serde_json::to_string_pretty(&report)?,
        )?;
        write(&folder.join("cost.svg"), &cost::chart::draw(&report)?)?;
    }
    show(&report, &report.to_string(), args.json)
}

/// A report as JSON or as text.
fn show<R: Serialize>(report: &R, text: &str, json: bool) -> Result<(), Failure> {
    if json {
        say(&serde_json::to_string(report)?)
    } else {
        say(text.trim_end())
    }
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    Ok(std::fs::write(path, text).with_context(|| path.display().to_string())?)
}
