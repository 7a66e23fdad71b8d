//! `tsukamud emulate`

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use tokio::signal::unix::{SignalKind, signal};
use tsukamu_devices::driver::Role;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_motion::synthetic::names;
use tsukamu_server::emulate::kinds::{KINDS, Kind, named};
use tsukamu_server::emulate::{Played, Plug, Plugged, TrackerPlace, Worn};
use tsukamu_server::offline::hands::{Motion, resolve_hand};
use tsukamu_server::scene_file::hands::HandSourceSpec;
use tsukamu_server::scene_file::{builtin, load};
use tsukamu_server::settings::calibration;
use tsukamu_world::hand::joint::Side;

use super::Failure;
use super::given::missing_hand;
use super::output::{say, tell};

/// What makes a hand of two devices.
const HAND: &str = "hand";
/// How long a cable that is pulled on purpose stays out.
const UNPLUGGED_FOR: Duration = Duration::from_secs(1);

/// Arguments of `tsukamud emulate`.
#[derive(Debug, Args)]
pub(super) struct EmulateArgs {
    /// The device.
    #[arg(value_parser = devices())]
    device: String,
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
    /// The glove of `hand` [default: cyberglove].
    #[arg(long, value_name = "KIND", value_parser = kinds_of(Role::is_glove))]
    glove: Option<String>,
    /// The tracker of `hand` [default: fastrak].
    #[arg(long, value_name = "KIND", value_parser = kinds_of(Role::is_tracker))]
    tracker: Option<String>,
    /// The model, where the device has several; a wrong one is refused with those there are.
    #[arg(long, alias = "sensors", value_name = "MODEL")]
    model: Vec<String>,
    /// The wearer's calibration file, as the daemon uses it.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Line rate in bit/s, 0 for no pacing [default: that of the device].
    #[arg(long, value_name = "BIT/S")]
    baud: Option<u32>,
    /// Where a device of the network sends to [default: this machine, the usual port of its kind].
    #[arg(long, value_name = "HOST:PORT")]
    to: Option<String>,
    /// Play the motion once and hold its end; otherwise it begins again.
    #[arg(long)]
    once: bool,
    /// Replace so many of a hundred bytes that a device sends by others.
    #[arg(long, value_name = "PERCENT", value_parser = percent, default_value_t = 0.0)]
    corrupt: f64,
    /// Pull a cable each so many seconds and plug it in again after one; of two devices in turn.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    unplug_every: Option<f64>,
}

/// A device that is to be emulated.
#[derive(Clone, Copy, Debug)]
struct Wanted {
    kind: &'static Kind,
    model: &'static str,
    /// What its name and its link end in, where there are two.
    part: &'static str,
}

/// Emulates one device or two until Ctrl-C or SIGTERM.
pub(super) fn emulate(args: &EmulateArgs) -> Result<(), Failure> {
    let wanted = wanted(args)?;
    let (motion, scene) = motion(args)?;
    let calibration = match &args.calibration {
        Some(file) => {
            calibration::load(file).map_err(|mistakes| Failure::Usage(mistakes.to_string()))?
        }
        None => GloveCalibration::default(),
    };
    let side = motion.side();
    let played = Played {
        motion,
        repeats: !args.once,
    };
    let place = TrackerPlace {
        wrist_from_sensor: calibration.mount.wrist_from_sensor(),
        ..TrackerPlace::default()
    };
    let mut plugged = Vec::new();
    for device in &wanted {
        let worn = Worn {
            played: played.clone(),
            calibration: calibration.clone(),
            place,
            model: device.model,
            to: args.to.clone(),
            plug: Plug {
                link: link(args, device, &wanted),
                baud: Some(
                    args.baud
                        .unwrap_or_else(|| (device.kind.baud)(device.model)),
                ),
            },
        };
        let mut device = (device.kind.spawn)(worn).with_context(|| cannot_plug(args))?;
        device.spoil(args.corrupt / 100.0);
        plugged.push(device);
    }
    let tables: Vec<String> = wanted
        .iter()
        .zip(&plugged)
        .map(|(device, plugged)| {
            let own = plugged.path();
            // What is on the network has no link.
            let link = link(args, device, &wanted).filter(|_| own.is_absolute());
            let port = link.unwrap_or_else(|| own.to_owned());
            device_table(device, &port, args)
        })
        .collect();
    match wanted.as_slice() {
        [one] if one.kind.role != Role::Both => say(tables.concat().trim_end())?,
        [_] => say(&sample_settings(&tables, "glove", side, &scene))?,
        _ => say(&sample_settings(&tables, "tracker", side, &scene))?,
    }
    tell("emulating until Ctrl-C");
    until_interrupted(&mut plugged, args.unplug_every.map(Duration::from_secs_f64))
}

fn devices() -> PossibleValuesParser {
    let of_kind = |kind: &Kind| PossibleValue::new(kind.name).help(kind.about);
    let hand = PossibleValue::new(HAND)
        .alias("both")
        .help("A glove and a tracker, in step, with the settings that plug them in");
    PossibleValuesParser::new(KINDS.iter().map(of_kind).chain([hand]))
}

fn kinds_of(suits: fn(Role) -> bool) -> PossibleValuesParser {
    let suiting = KINDS.iter().filter(move |kind| suits(kind.role));
    PossibleValuesParser::new(suiting.map(|kind| PossibleValue::new(kind.name).help(kind.about)))
}

