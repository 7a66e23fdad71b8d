//! An OpenCyberGlove. **No real glove has been compared with it.**

use crate::emulate::Emulator;
use crate::emulate::beat::Beat;
use crate::emulate::line_fault::LineFaults;
use crate::glove::opencyberglove::format::{RATE_HZ, USUAL_ORDER};
use crate::glove::opencyberglove::packet::{N_VALUES, Packet};
use crate::glove::sensor::GloveSensor;

/// An OpenCyberGlove as a state machine, seen from its side of the line.
#[derive(Debug, Clone)]
pub struct OpenCyberGloveEmulator {
    /// What goes wrong on the line.
    pub faults: LineFaults,
    /// What its clock showed when it was switched on, ms.
    pub first_time_ms: u32,
    values: [i32; N_VALUES],
    beat: Beat,
    output: Vec<u8>,
}

impl OpenCyberGloveEmulator {
    /// A glove that is on, every sensor at 0.
    #[must_use]
    pub const fn new() -> Self {
        let mut beat = Beat::new(RATE_HZ);
        beat.start(0);
        Self {
            faults: LineFaults::none(),
            first_time_ms: 0,
            values: [0; N_VALUES],
            beat,
            output: Vec::new(),
        }
    }

    /// Bends the glove: raw values by wire slot, sent in the maker's order.
    pub fn set_slots(&mut self, raw: &[u16; GloveSensor::N_SLOTS]) {
        self.values = USUAL_ORDER.map(|sensor| i32::from(raw[sensor.slot()]));
    }

    /// Bends the glove: raw values in the order of the packet.
    pub const fn set_values(&mut self, values: [i32; N_VALUES]) {
        self.values = values;
    }
}

impl Default for OpenCyberGloveEmulator {
    fn default() -> Self {
        Self::new()
    }
}

impl Emulator for OpenCyberGloveEmulator {
    fn push(&mut self, _now_ns: u64, _bytes: &[u8]) {
        // It hears nothing.
    }

    fn poll(&mut self, now_ns: u64) -> Vec<u8> {
        while let Some(due_ns) = self.beat.due(now_ns) {
            let packet = Packet {
                values: self.values,
                time_ms: self.first_time_ms.wrapping_add((due_ns / 1_000_000) as u32),
            };
            let bytes = self.faults.apply(packet.encode().to_vec());
            self.output.extend(bytes);
        }
        std::mem::take(&mut self.output)
    }

    fn deadline(&self) -> Option<u64> {
        if self.output.is_empty() {
            self.beat.next_ns()
        } else {
            Some(0)
        }
    }
}
