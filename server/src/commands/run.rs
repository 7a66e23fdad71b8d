//! `tsukamud run`

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use tsukamu_server::offline::hands::{RunHand, resolve_all};
use tsukamu_server::offline::poses::PoseTable;
use tsukamu_server::offline::report::RunReport;
use tsukamu_server::offline::run::{RunOutputs, RunRequest, run as run_scene};
use tsukamu_server::record::writer::{Existing, RecordingFile};
use tsukamu_server::scene_file::hands::HandSourceSpec;
use tsukamu_server::scene_file::{LoadedScene, load};
use tsukamu_world::scene::Model;

use super::Failure;
use super::given::{missing_hand, rate};
use super::output::{progress_bar, say};

/// Longest run, in seconds of world time: a day.
const DURATION_MAX_S: f64 = 86_400.0;

/// Arguments of `tsukamud run`.
#[derive(Debug, Args)]
pub(super) struct RunArgs {
    /// A built-in scene or a scene file.
    #[arg(long)]
    scene: String,
    /// A hand CSV or synthetic:NAME, in place of the scene's own hands; may be given several times.
    #[arg(long = "hand", value_name = "FILE|synthetic:NAME")]
    hands: Vec<String>,
    /// The model, in place of the scene's.
    #[arg(long, value_parser = model)]
    model: Option<Model>,
    /// Steps per second of world time, 1 to 4000, in place of the scene's.
    #[arg(long, alias = "rate-hz", value_name = "HZ", value_parser = rate, allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Seconds of world time. Default: the hands' motion and 2 s, then until everything is at rest, at most a minute.
    #[arg(long, value_name = "S", value_parser = duration, allow_negative_numbers = true)]
    duration: Option<f64>,
    /// Record the run; a file that is there is replaced.
    #[arg(long, value_name = "OUT.mcap")]
    record: Option<PathBuf>,
    /// Write a row per tick and object; a file that is there is replaced.
    #[arg(long, value_name = "OUT.csv")]
    poses: Option<PathBuf>,
    /// Print one JSON object in place of the summary.
    #[arg(long)]
    json: bool,
}

/// Runs a scene offline.
pub(super) fn run(args: RunArgs) -> Result<(), Failure> {
    let (loaded, hands) = load_all(&args)?;
    let mut scene = loaded.scene;
    scene.model = args.model.unwrap_or(scene.model);
    scene.rate_hz = args.rate.unwrap_or(scene.rate_hz);
    let request = RunRequest {
        scene,
        source_text: loaded.source_text,
        hands,
        duration_s: args.duration,
    };
    let outputs = outputs(&args, &request)?;
    let bar = progress_bar(0, "steps");
    let outcome = run_scene(request, outputs, |progress| {
        bar.set_length(progress.expected);
        bar.set_position(progress.done);
    });
    bar.finish_and_clear();
    let report = RunReport::of(outcome?);
    if args.json {
        say(&serde_json::to_string(&report)?)
    } else {
        say(&report.to_string())
    }
}

/// The scene and the hands, or every mistake in them.
fn load_all(args: &RunArgs) -> Result<(LoadedScene, Vec<RunHand>), Failure> {
    let loaded = load(&args.scene).map_err(|mistakes| Failure::Usage(mistakes.to_string()))?;
    let mut mistakes = Vec::new();
    let mut specs = Vec::new();
    for text in &args.hands {
        if let Some(fault) = missing_hand(text) {
            mistakes.push(format!("--hand {text}: {fault}"));
            continue;
        }
        match HandSourceSpec::parse(text, Path::new("")) {
            Ok(spec) => specs.push(spec),
            Err(fault) => mistakes.push(format!("--hand {text}: {fault}")),
        }
    }
    if args.hands.is_empty() {
        specs.clone_from(&loaded.default_hands);
    }
    let hands = resolve_all(&specs, &loaded.scene).unwrap_or_else(|faults| {
        mistakes.extend(faults.iter().map(ToString::to_string));
        Vec::new()
    });
    if mistakes.is_empty() {
        Ok((loaded, hands))
    } else {
        Err(Failure::Usage(mistakes.join("\n")))
    }
}

fn outputs(args: &RunArgs, request: &RunRequest) -> Result<RunOutputs<BufWriter<File>>, Failure> {
    let record = |path: &PathBuf| {
        let hands: Vec<&str> = request
            .hands
            .iter()
            .map(|hand| hand.name.as_str())
            .collect();
        let session = [
            ("command", "run".to_owned()),
            ("scene", args.scene.clone()),
            ("model", request.scene.model.name().to_owned()),
            ("rate_hz", request.scene.rate_hz.to_string()),
            ("hands", hands.join(", ")),
        ];
        let session = session.map(|(key, value)| (key.to_owned(), value));
        RecordingFile::create(path, Existing::Replace, &BTreeMap::from(session))
    };
    let table = |path: &PathBuf| -> Result<_, Failure> {
        let file = File::create(path).with_context(|| path.display().to_string())?;
        Ok(PoseTable::new(BufWriter::new(file), &[])?)
    };
    Ok(RunOutputs {
        recording: args.record.as_ref().map(record).transpose()?,
        poses: args.poses.as_ref().map(table).transpose()?,
    })
}

fn model(text: &str) -> Result<Model, String> {
    let names = Model::ALL.map(Model::name).join(", ");
    Model::from_name(text).ok_or_else(|| format!("models are: {names}"))
}

fn duration(text: &str) -> Result<f64, String> {
    let duration = text
        .parse()
        .ok()
        .filter(|duration| *duration > 0.0 && *duration <= DURATION_MAX_S);
    duration
        .ok_or_else(|| format!("it must be a number of seconds above 0, at most {DURATION_MAX_S}"))
}
