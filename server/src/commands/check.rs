//! `tsukamud check`

use std::path::Path;

use clap::Args;
use tsukamu_motion::hand_csv;
use tsukamu_server::offline::hands::resolve_all;
use tsukamu_server::scene_file::{LoadedScene, builtin, load, mesh};
use tsukamu_server::settings::overrides::Overrides;
use tsukamu_server::settings::{Settings, calibration, load as load_settings};

use super::Failure;
use super::output::{count, say, tell};

/// Arguments of `tsukamud check`.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Scenes (files or built-in names), settings, calibrations, hand CSVs, meshes.
    #[arg(required = true)]
    files: Vec<String>,
}

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Scene,
    Settings,
    Calibration,
    HandCsv,
    Mesh,
}

/// Keys that only one kind of TOML file has at its top.
const SCENE_KEYS: [&str; 7] = [
    "object",
    "target",
    "gravity",
    "floor_height",
    "model",
    "grasp_angle_deg",
    "throw_window_s",
];
const SETTINGS_KEYS: [&str; 15] = [
    "device",
    "hand",
    "listen",
    "scene",
    "mode",
    "log",
    "keyframe_interval_s",
    "event_log",
    "recording_dir",
    "record",
    "record_frames",
    "record_raw",
    "vrpn",
    "vrpn_rate_hz",
    "vrpn_axes",
];
const CALIBRATION_KEYS: [&str; 3] = ["wearer", "mount", "sensors"];

/// Checks every file and says what it holds, or everything that is wrong with it.
pub(super) fn check(args: &CheckArgs) -> Result<(), Failure> {
    let mut is_good = true;
    for file in &args.files {
        match check_one(file) {
            Ok(summary) => say(&format!("{file}: OK, {summary}"))?,
            Err(mistakes) => {
                tell(&mistakes);
                is_good = false;
            }
        }
    }
    if is_good {
        Ok(())
    } else {
        Err(Failure::Usage("check: there are mistakes".to_owned()))
    }
}

/// A summary, or all mistakes.
fn check_one(file: &str) -> Result<String, String> {
    let path = Path::new(file);
    match kind_of(file)? {
        Kind::Scene => load(file)
            .map_err(|mistakes| mistakes.to_string())
            .and_then(|loaded| scene_summary(&loaded)),
        Kind::Settings => {
            let settings = load_settings(Some(path), &Overrides::default())
                .map_err(|mistakes| mistakes.to_string())?;
            settings_summary(&settings)
        }
        Kind::Calibration => {
            let calibration = calibration::load(path).map_err(|mistakes| mistakes.to_string())?;
            Ok(format!(
                "calibration of {:?}, {}",
                calibration.wearer,
                count(calibration.sensors.len() as u64, "sensor")
            ))
        }
        Kind::HandCsv => {
            let text = std::fs::read_to_string(path).map_err(|fault| format!("{file}: {fault}"))?;
            let track = hand_csv::read(&text).map_err(|mistakes| {
                mistakes
                    .to_string()
                    .lines()
                    .map(|line| format!("{file}: {line}"))
                    .collect::<Vec<_>>()
                    .join("\n")
            })?;
            let hands: Vec<&str> = track.hands.iter().map(|hand| hand.side.name()).collect();
            Ok(format!(
                "hand CSV, {}, {:.3} to {:.3} s",
                hands.join(" and "),
                track.start_s(),
                track.end_s()
            ))
        }
        Kind::Mesh => {
            let solid = mesh::load(path, 1.0).map_err(|fault| fault.to_string())?;
            let (faces, edges) = (solid.faces().len(), solid.edges().len());
            let convex = if solid.is_convex() {
                "convex"
            } else {
                "not convex"
            };
            Ok(format!(
                "mesh, {faces} faces, {edges} edges, {:.6e} m³ at scale 1, {convex}",
                solid.volume()
            ))
        }
    }
}

fn scene_summary(loaded: &LoadedScene) -> Result<String, String> {
    let hands = resolve_all(&loaded.default_hands, &loaded.scene).map_err(|faults| {
        faults
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join("\n")
    })?;
    let scene = &loaded.scene;
    let faces: usize = scene
        .objects
        .iter()
        .map(|object| object.shape.faces().len())
        .sum();
    let litres: f64 = scene
        .objects
        .iter()
        .map(|object| object.shape.volume() * 1.0e3)
        .fold(0.0, |sum, litres| sum + litres);
    let hands: Vec<String> = hands.into_iter().map(|hand| hand.name).collect();
    let hands = if hands.is_empty() {
        "no hand of its own".to_owned()
    } else {
        hands.join(", ")
    };
    let n_objects = count(scene.objects.len() as u64, "object");
    Ok(format!(
        "scene {:?}, {n_objects} with {faces} faces and {litres:.3} l, driven by {hands}",
        scene.name
    ))
}

fn settings_summary(settings: &Settings) -> Result<String, String> {
    let mut loaded = load(&settings.world.scene).map_err(|mistakes| mistakes.to_string())?;
    // The hands that would drive it: those of the settings stand in place of the scene's own.
    match &settings.sources {
        Some(sources) => loaded.default_hands.clone_from(sources),
        None if settings.hands.is_empty() => {}
        None => loaded.default_hands.clear(),
    }
    let (listen, mode) = (settings.listen, settings.world.mode.name());
    let n_devices = count(settings.devices.len() as u64, "device");
    let n_hands = count(settings.hands.len() as u64, "hand");
    let scene = scene_summary(&loaded)?;
    Ok(format!(
        "settings: {mode} on {listen}, {n_devices}, {n_hands} of theirs; {scene}"
    ))
}

/// What a file is, by its ending and its keys.
fn kind_of(file: &str) -> Result<Kind, String> {
    if builtin::text(file).is_some() {
        return Ok(Kind::Scene);
    }
    let extension = Path::new(file)
        .extension()
        .map(|end| end.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("csv") => return Ok(Kind::HandCsv),
        Some("obj" | "stl" | "gltf" | "glb") => return Ok(Kind::Mesh),
        Some("mcap") => {
            return Err(format!(
                "{file}: is a recording; `tsukamud verify` checks those"
            ));
        }
        _ => {}
    }
    let text = std::fs::read_to_string(file).map_err(|fault| {
        let names = builtin::names().collect::<Vec<_>>().join(", ");
        format!("{file}: is no built-in scene ({names}), and no readable file: {fault}")
    })?;
    let (table, _) = toml::de::DeTable::parse_recoverable(&text);
    let n_of = |keys: &[&str]| {
        table
            .get_ref()
            .keys()
            .filter(|key| keys.contains(&key.get_ref().as_ref()))
            .count()
    };
    let counts = [
        (Kind::Scene, n_of(&SCENE_KEYS)),
        (Kind::Settings, n_of(&SETTINGS_KEYS)),
        (Kind::Calibration, n_of(&CALIBRATION_KEYS)),
    ];
    // The most telling keys decide; a scene when none tells.
    let most = counts.iter().rev().max_by_key(|(_, n)| *n);
    Ok(most.map_or(Kind::Scene, |(kind, _)| *kind))
}
