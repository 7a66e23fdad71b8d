//! `tsukamud doctor`

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget};
use serde_json::{Value, json};
use std::io::{IsTerminal, stderr};
use tsukamu_devices::trial::Trial;
use tsukamu_server::doctor::{Diagnosis, examine};
use tsukamu_server::settings::device::DeviceSettings;
use tsukamu_server::settings::load;
use tsukamu_server::settings::overrides::Overrides;

use super::Failure;
use super::output::say;

/// Arguments of `tsukamud doctor`.
#[derive(Debug, Args)]
pub(super) struct DoctorArgs {
    /// The settings file; also TSUKAMU_CONFIG.
    #[arg(value_name = "CONFIG", env = "TSUKAMU_CONFIG")]
    config: PathBuf,
    /// Only these devices, by name.
    #[arg(value_name = "DEVICE")]
    only: Vec<String>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Examines the devices one after the other.
pub(super) fn doctor(args: &DoctorArgs) -> Result<(), Failure> {
    let settings = load(Some(&args.config), &Overrides::default())
        .map_err(|mistakes| Failure::Usage(mistakes.to_string()))?;
    let unknown = args
        .only
        .iter()
        .find(|name| settings.devices.iter().all(|device| device.name != **name));
    if let Some(name) = unknown {
        let there: Vec<&str> = settings
            .devices
            .iter()
            .map(|device| device.name.as_str())
            .collect();
        return Err(Failure::Usage(format!(
            "{}: has no device {name:?}; it has: {}",
            args.config.display(),
            there.join(", ")
        )));
    }
    if settings.devices.is_empty() {
        say(&format!(
            "{}: names no devices; `tsukamud devices` lists what is plugged in",
            args.config.display()
        ))?;
        return Ok(());
    }
    let chosen = settings
        .devices
        .iter()
        .filter(|device| args.only.is_empty() || args.only.contains(&device.name));
    let mut rows = Vec::new();
    let mut is_all_usable = true;
    for device in chosen {
        let diagnosis = with_spinner(device)?;
        is_all_usable &= diagnosis.verdict.is_usable();
        if args.json {
            rows.push(diagnosis_json(device, &diagnosis));
        } else {
            say(&block(device, &diagnosis))?;
        }
    }
    if args.json {
        say(&json!({ "devices": rows }).to_string())?;
    }
    if is_all_usable {
        Ok(())
    } else {
        Err(Failure::Negative)
    }
}

/// Examines one device, and says on a terminal what is being done.
fn with_spinner(device: &DeviceSettings) -> Result<Diagnosis, Failure> {
    let spinner = if stderr().is_terminal() {
        ProgressBar::new_spinner()
    } else {
        ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden())
    };
    spinner.enable_steady_tick(Duration::from_millis(100));
    let progress = |words: &str| spinner.set_message(format!("{}: {words}", device.name));
    let diagnosis = examine(device, &progress);
    spinner.finish_and_clear();
    Ok(diagnosis?)
}

fn block(device: &DeviceSettings, diagnosis: &Diagnosis) -> String {
    let mark = if diagnosis.verdict.is_usable() {
        "+"
    } else {
        "x"
    };
    let verdict = diagnosis.verdict.name().replace('_', " ");
    let head = format!(
        "[{mark}] {} ({}, {}): {verdict}",
        device.name,
        device.driver.name(),
        device.port
    );
    let mut lines = vec![head];
    lines.extend(
        diagnosis
            .findings
            .iter()
            .map(|finding| format!("    {finding}")),
    );
    lines.extend(
        diagnosis
            .advice
            .iter()
            .map(|advice| format!("    -> {advice}")),
    );
    if let Some(trial) = diagnosis
        .trial
        .as_ref()
        .filter(|_| !diagnosis.verdict.is_usable())
    {
        lines.push(format!("    {}", bytes_words(trial)));
    }
    lines.join("\n")
}

fn bytes_words(trial: &Trial) -> String {
    if trial.last_bytes.is_empty() {
        return "no byte came".to_owned();
    }
    format!(
        "last of {} bytes: {}",
        trial.stats.bytes,
        hex(&trial.last_bytes)
    )
}

fn hex(bytes: &[u8]) -> String {
    let pairs: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    pairs.join(" ")
}

fn diagnosis_json(device: &DeviceSettings, diagnosis: &Diagnosis) -> Value {
    let trial = diagnosis.trial.as_ref();
    json!({
        "name": device.name, "kind": device.driver.name(), "port": device.port.to_string(),
        "verdict": diagnosis.verdict.name(), "usable": diagnosis.verdict.is_usable(),
        "findings": diagnosis.findings, "advice": diagnosis.advice,
        "rate_hz": trial.map(|trial| trial.rate_hz), "readings": trial.map(|trial| trial.readings),
        "bytes": trial.map(|trial| trial.stats.bytes), "resyncs": trial.map(|trial| trial.stats.resyncs),
        "last_bytes": trial.map(|trial| hex(&trial.last_bytes)),
    })
}
