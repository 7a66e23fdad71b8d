//! A glove that bends with every sixth record, and a tracker that lies still.

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
/// Records from one bend to the next: time enough for the finger to come to rest.
const BEND_EVERY: u64 = 6;
/// Raw counts of the finger, straight and bent: 20 degrees apart.
const COUNTS: [u8; 2] = [100, 140];
/// The joint that bends: the index finger's tip.
pub(crate) const BENT_JOINT: usize = 7;
/// A joint that does not: the thumb's metacarpal.
pub(crate) const FIXED_JOINT: usize = 0;

/// When each bend was written, wall clock, ns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bends(Arc<Mutex<Vec<u64>>>);

impl Bends {
    /// Notes a bend that is written now; the counts of the finger from now on.
    fn next(&self) -> u8 {
        let mut written = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        written.push(now_ns());
        COUNTS[written.len() % COUNTS.len()]
    }

    /// When the newest bend before a time was written.
    pub(crate) fn newest_before(&self, time_ns: u64) -> Option<u64> {
        let written = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        written.iter().rev().copied().find(|at_ns| *at_ns < time_ns)
    }

    /// Bends between two times.
    pub(crate) fn n_between(&self, from_ns: u64, until_ns: u64) -> usize {
        let written = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        written
            .iter()
            .filter(|at_ns| (from_ns..until_ns).contains(*at_ns))
            .count()
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
    let mut n_records = 0;
    let bend = move |now_ns: u64, glove: &mut CyberGloveEmulator| {
        // Called right before the device is asked for bytes: only where a record is due there will be one.
        if glove.deadline().is_some_and(|due_ns| due_ns <= now_ns) {
            n_records += 1;
            if n_records % BEND_EVERY == 0 {
                glove.set_sensor(GloveSensor::IndexMcp, bends.next());
            }
        }
    };
    let glove = CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right);
    Ok(Worn {
        _glove: PtyEmulator::spawn(glove, line("glove"), bend)?,
        _tracker: PtyEmulator::spawn(FastrakEmulator::new(), line("tracker"), |_, _| {})?,
    })
}
