//! What is wrong with a device, in plain words, and what to do about it.
//!
//! First what can be seen without opening anything: is it there, may this user open it, who has it open. Then it is tried for a few
//! seconds as the daemon would use it; what does not answer is asked at other line rates and in other protocols.

/// A serial port before it is opened.
mod port;
/// A device that was opened and did not do what it should.
mod search;

use std::io;
use std::time::Duration;

use tsukamu_devices::fault::Fault;
use tsukamu_devices::network::LinkSettings;
use tsukamu_devices::trial::{Limits, Trial, run};

use crate::settings::device::DeviceSettings;

/// How long a device is tried: some need 10 s to start anew.
const LIMITS: Limits = Limits {
    time: Duration::from_secs(12),
    readings: 200,
    patient: false,
};
/// Share of readings with a clamped sensor above which the calibration is another hand's.
const CLAMPED_MAX: f64 = 0.5;
/// Lost steps per reading above which the line is noisy.
const NOISY: f64 = 0.01;

/// What a device is found to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It works.
    Well,
    /// It works, and something should be looked after.
    Poorly,
    /// It is not there.
    Missing,
    /// This user may not open it.
    NoPermission,
    /// Another program has it.
    Busy,
    /// What the settings name is no device of this kind.
    NotADevice,
    /// It says nothing.
    Silent,
    /// It answers at another line rate.
    WrongBaud,
    /// It speaks another protocol.
    OtherProtocol,
    /// It speaks, and nothing that is known.
    NotUnderstood,
    /// It reports something itself, or refuses a setting.
    Complains,
}

impl Verdict {
    /// The name that programs read.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Well => "well",
            Self::Poorly => "poorly",
            Self::Missing => "missing",
            Self::NoPermission => "no_permission",
            Self::Busy => "busy",
            Self::NotADevice => "not_a_device",
            Self::Silent => "silent",
            Self::WrongBaud => "wrong_baud",
            Self::OtherProtocol => "other_protocol",
            Self::NotUnderstood => "not_understood",
            Self::Complains => "complains",
        }
    }

    /// Whether the daemon can use it.
    pub const fn is_usable(self) -> bool {
        matches!(self, Self::Well | Self::Poorly)
    }
}

/// One device, examined.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// What it is found to be.
    pub verdict: Verdict,
    /// What was found, a sentence each.
    pub findings: Vec<String>,
    /// What to do, a sentence each.
    pub advice: Vec<String>,
    /// What came of trying it; `None` when it could not be opened.
    pub trial: Option<Trial>,
}

impl Diagnosis {
    fn new(verdict: Verdict, finding: impl Into<String>) -> Self {
        Self {
            verdict,
            findings: vec![finding.into()],
            advice: Vec::new(),
            trial: None,
        }
    }

    fn advise(mut self, advice: impl Into<String>) -> Self {
        self.advice.push(advice.into());
        self
    }
}

/// Examines one device; `progress` is told what is being done.
///
/// # Errors
/// When the system refuses a thread.
pub fn examine(device: &DeviceSettings, progress: &dyn Fn(&str)) -> io::Result<Diagnosis> {
    if let Some(seen) = device.port.serial_path().and_then(port::examine) {
        return Ok(seen);
    }
    progress(&format!("trying it as a {}", device.driver.name()));
    let settings = LinkSettings {
        place: device.port.clone(),
        bauds: device.bauds.clone(),
        raw: true,
    };
    let session = device.driver.session((*device.calibration).clone());
    let trial = run(settings, session, LIMITS)?;
    let mut diagnosis = if trial.is_well() {
        working(&trial)
    } else {
        search::explain(device, &trial, progress)?
    };
    diagnosis.trial = Some(trial);
    Ok(diagnosis)
}

/// Why a port cannot be opened, as far as that can be seen without opening it; `None` when nothing is in the way.
pub fn obstacle(path: &str) -> Option<Diagnosis> {
    port::examine(path)
}

/// A device that sends readings.
fn working(trial: &Trial) -> Diagnosis {
    let mut told = format!("sends {:.0} readings per second", trial.rate_hz);
    if let Some(info) = &trial.info {
        told = format!("{}; {told}", about(info));
    }
    let mut diagnosis = Diagnosis::new(Verdict::Well, told);
    let n = trial.readings.max(1) as f64;
    if trial.clamped as f64 > CLAMPED_MAX * n {
        diagnosis.verdict = Verdict::Poorly;
        diagnosis.findings.push(format!(
            "a sensor stands at the end of its range in {:.0} % of the readings",
            100.0 * trial.clamped as f64 / n
        ));
        diagnosis.advice.push(
            "calibrate it for this wearer: tsukamu calibrate, while the daemon runs".to_owned(),
        );
    }
    let n_lost = trial.stats.resyncs + trial.stats.dropped_records;
    if n_lost as f64 > NOISY * n {
        diagnosis.verdict = Verdict::Poorly;
        diagnosis.findings.push(format!(
            "{n_lost} records were lost among {} good ones",
            trial.readings
        ));
        diagnosis.advice.push(
            "look after the cable and its length, and the line rate; keep other radios away"
                .to_owned(),
        );
    }
    if let Some(fault) = &trial.fault {
        diagnosis.verdict = Verdict::Poorly;
        diagnosis.findings.push(fault.to_string());
    }
    diagnosis
}

fn about(info: &tsukamu_devices::session::DeviceInfo) -> String {
    let mut words = vec![info.family.to_owned()];
    let named = [
        ("firmware", info.firmware.as_str()),
        ("called", info.identity.as_str()),
    ];
    for (what, text) in named {
        if !text.is_empty() {
            words.push(format!("{what} {text}"));
        }
    }
    if info.n_sensors > 0 {
        let plural = if info.n_sensors == 1 { "" } else { "s" };
        words.push(format!("{} sensor{plural}", info.n_sensors));
    }
    words.join(", ")
}

/// What a fault at opening means.
fn not_opened(fault: &Fault) -> Option<Verdict> {
    match fault {
        Fault::Missing { .. } => Some(Verdict::Missing),
        Fault::PermissionDenied { .. } => Some(Verdict::NoPermission),
        Fault::Busy { .. } | Fault::AddressInUse { .. } => Some(Verdict::Busy),
        Fault::NotSerial { .. } => Some(Verdict::NotADevice),
        _ => None,
    }
}
