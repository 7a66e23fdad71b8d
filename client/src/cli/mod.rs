use std::io;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Result;
use clap::Parser;
use tokio::signal::unix::{SignalKind, signal};
use tonic::Status;
use tsukamu_client::connect::{Client, ConnectOptions};
use tsukamu_client::retry::RetryPolicy;

use args::{Args, Command};

/// What may be typed.
mod args;
/// `calibrate`.
mod calibrate;
/// `step`, `load`, `reset`, `pause`, `resume`.
mod control;
/// `devices`.
mod devices;
/// `events`.
mod events;
/// Numbers and durations for people.
mod format;
/// Values as JSON.
mod json;
/// Motion of hands from files and plans.
mod motion;
/// The only place that writes to the terminal.
mod output;
/// `record` and `play`.
mod recordings;
/// What the scene calls its objects and hands.
mod scene_names;
/// `send`.
mod send;
/// `completions` and `man`.
mod shell;
/// `status` and `ping`.
mod status;
/// `watch`.
mod watch;

/// How long a stream tries to find its daemon again.
const PATIENCE: Duration = Duration::from_secs(60);
/// The exit code of a shell's child that was interrupted.
const INTERRUPTED: u8 = 130;

/// Arguments to exit code.
pub(crate) async fn main() -> ExitCode {
    let args = Args::parse();
    let result = tokio::select! {
        result = run(args) => result,
        () = stop_signal() => return ExitCode::from(INTERRUPTED),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            output::complain(&error);
            ExitCode::FAILURE
        }
    }
}

async fn run(args: Args) -> Result<()> {
    // These need no daemon.
    match &args.command {
        Command::Completions(completions) => return shell::completions(completions),
        Command::Man(man) => return shell::man(man),
        _ => {}
    }
    let patience = Duration::try_from_secs_f64(args.wait)?;
    let client = Client::connect(ConnectOptions {
        address: args.address,
        retry: RetryPolicy::lasting(patience),
        ..ConnectOptions::default()
    })
    .await?
    .with_retry(RetryPolicy::lasting(PATIENCE));
    let json = args.json;
    match args.command {
        Command::Status => status::status(&client, json).await,
        Command::Ping(ping) => status::ping(&client, &ping, json).await,
        Command::Watch(watch) => watch::watch(&client, &watch, json).await,
        Command::Events(events) => events::events(&client, &events, json).await,
        Command::Send(send) => send::send(&client, &send, json).await,
        Command::Devices(devices) => devices::devices(&client, &devices, json).await,
        Command::Calibrate(calibrate) => calibrate::calibrate(&client, &calibrate, json).await,
        Command::Record(record) => recordings::record(&client, record, json).await,
        Command::Play(play) => recordings::play(&client, play, json).await,
        Command::Step(step) => control::step(&client, &step, json).await,
        Command::Load(load) => control::load(&client, &load, json).await,
        Command::Reset => control::reset(&client, json).await,
        Command::Pause => control::pause(&client, json).await,
        Command::Resume => control::resume(&client, json).await,
        Command::Completions(completions) => shell::completions(&completions),
        Command::Man(man) => shell::man(&man),
    }
}

/// Until the user or the system asks to stop.
async fn stop_signal() {
    let terminated = async {
        match signal(SignalKind::terminate()) {
            Ok(mut signals) => {
                signals.recv().await;
            }
            Err(_) => std::future::pending().await,
        }
    };
    tokio::select! {
        _ = tokio::signal::ctrl_c() => {}
        () = terminated => {}
    }
}

/// Whether whoever read our output has gone, as `head` does.
fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error
        .downcast_ref::<io::Error>()
        .is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

/// A refused call in one line.
fn refusal(status: &Status) -> anyhow::Error {
    match status.message().lines().next() {
        Some(message) if !message.is_empty() => anyhow::anyhow!("the daemon refuses: {message}"),
        _ => anyhow::anyhow!("the daemon refuses: {}", status.code().description()),
    }
}
