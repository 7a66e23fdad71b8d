//! `tsukamud serve`, and `tsukamud` without a command

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::net::SocketAddr;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use tokio::signal::unix::{SignalKind, signal};
use tracing::warn;
use tracing_subscriber::EnvFilter;
use tsukamu_server::daemon::{self, DaemonConfig};
use tsukamu_server::document::mistake::{Mistake, Mistakes};
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file::load;
use tsukamu_server::sd_notify::ServiceManager;
use tsukamu_server::settings::{self, Mode, Settings};

use super::Failure;
use super::output::say;
use super::overrides::OverrideArgs;

/// Arguments of `tsukamud serve`.
#[derive(Debug, Args)]
#[command(
    after_help = "Each option but --config is also a key of the settings file and a variable: --rate-hz is \
                  rate_hz and TSUKAMU_RATE_HZ, --hand is hands and TSUKAMU_HANDS. An option stands above a variable, a variable above the file."
)]
pub(super) struct ServeArgs {
    /// The settings file; also TSUKAMU_CONFIG.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    overrides: OverrideArgs,
}

/// Checks everything that the user gave, then serves until SIGINT or SIGTERM.
pub(super) fn serve(args: &ServeArgs) -> Result<(), Failure> {
    let variable = |name: &str| std::env::var(name).ok();
    let config = args
        .config
        .clone()
        .or_else(|| variable("TSUKAMU_CONFIG").map(PathBuf::from));
    let settings =
        settings::load(config.as_deref(), &args.overrides.collect(variable)).map_err(usage)?;
    let filter = EnvFilter::try_new(&settings.log).map_err(|fault| {
        let (origin, key) = ("settings".to_owned(), "log".to_owned());
        usage(Mistakes(vec![Mistake {
            origin,
            place: None,
            key,
            message: fault.to_string(),
        }]))
    })?;
    let greeting = Greeting::of(&settings);
    let daemon = prepare(settings, config)?;
    let is_terminal = std::io::stderr().is_terminal();
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(is_terminal)
        .init();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("starting a runtime")?;
    runtime.block_on(run(daemon, &greeting))
}

/// Starts the daemon, greets, waits for a signal and drains.
async fn run(config: DaemonConfig, greeting: &Greeting) -> Result<(), Failure> {
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    let manager = ServiceManager::from_variables(|name| std::env::var_os(name), std::process::id())
        .inspect_err(|fault| warn!(%fault, "the service manager is not told"))
        .unwrap_or_default();
    let devices: Vec<String> = config
        .devices
        .iter()
        .map(|device| device.name.clone())
        .collect();
    let daemon = daemon::start(config).await?;
    manager.ready(&daemon, &devices).await;
    say(&greeting.text(daemon.local_addr()))?;
    let failed = tokio::select! {
        _ = interrupt.recv() => false,
        _ = terminate.recv() => false,
        () = daemon.failed() => true,
        () = manager.keep_informed(&daemon, &devices) => true,
    };
    manager.stopping().await;
    daemon.shutdown().await?;
    if failed {
        Err(anyhow::anyhow!("the world's thread ended by itself").into())
    } else {
        Ok(())
    }
}

/// What the daemon starts with: the scene with the settings' own values, and the hands that drive it.
fn prepare(settings: Settings, file: Option<PathBuf>) -> Result<DaemonConfig, Failure> {
    let mut loaded = load(&settings.world.scene).map_err(usage)?;
    let scene = &mut loaded.scene;
    scene.rate_hz = settings.world.rate_hz.unwrap_or(scene.rate_hz);
    scene.tracking_grace_s = settings
        .world
        .tracking_grace_s
        .unwrap_or(scene.tracking_grace_s);
    let cast = match &settings.sources {
        Some(sources) => Cast::Named(sources),
        // In lockstep a client decides when to begin again.
        None if settings.hands.is_empty() => Cast::Default {
            repeats: settings.world.mode == Mode::Realtime,
        },
        None => Cast::Nobody,
    };
    let plan = plan(&loaded, cast).map_err(|fault| Failure::Usage(fault.to_string()))?;
    let session = [
        (
            "settings",
            file.map_or_else(|| "none".to_owned(), |file| file.display().to_string()),
        ),
        ("scene", settings.world.scene.clone()),
        ("mode", settings.world.mode.name().to_owned()),
        ("rate_hz", loaded.scene.rate_hz.to_string()),
        ("listen", settings.listen.to_string()),
        ("details", format!("{settings:?}")),
    ];
    Ok(DaemonConfig {
        listen: settings.listen,
        mode: settings.world.mode,
        plan,
        publish: settings.publish,
        recording: settings.recording,
        vrpn: settings.vrpn,
        devices: settings.devices,
        hands: settings.hands,
        session: BTreeMap::from(session.map(|(key, value)| (key.to_owned(), value))),
    })
}

/// What the terminal is told.
#[derive(Debug)]
struct Greeting {
    scene: String,
    hands: String,
    mode: Mode,
    has_devices: bool,
}

impl Greeting {
    fn of(settings: &Settings) -> Self {
        let names = |names: Vec<String>| names.join(", ");
        let hands = match &settings.sources {
            Some(sources) => names(sources.iter().map(ToString::to_string).collect()),
            None if settings.hands.is_empty() => "its own hands".to_owned(),
            None => names(
                settings
                    .hands
                    .iter()
                    .map(|hand| hand.name.clone())
                    .collect(),
            ),
        };
        Self {
            scene: settings.world.scene.clone(),
            hands,
            mode: settings.world.mode,
            has_devices: !settings.devices.is_empty(),
        }
    }

    fn text(&self, address: SocketAddr) -> String {
        let Self {
            scene,
            hands,
            mode,
            has_devices,
        } = self;
        let time = match mode {
            Mode::Realtime => "in real time",
            Mode::Lockstep => "in lockstep: it moves when a client says `step`",
        };
        let glove = if *has_devices {
            "gloves     opened as the settings say; `tsukamu devices` shows their health"
        } else {
            "a glove    tsukamud --config FILE with a [[device]] and a [[hand]]\n  \
             none?      tsukamud emulate hand --motion free   prints such a file for an emulated glove and tracker"
        };
        // The client looks for the daemon at its default address by itself.
        let at = match address {
            _ if address.to_string() == settings::LISTEN_DEFAULT => String::new(),
            _ if address.ip().is_unspecified() => format!(" -a HOST:{}", address.port()),
            _ => format!(" -a {address}"),
        };
        format!(
            "tsukamu: scene {scene}, driven by {hands}, {time}\n\n  \
             page       http://{address}/   (metrics: /metrics)\n  \
             gRPC       {address}, package tsukamu.v1, reflection is on\n  \
             watch      tsukamu{at} watch   (from the sources: cargo run --release --bin tsukamu --{at} watch)\n  \
             {glove}\n  \
             stop       Ctrl-C\n"
        )
    }
}

fn usage(mistakes: Mistakes) -> Failure {
    Failure::Usage(mistakes.to_string())
}
