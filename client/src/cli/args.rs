use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use tsukamu_client::connect::DEFAULT_ADDRESS;

use super::calibrate::args::CalibrateArgs;

/// Look at a running Tsukamu daemon, drive a hand in it, command it.
#[derive(Debug, Parser)]
#[command(name = "tsukamu", version, arg_required_else_help = true)]
pub(crate) struct Args {
    /// Address of the daemon, e.g. 127.0.0.1:7447.
    #[arg(long, short, global = true, env = "TSUKAMU_ADDRESS", default_value = DEFAULT_ADDRESS, value_name = "ADDRESS")]
    pub(crate) address: String,
    /// Keep trying to reach it for this many seconds.
    #[arg(long, global = true, default_value_t = 0.0, value_name = "S", value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) wait: f64,
    /// Print JSON: one object, or one per line where it goes on.
    #[arg(long, global = true)]
    pub(crate) json: bool,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// What the daemon runs, and how well.
    Status,
    /// A live view of hands, objects and events.
    Watch(WatchArgs),
    /// What happened, and why.
    Events(EventsArgs),
    /// Drive a hand with the motion of a hand CSV file or a built-in synthetic hand.
    Send(SendArgs),
    /// Record this session.
    #[command(subcommand)]
    Record(RecordCommand),
    /// Play a recording from the daemon's folder.
    Play(PlayArgs),
    /// Gloves, trackers and other sources, with their health.
    Devices(DevicesArgs),
    /// Fit a glove to its wearer, or a tracker to the room or the wrist, while the daemon runs.
    Calibrate(CalibrateArgs),
    /// Advance a daemon in lockstep mode.
    Step(StepArgs),
    /// Load a built-in scene by name, or a scene file.
    Load(LoadArgs),
    /// Set the scene back to its start.
    Reset,
    /// Stop the world's clock.
    Pause,
    /// Let the world's clock run again.
    Resume,
    /// Measure the way to the daemon and the offset of its clock.
    Ping(PingArgs),
    /// Print a shell's completions of this command line.
    Completions(CompletionsArgs),
    /// Write the man pages of this command line.
    Man(ManArgs),
}

#[derive(Debug, clap::Args)]
pub(crate) struct WatchArgs {
    /// Most frames per second; 0 is every step.
    #[arg(long, alias = "rate-hz", default_value_t = 60.0, value_name = "HZ", value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) rate: f64,
    /// Stop after this many frames.
    #[arg(long, value_name = "N")]
    pub(crate) count: Option<u64>,
    /// Print lines even on a terminal.
    #[arg(long)]
    pub(crate) plain: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct EventsArgs {
    /// First sequence number wanted. Without it: the oldest one held, or with --follow the next to come.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) from: Option<u64>,
    /// Go on with what happens.
    #[arg(long, short)]
    pub(crate) follow: bool,
    /// Stop after this many events.
    #[arg(long, value_name = "N")]
    pub(crate) count: Option<u64>,
    /// Also every contact that begins or ends.
    #[arg(long)]
    pub(crate) contacts: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct SendArgs {
    /// A hand CSV file, or `synthetic:NAME`.
    #[arg(value_name = "FILE|synthetic:NAME")]
    pub(crate) source: String,
    /// Only this hand of the motion.
    #[arg(long)]
    pub(crate) side: Option<SideArg>,
    /// Begin again at the end, until interrupted.
    #[arg(long = "loop")]
    pub(crate) repeat: bool,
    /// What people will see the hand called. Default: the file's name.
    #[arg(long)]
    pub(crate) name: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SideArg {
    Left,
    Right,
}

#[derive(Debug, Subcommand)]
pub(crate) enum RecordCommand {
    /// Begin to record.
    Start {
        /// File name without a path. Default: made from the time.
        name: Option<String>,
        /// Also every frame.
        #[arg(long)]
        frames: bool,
        /// Also the raw bytes of the serial ports.
        #[arg(long)]
        raw: bool,
    },
    /// Finish the recording.
    Stop,
    /// The recordings in the daemon's folder.
    List,
}

#[derive(Debug, clap::Args)]
pub(crate) struct PlayArgs {
    /// Name of the recording, as `tsukamu record list` shows it; `.mcap` may be left out.
    pub(crate) name: String,
}

#[derive(Debug, clap::Args)]
pub(crate) struct DevicesArgs {
    /// Print again whenever something changes, and once a second.
    #[arg(long, short)]
    pub(crate) watch: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct StepArgs {
    /// Steps to do.
    #[arg(default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000), allow_negative_numbers = true)]
    pub(crate) n: u32,
}

#[derive(Debug, clap::Args)]
pub(crate) struct LoadArgs {
    /// A built-in scene, e.g. `operations/stack`, or the path of a scene file (ending in `.toml`).
    #[arg(value_name = "NAME|FILE.toml")]
    pub(crate) scene: String,
    /// Without the scene's own hands.
    #[arg(long)]
    pub(crate) no_hands: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct PingArgs {
    /// Exchanges.
    #[arg(long, short = 'n', default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) count: u32,
}

#[derive(Debug, clap::Args)]
pub(crate) struct CompletionsArgs {
    /// The shell.
    pub(crate) shell: Shell,
}

#[derive(Debug, clap::Args)]
pub(crate) struct ManArgs {
    /// The folder; it is made if it is not there.
    #[arg(long, short, value_name = "DIR")]
    pub(crate) output: PathBuf,
}

impl LoadArgs {
    /// The scene file, if one is meant.
    pub(crate) fn file(&self) -> Option<PathBuf> {
        let path = PathBuf::from(&self.scene);
        path.extension()
            .is_some_and(|extension| extension == "toml")
            .then_some(path)
    }
}

fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
        _ => Err("it must be a number, 0 or more".into()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_arguments_are_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn files_and_names_are_told_apart() {
        let file = |scene: &str| {
            LoadArgs {
                scene: scene.into(),
                no_hands: false,
            }
            .file()
        };
        assert_eq!(file("operations/stack"), None);
        assert_eq!(
            file("mine/stack.toml"),
            Some(PathBuf::from("mine/stack.toml"))
        );
    }
}
