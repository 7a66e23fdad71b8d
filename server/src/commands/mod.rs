//! The command line: one file per command. What they print, they print through [`output`].

mod check;
mod completions;
mod devices;
mod doctor;
mod emulate;
mod experiment;
mod export;
mod given;
mod import;
mod import_calibration;
mod man;
mod output;
mod overrides;
mod recover;
mod run;
mod scenes;
mod serve;
mod verify;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

/// Exit code of a mistake in what the user gave: arguments, settings, scenes.
const USAGE: u8 = 2;

/// Why a command failed.
#[derive(Debug)]
enum Failure {
    /// What the user gave is wrong; every mistake is in the text.
    Usage(String),
    /// It could not be done.
    Failed(anyhow::Error),
    /// It was done, and its own output says that the answer is no.
    Negative,
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(fault: E) -> Self {
        Self::Failed(fault.into())
    }
}

/// The Tsukamu daemon: a virtual hand grasps, moves and throws objects; every move is streamed over gRPC.
///
/// Without a command it serves: a built-in scene with a synthetic hand, unless told otherwise.
#[derive(Debug, Parser)]
#[command(name = "tsukamud", version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    serve: serve::ServeArgs,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Serve a scene: devices and clients drive hands, clients watch (the default).
    Serve(serve::ServeArgs),
    /// Run a scene against hand motion offline, faster than real time.
    Run(run::RunArgs),
    /// Check scenes, settings, calibrations, hand CSVs and meshes, and do nothing else.
    Check(check::CheckArgs),
    /// List the built-in scenes.
    Scenes,
    /// Replay a recording and compare every digest.
    Verify(verify::VerifyArgs),
    /// Turn a recording into tables.
    Export(export::ExportArgs),
    /// Make a whole recording of one that was cut off.
    Recover(recover::RecoverArgs),
    /// Turn recorded hand motion of other projects into a hand CSV, or a glove calibration of another program into ours.
    Import(import::ImportArgs),
    /// List this machine's serial ports: maker, lasting name, who may open them, who has them open.
    Devices(devices::DevicesArgs),
    /// Examine the devices of a settings file and say in plain words what is wrong.
    Doctor(doctor::DoctorArgs),
    /// Emulate a glove or a tracker on a pseudo-terminal, worn by a recorded or computed hand.
    Emulate(emulate::EmulateArgs),
    /// Do the paper's experiments again.
    Experiment(experiment::ExperimentArgs),
    /// Print a shell's completions of this command line.
    Completions(completions::CompletionsArgs),
    /// Write the man pages of this command line.
    Man(man::ManArgs),
}

/// Reads the arguments, carries the command out and says how it ended.
pub(crate) fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command.unwrap_or(Command::Serve(cli.serve)) {
        Command::Serve(args) => serve::serve(&args),
        Command::Run(args) => run::run(args),
        Command::Check(args) => check::check(&args),
        Command::Scenes => scenes::scenes(),
        Command::Verify(args) => verify::verify(&args),
        Command::Export(args) => export::export(&args),
        Command::Recover(args) => recover::recover(&args),
        Command::Import(args) => import::import(&args),
        Command::Experiment(args) => experiment::experiment(args),
        Command::Devices(args) => devices::devices(&args),
        Command::Doctor(args) => doctor::doctor(&args),
        Command::Emulate(args) => emulate::emulate(&args),
        Command::Completions(args) => completions::completions(&args, &mut Cli::command()),
        Command::Man(args) => man::man(&args, Cli::command()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Negative) => ExitCode::FAILURE,
        Err(Failure::Failed(fault)) => {
            output::tell(&format!("tsukamud: {}", causes(&fault)));
            ExitCode::FAILURE
        }
        Err(Failure::Usage(text)) => {
            output::tell(&text);
            ExitCode::from(USAGE)
        }
    }
}

/// A failure with its causes, but none that the text before it already ends with.
fn causes(fault: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in fault.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = cause;
        } else if !text.ends_with(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;
    use clap_complete::Shell;

    use super::*;

    /// Names of all commands.
    fn names() -> Vec<String> {
        let command = Cli::command();
        let names = command.get_subcommands().map(clap::Command::get_name);
        names.map(str::to_owned).collect()
    }

    #[test]
    fn completions_know_every_command() {
        assert!(names().len() > 12, "{:?}", names());
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
            let text = completions::text(shell, &mut Cli::command()).expect("completions");
            for name in names() {
                assert!(text.contains(&name), "{shell}: {name}");
            }
            assert!(text.contains("cyberglove"), "{shell}: values are known too");
        }
    }

    #[test]
    fn every_command_has_a_man_page() {
        let folder = std::env::temp_dir().join(format!("tsukamud-man-{}", std::process::id()));
        man::write(&folder, Cli::command()).expect("pages");
        let page = |name: &str| std::fs::read_to_string(folder.join(name)).expect(name);
        let main = page("tsukamud.1");
        for name in names() {
            let page = page(&format!("tsukamud-{name}.1"));
            assert!(page.contains(".SH SYNOPSIS"), "{page}");
            // In roff a hyphen is escaped.
            let mention = format!("tsukamud\\-{name}(1)");
            assert!(main.contains(&mention), "{mention}: {main}");
        }
        std::fs::remove_dir_all(folder).expect("the test's own folder");
    }

    #[test]
    fn a_cause_is_told_once() {
        let fault = anyhow!("no such file").context("a.mcap: no such file");
        assert_eq!(causes(&fault), "a.mcap: no such file");
        assert_eq!(
            causes(&fault.context("reading")),
            "reading: a.mcap: no such file"
        );
    }
}