fn percent(text: &str) -> Result<f64, String> {
    let number = text.parse().ok();
    let inside = number.filter(|percent| (0.0..=100.0).contains(percent));
    inside.ok_or_else(|| "it must be a number from 0 to 100".to_owned())
}

fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok();
    let inside = number.filter(|seconds| (0.1..=86_400.0).contains(seconds));
    inside.ok_or_else(|| "it must be a number from 0.1 to 86400".to_owned())
}

/// The devices that are asked for, each with its model.
fn wanted(args: &EmulateArgs) -> Result<Vec<Wanted>, Failure> {
    let usage = |text: String| Failure::Usage(text);
    let is_pair = matches!(args.device.as_str(), HAND | "both");
    let pair = [
        ("glove", args.glove.as_deref().unwrap_or("cyberglove")),
        ("tracker", args.tracker.as_deref().unwrap_or("fastrak")),
    ];
    let names = if is_pair {
        pair.to_vec()
    } else if args.glove.is_some() || args.tracker.is_some() {
        let text = "--glove and --tracker choose the parts of `hand`; name one device or `hand`";
        return Err(usage(text.to_owned()));
    } else {
        vec![("", args.device.as_str())]
    };
    let mut wanted = Vec::new();
    for (part, name) in names {
        let kind = named(name).with_context(|| format!("no kind is called {name}"))?;
        let asked = |model: &&&'static str| args.model.iter().any(|asked| asked == **model);
        let model = kind.models.iter().find(asked).unwrap_or(&kind.models[0]);
        wanted.push(Wanted { kind, model, part });
    }
    let models: Vec<&str> = wanted.iter().map(|device| device.model).collect();
    if let Some(other) = args
        .model
        .iter()
        .find(|model| !models.contains(&model.as_str()))
    {
        let known: Vec<&str> = wanted
            .iter()
            .flat_map(|device| device.kind.models)
            .copied()
            .collect();
        let known = known.join(", ");
        return Err(usage(format!("--model {other}: it must be one of {known}")));
    }
    Ok(wanted)
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

/// The link to the terminal of one of the devices.
fn link(args: &EmulateArgs, device: &Wanted, wanted: &[Wanted]) -> Option<PathBuf> {
    let link = args.link.as_ref()?;
    Some(match wanted {
        [_] => link.clone(),
        _ => PathBuf::from(format!("{}-{}", link.display(), device.part)),
    })
}

fn cannot_plug(args: &EmulateArgs) -> String {
    if let Some(to) = &args.to {
        return format!("sending to {to}");
    }
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
fn device_table(device: &Wanted, port: &Path, args: &EmulateArgs) -> String {
    let kind = device.kind;
    // One that can be both is the part that it is asked to be.
    let is_glove = kind.role.is_glove() && device.part != "tracker";
    let name = if is_glove { "glove" } else { "tracker" };
    let calibration = args.calibration.as_ref().filter(|_| is_glove);
    let calibration = calibration.map_or_else(String::new, |file| {
        format!("calibration = {:?}\n", absolute(file))
    });
    format!(
        "[[device]]\nname = \"{name}\"\nkind = {:?}\nport = {:?}\n{}{calibration}",
        kind.name,
        port.display().to_string(),
        (kind.settings)(device.model),
    )
}

/// A settings file that plugs all devices in; the glove is called so.
fn sample_settings(tables: &[String], tracker: &str, side: Side, scene: &str) -> String {
    let is_builtin = builtin::text(scene).is_some();
    let scene = if is_builtin {
        scene.to_owned()
    } else {
        absolute(Path::new(scene))
    };
    format!(
        "# Settings for `tsukamud --config FILE` while this runs.\n\
         # `tsukamu reset` puts the objects back for another round.\n\
         scene = {scene:?}\n\n{}\n\
         [[hand]]\nname = \"glove:{side}\"\nside = \"{side}\"\nglove = \"glove\"\ntracker = \"{tracker}\"",
        tables.join("\n"),
        side = side.name(),
    )
}

fn absolute(file: &Path) -> String {
    let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    file.display().to_string()
}

/// Waits for Ctrl-C or SIGTERM, and pulls cables meanwhile if that is asked for.
fn until_interrupted(
    plugged: &mut [Box<dyn Plugged>],
    every: Option<Duration>,
) -> Result<(), Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("starting a runtime")?;
    runtime.block_on(async {
        let mut interrupt = signal(SignalKind::interrupt())?;
        let mut terminate = signal(SignalKind::terminate())?;
        tokio::select! {
            _ = interrupt.recv() => Ok(()),
            _ = terminate.recv() => Ok(()),
            fault = pull_cables(plugged, every) => Err(fault.into()),
        }
    })
}

/// Goes on until a device cannot be plugged in again.
async fn pull_cables(plugged: &mut [Box<dyn Plugged>], every: Option<Duration>) -> anyhow::Error {
    let Some(every) = every else {
        return std::future::pending().await;
    };
    let mut turn = 0;
    loop {
        tokio::time::sleep(every).await;
        let n_devices = plugged.len();
        let device = &mut plugged[turn % n_devices];
        tell(&format!("{}: unplugged", device.path().display()));
        device.unplug();
        tokio::time::sleep(UNPLUGGED_FOR).await;
        if let Err(fault) = device.plug() {
            return anyhow::Error::new(fault).context("plugging the device in again");
        }
        tell(&format!("{}: plugged in", device.path().display()));
        turn += 1;
    }
}
