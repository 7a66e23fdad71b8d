//! `tsukamud emulate`

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, ValueEnum};
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::glove::cyberglove::settings::SensorCount;
use tsukamu_motion::synthetic::names;
use tsukamu_server::emulate::{Played, Plug, TrackerPlace, spawn_glove, spawn_tracker};
use tsukamu_server::offline::hands::{Motion, resolve_hand};
use tsukamu_server::scene_file::hands::HandSourceSpec;
use tsukamu_server::scene_file::{builtin, load};
use tsukamu_server::settings::calibration;
use tsukamu_world::hand::joint::Side;

use super::Failure;
use super::given::missing_hand;
use super::output::{say, tell};

/// What is emulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Device {
    /// A CyberGlove.
    Cyberglove,
    /// A Fastrak with a receiver on the wrist.
    Fastrak,
    /// Both, in step, with the settings that plug them in.
    #[value(alias = "both")]
    Hand,
}

/// Arguments of `tsukamud emulate`.
#[derive(Debug, Args)]
pub(super) struct EmulateArgs {
    /// The device.
    device: Device,
    /// The hand that wears it: a hand CSV or a synthetic hand's name.
    #[arg(long, value_name = "FILE|NAME")]
    motion: String,
    /// The scene that a synthetic hand acts in [default: the built-in scene of its name].
    #[arg(long)]
    scene: Option<String>,
    /// Which hand, where the file holds both [default: right].
    #[arg(long, value_parser = ["left", "right"])]
    side: Option<String>,
    /// A link to the terminal; for both devices with -glove and -tracker appended.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Sensors of the glove, 18 or 22.
    #[arg(long, value_name = "N", default_value = "18", value_parser = ["18", "22"])]
    sensors: String,
    /// The wearer's calibration file, as the daemon uses it.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Line rate in bit/s; 0 is no pacing.
    #[arg(long, value_name = "BIT/S", default_value_t = 115_200)]
    baud: u32,
    /// Play the motion once and hold its end; otherwise it begins again.
    #[arg(long)]
    once: bool,
}

/// Emulates a device until Ctrl-C.
pub(super) fn emulate(args: &EmulateArgs) -> Result<(), Failure> {
    let (motion, scene) = motion(args)?;
    let played = Played {
        motion,
        repeats: !args.once,
    };
    let calibration = match &args.calibration {
        Some(file) => {
            calibration::load(file).map_err(|mistakes| Failure::Usage(mistakes.to_string()))?
        }
        None => GloveCalibration::default(),
    };
    let place = TrackerPlace {
        wrist_from_sensor: calibration.mount.wrist_from_sensor(),
        ..TrackerPlace::default()
    };
    let sensors = if args.sensors == "22" {
        SensorCount::TwentyTwo
    } else {
        SensorCount::Eighteen
    };
    let is_pair = args.device == Device::Hand;
    let side = played.motion.side();
    let glove = (args.device != Device::Fastrak)
        .then(|| {
            spawn_glove(
                played.clone(),
                sensors,
                calibration,
                plug(args, is_pair.then_some("glove")),
            )
        })
        .transpose()
        .with_context(|| cannot_plug(args))?;
    let tracker = (args.device != Device::Cyberglove)
        .then(|| spawn_tracker(played, place, plug(args, is_pair.then_some("tracker"))))
        .transpose()
        .with_context(|| cannot_plug(args))?;
    let glove_path = glove.as_ref().map(|glove| glove.path().to_owned());
    let tracker_path = tracker.as_ref().map(|tracker| tracker.path().to_owned());
    match (glove_path, tracker_path) {
        (Some(glove), Some(tracker)) => {
            say(&sample_settings(&glove, &tracker, side, &scene, args))?
        }
        (Some(path), None) | (None, Some(path)) => {
            say(&path.display().to_string())?;
            tell(&sample_device(&path, args));
        }
        (None, None) => {}
    }
    tell("emulating until Ctrl-C");
    until_interrupted()
}

