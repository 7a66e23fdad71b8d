//! A glove that bends with every record, and a tracker that lies still.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::glove::calibrate::Handedness;
use tsukamu_devices::glove::cyberglove::settings::SensorCount;
use tsukamu_devices::glove::sensor::GloveSensor;

use crate::match_up::now_ns;

/// Records per second: a period of 5.3 ms, no multiple of the step.
pub(crate) const RATE_HZ: f64 = 188.7;
/// Bends that differ; they come again after 64 records, a third of a second.
const N_BENDS: u64 = 64;
/// Counts of the first bend.
const FIRST_COUNT: u8 = 96;
/// The joint that bends: the index finger's tip.
pub(crate) const BENT_JOINT: usize = 7;
/// A joint that does not: the thumb's metacarpal.
pub(crate) const FIXED_JOINT: usize = 0;

/// When each record was written: the place in the list is its number. Wall clock, ns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bends(Arc<Mutex<Vec<u64>>>);

impl Bends {
    fn next(&self) -> u8 {
        let mut written = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let bend = written.len() as u64 % N_BENDS;
        written.push(now_ns());
        FIRST_COUNT + bend as u8
    }

    /// The newest record before a time: which bend it has, and when it was written.
    pub(crate) fn newest_before(&self, time_ns: u64) -> Option<(u64, u64)> {
        let written = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let number = written.iter().rposition(|at_ns| *at_ns < time_ns)?;
        Some((number as u64 % N_BENDS, written[number]))
    }

    /// When the newest record with that bend before a time was written.
    pub(crate) fn written_before(&self, bend: u64, time_ns: u64) -> Option<u64> {
        let written = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let newest = written.iter().enumerate().rev();
        let mut own = newest
            .filter(|(number, _)| *number as u64 % N_BENDS == bend)
            .map(|(_, at_ns)| *at_ns);
        own.find(|at_ns| *at_ns < time_ns)
    }
}

/// The devices; they are unplugged when this is dropped.
#[derive(Debug)]
pub(crate) struct Worn {
    _glove: PtyEmulator<CyberGloveEmulator>,
    _tracker: PtyEmulator<FastrakEmulator>,
}

/// Plugs both in, as `glove` and `tracker` in that folder.
pub(crate) fn wear(folder: &Path, bends: &Bends) -> std::io::Result<Worn> {
    let line = |name: &str| PtySettings {
        link: Some(folder.join(name)),
        baud: 0,
    };
    let bends = bends.clone();
    let bend = move |now_ns: u64, glove: &mut CyberGloveEmulator| {
        // Called right before the device is asked for bytes: only where a record is due there will be one.
        if glove.deadline().is_some_and(|due_ns| due_ns <= now_ns) {
            glove.set_sensor(GloveSensor::IndexMcp, bends.next());
        }
    };
    let glove = CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right);
    Ok(Worn {
        _glove: PtyEmulator::spawn(glove, line("glove"), bend)?,
        _tracker: PtyEmulator::spawn(FastrakEmulator::new(), line("tracker"), |_, _| {})?,
    })
}
