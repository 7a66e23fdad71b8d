//! `tsukamud serve`, and `tsukamud` without a command

use std::path::PathBuf;

use clap::Args;
use tsukamu_server::offline::hands::{RunHand, resolve_all};
use tsukamu_server::scene_file::{LoadedScene, load};
use tsukamu_server::settings::{self, Settings};

use super::Failure;
use super::overrides::OverrideArgs;

/// Arguments of `tsukamud serve`.
#[derive(Debug, Args)]
pub(super) struct ServeArgs {
    /// The settings file; also TSUKAMU_CONFIG.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    overrides: OverrideArgs,
}

/// Checks everything that the user gave, then serves until a signal comes.
pub(super) fn serve(args: &ServeArgs) -> Result<(), Failure> {
    let variable = |name: &str| std::env::var(name).ok();
    let config = args
        .config
        .clone()
        .or_else(|| variable("TSUKAMU_CONFIG").map(PathBuf::from));
    let overrides = args.overrides.collect(variable);
    let settings = settings::load(config.as_deref(), &overrides).map_err(usage)?;
    let _ready = prepare(&settings)?;
    Err(Failure::Failed(anyhow::anyhow!(
        "this build cannot serve yet"
    )))
}

/// The scene with the settings' own values, and the hands that drive it from files and computations.
fn prepare(settings: &Settings) -> Result<(LoadedScene, Vec<RunHand>), Failure> {
    let mut loaded = load(&settings.world.scene).map_err(usage)?;
    let scene = &mut loaded.scene;
    scene.rate_hz = settings.world.rate_hz.unwrap_or(scene.rate_hz);
    scene.tracking_grace_s = settings
        .world
        .tracking_grace_s
        .unwrap_or(scene.tracking_grace_s);
    let specs = match &settings.sources {
        Some(sources) => sources.clone(),
        None if settings.hands.is_empty() => loaded.default_hands.clone(),
        None => Vec::new(),
    };
    let hands = resolve_all(&specs, &loaded).map_err(|faults| {
        Failure::Usage(
            faults
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join("\n"),
        )
    })?;
    Ok((loaded, hands))
}

fn usage(mistakes: tsukamu_server::document::mistake::Mistakes) -> Failure {
    Failure::Usage(mistakes.to_string())
}