/// The motion of the hand that wears the device, and the scene that it acts in.
fn motion(args: &EmulateArgs) -> Result<(Motion, String), Failure> {
    let text = &args.motion;
    let bare = text.split(['?', ',']).next().unwrap_or_default();
    let bare = bare.strip_prefix("synthetic:").unwrap_or(bare);
    let bare = bare.strip_prefix("operations/").unwrap_or(bare);
    let is_name = names().iter().any(|known| known.name.text() == bare);
    let text = if is_name && !text.starts_with("synthetic:") {
        format!("synthetic:{text}")
    } else {
        text.clone()
    };
    let usage = |fault: String| Failure::Usage(format!("--motion {}: {fault}", args.motion));
    if let Some(fault) = missing_hand(&text) {
        return Err(usage(fault));
    }
    let spec =
        HandSourceSpec::parse(&text, Path::new("")).map_err(|fault| usage(fault.to_string()))?;
    let own = builtin::names().find(|name| *name == bare || name.ends_with(&format!("/{bare}")));
    let scene = args.scene.as_deref().or(own).unwrap_or("demo");
    let loaded = load(scene).map_err(|mistakes| Failure::Usage(mistakes.to_string()))?;
    let mut motions =
        resolve_hand(&spec, &loaded.scene).map_err(|fault| Failure::Usage(fault.to_string()))?;
    let wanted = if args.side.as_deref() == Some("left") {
        Side::Left
    } else {
        Side::Right
    };
    let index = motions.iter().position(|motion| motion.side() == wanted);
    match (index, motions.len(), &args.side) {
        (Some(index), _, _) => Ok((motions.swap_remove(index), scene.to_owned())),
        (None, 1, None) => Ok((motions.swap_remove(0), scene.to_owned())),
        _ => Err(usage(format!("it has no {} hand", wanted.name()))),
    }
}

fn plug(args: &EmulateArgs, suffix: Option<&str>) -> Plug {
    let link = args.link.as_ref().map(|link| match suffix {
        None => link.clone(),
        Some(suffix) => PathBuf::from(format!("{}-{suffix}", link.display())),
    });
    Plug {
        link,
        baud: Some(args.baud),
    }
}

fn cannot_plug(args: &EmulateArgs) -> String {
    let link = args.link.as_ref();
    link.map_or_else(
        || "opening a pseudo-terminal".to_owned(),
        |link| {
            format!(
                "opening a pseudo-terminal and linking {} to it",
                link.display()
            )
        },
    )
}

/// The part of a settings file that plugs one device in.
fn sample_device(path: &Path, args: &EmulateArgs) -> String {
    let port = args.link.as_deref().unwrap_or(path).display().to_string();
    let name = if args.device == Device::Fastrak {
        "tracker"
    } else {
        "glove"
    };
    let kind = if args.device == Device::Fastrak {
        "fastrak"
    } else {
        "cyberglove"
    };
    format!("[[device]]\nname = \"{name}\"\nkind = \"{kind}\"\nport = {port:?}\n")
}

/// A settings file that plugs both devices in.
fn sample_settings(
    glove: &Path,
    tracker: &Path,
    side: Side,
    scene: &str,
    args: &EmulateArgs,
) -> String {
    let at = |path: &Path, suffix: &str| {
        plug(args, Some(suffix))
            .link
            .unwrap_or_else(|| path.to_owned())
    };
    let (glove, tracker) = (at(glove, "glove"), at(tracker, "tracker"));
    let absolute = |file: &Path| {
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        file.display().to_string()
    };
    let calibration = args.calibration.as_ref();
    let calibration = calibration.map_or_else(String::new, |file| {
        format!("calibration = {:?}\n", absolute(file))
    });
    let is_builtin = builtin::text(scene).is_some();
    let scene = if is_builtin {
        scene.to_owned()
    } else {
        absolute(Path::new(scene))
    };
    format!(
        "# Settings for `tsukamud --config FILE` while this runs.\n\
         # `tsukamu reset` puts the objects back for another round.\n\
         scene = {scene:?}\n\n\
         [[device]]\nname = \"glove\"\nkind = \"cyberglove\"\nport = {:?}\n{calibration}\n\
         [[device]]\nname = \"tracker\"\nkind = \"fastrak\"\nport = {:?}\n\n\
         [[hand]]\nname = \"glove:{side}\"\nside = \"{side}\"\nglove = \"glove\"\ntracker = \"tracker\"",
        glove.display().to_string(),
        tracker.display().to_string(),
        side = side.name(),
    )
}

/// Waits for Ctrl-C.
fn until_interrupted() -> Result<(), Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("starting a runtime")?;
    Ok(runtime.block_on(tokio::signal::ctrl_c())?)
}
