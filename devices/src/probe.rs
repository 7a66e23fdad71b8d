//! Finds out what is on a serial port by trying the protocols that are known, one after the other.
//!
//! Trying a protocol sends its start-up commands. To a device of another kind they mean nothing, or nothing lasting; a device
//! that is no glove and no tracker should not be probed.

use std::fmt;
use std::io;
use std::time::Duration;

use crate::driver::Driver;
use crate::glove::calibrate::GloveCalibration;
use crate::network::LinkSettings;
use crate::place::Place;
use crate::trial::{Limits, Trial, run};

/// How long one protocol is tried at one line rate.
const LIMITS: Limits = Limits {
    time: Duration::from_secs(4),
    readings: 20,
    patient: false,
};
/// Share of the readings that may have been preceded by bytes that decode as nothing, in a device that is recognised.
const RESYNCS_MAX: f64 = 0.1;

/// A protocol at a line rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The protocol, with what it is asked for by default.
    pub driver: Driver,
    /// Line rate, bit/s.
    pub baud: u32,
}

impl fmt::Display for Candidate {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.driver.name())?;
        if let Some(model) = self.driver.model() {
            write!(out, " (model {model})")?;
        }
        write!(out, " at {} bit/s", self.baud)
    }
}

/// Every protocol that can be told from others, each at its likeliest rate first and then at its others. Those that only
/// listen come before those that ask, for they disturb nothing.
#[must_use]
pub fn candidates() -> Vec<Candidate> {
    let drivers = Driver::recognisable();
    let n_rates = drivers.iter().map(|driver| driver.possible_bauds().len());
    (0..n_rates.max().unwrap_or(0))
        .flat_map(|rank| {
            drivers.iter().filter_map(move |driver| {
                let baud = *driver.possible_bauds().get(rank)?;
                Some(Candidate {
                    driver: driver.clone(),
                    baud,
                })
            })
        })
        .collect()
}

/// Tries one protocol at one rate; what came of it, and whether it is this device's.
///
/// # Errors
/// When the system refuses a thread.
pub fn try_one(path: &str, candidate: &Candidate) -> io::Result<(Trial, bool)> {
    let settings = LinkSettings {
        place: Place::Serial(path.to_owned()),
        bauds: vec![candidate.baud],
        raw: true,
    };
    let session = candidate.driver.session(GloveCalibration::default());
    let trial = run(settings, session, LIMITS)?;
    let recognised = is_recognised(&trial);
    Ok((trial, recognised))
}

/// Readings came, and hardly anything between them.
fn is_recognised(trial: &Trial) -> bool {
    let n_bad = trial.stats.resyncs + trial.stats.dropped_records;
    trial.is_well()
        && trial.readings >= LIMITS.readings / 4
        && n_bad as f64 <= (trial.readings as f64 * RESYNCS_MAX).max(2.0)
}
