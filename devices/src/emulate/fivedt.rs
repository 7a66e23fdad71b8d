//! 5DT gloves of 5, 14 and 16. **No real glove has been compared with them.**

use crate::emulate::Emulator;
use crate::emulate::beat::Beat;
use crate::emulate::line_fault::LineFaults;
use crate::glove::calibrate::Handedness;
use crate::glove::fivedt::checksum::Rule;
use crate::glove::fivedt::format::FLEXED;
use crate::glove::fivedt::long_packet::{ABOUT, CLOSE, DATA, LAST_SENSORS, OPEN, SENSORS};
use crate::glove::fivedt::settings::Model;
use crate::glove::fivedt::short_packet::{
    DONE, HEADER, INFORMATION, INFORMATION_HEADER, INFORMATION_LENGTH, RESET, SAMPLE, STREAM,
    capability_of,
};
use crate::glove::sensor::GloveSensor;

/// Data packets of a glove of 14 or 16 for one packet about the glove.
const DATA_PER_ABOUT: u32 = 50;
/// Version that the glove gives, major and minor.
const VERSION: [u8; 2] = [1, 2];

/// A 5DT glove as a state machine, seen from its side of the line.
#[derive(Debug, Clone)]
pub struct FiveDtEmulator {
    /// What goes wrong on the line.
    pub faults: LineFaults,
    /// How the check byte is made; `None` sends 0. No source says what a real glove does.
    pub checksum: Option<Rule>,
    /// Whether a glove of five ends every record in 55, as some do.
    pub appends_done: bool,
    model: Model,
    hand: Handedness,
    raw: [u16; GloveSensor::N_SLOTS],
    /// Pitch and roll.
    tilt: [u16; 2],
    beat: Beat,
    n_data: u32,
    output: Vec<u8>,
}

impl FiveDtEmulator {
    /// A glove at rest: straight fingers, level, the sum over all bytes as check byte of a glove of five.
    #[must_use]
    pub fn new(model: Model, hand: Handedness) -> Self {
        let mut beat = Beat::new(match model {
            Model::Five => 100,
            Model::FiveWireless => 60,
            Model::Fourteen | Model::Sixteen => 50,
        });
        if model != Model::Five {
            beat.start(0);
        }
        let is_short = matches!(model, Model::Five | Model::FiveWireless);
        Self {
            faults: LineFaults::none(),
            checksum: is_short.then_some(Rule::Sum),
            appends_done: false,
            model,
            hand,
            raw: [0; GloveSensor::N_SLOTS],
            tilt: [model.raw_max() as u16 / 2; 2],
            beat,
            n_data: 0,
            output: Vec::new(),
        }
    }

    /// Bends the glove: raw values by wire slot. A flexure of a glove of five is the mean of the joints that it spans.
    pub fn set_slots(&mut self, raw: &[u16; GloveSensor::N_SLOTS]) {
        let raw_max = self.model.raw_max() as u16;
        self.raw = raw.map(|value| value.min(raw_max));
    }

    /// Bends a glove of five: flexures from the thumb to the little finger.
    pub fn set_flexures(&mut self, flexures: [u8; 5]) {
        for (sensors, flexure) in FLEXED.iter().zip(flexures) {
            for sensor in sensors {
                self.raw[sensor.slot()] = u16::from(flexure);
            }
        }
    }

    /// Tilts the glove: raw values of pitch and roll. A glove of 16 does not send them.
    pub fn set_tilt(&mut self, pitch: u16, roll: u16) {
        let raw_max = self.model.raw_max() as u16;
        self.tilt = [pitch.min(raw_max), roll.min(raw_max)];
    }

    fn say(&mut self, bytes: Vec<u8>) {
        let bytes = self.faults.apply(bytes);
        self.output.extend(bytes);
    }

    fn record(&mut self) {
        match self.model {
            Model::Five | Model::FiveWireless => self.short_record(),
            Model::Fourteen | Model::Sixteen => {
                if self.n_data.is_multiple_of(DATA_PER_ABOUT) {
                    self.about();
                }
                self.n_data = self.n_data.wrapping_add(1);
                self.long_record();
            }
        }
    }

    fn short_record(&mut self) {
        let mut flexures = FLEXED.map(|sensors| {
            let sum: u16 = sensors.iter().map(|sensor| self.raw[sensor.slot()]).sum();
            (sum / sensors.len() as u16) as u8
        });
        if self.hand == Handedness::Left {
            flexures.reverse();
        }
        let tilt = self.tilt.map(|value| value as u8);
        let mut record = vec![HEADER];
        record.extend(flexures);
        record.extend(tilt);
        record.push(self.check(&[HEADER], &record[1..]));
        if self.model == Model::FiveWireless {
            record.push(capability_of(self.hand));
        } else if self.appends_done {
            record.push(DONE);
        }
        self.say(record);
    }

    fn long_record(&mut self) {
        let last = if self.model == Model::Sixteen {
            LAST_SENSORS.map(|sensor| self.raw[sensor.slot()])
        } else {
            self.tilt
        };
        let values = SENSORS.iter().map(|sensor| self.raw[sensor.slot()]);
        let mut record = vec![OPEN, DATA];
        for value in values.chain(last) {
            record.extend(value.to_be_bytes());
        }
        record.push(self.check(&[OPEN, DATA], &record[2..]));
        record.push(CLOSE);
        self.say(record);
    }

    fn check(&self, header: &[u8], body: &[u8]) -> u8 {
        self.checksum.map_or(0, |rule| rule.of(header, body))
    }

    fn about(&mut self) {
        let [major, minor] = VERSION;
        let hand = u8::from(self.hand == Handedness::Right);
        self.say(vec![OPEN, ABOUT, major, minor, hand, 1, CLOSE]);
    }

    fn information(&self) -> Vec<u8> {
        let [major, minor] = VERSION;
        let hand = u8::from(self.hand == Handedness::Right);
        let mut block = INFORMATION_HEADER.to_vec();
        block.extend([major, minor, hand, 0x1F]);
        block.resize(16, 0);
        block.extend(b"DG5 emulated");
        block.resize(INFORMATION_LENGTH, 0);
        block
    }

    fn obey(&mut self, now_ns: u64, command: u8) {
        match command {
            RESET => {
                self.beat.stop();
                self.say(vec![DONE]);
            }
            SAMPLE => self.record(),
            STREAM => self.beat.start(now_ns),
            INFORMATION => {
                let block = self.information();
                self.say(block);
            }
            // Gestures, and what a glove does not know.
            _ => {}
        }
    }
}

impl Emulator for FiveDtEmulator {
    fn push(&mut self, now_ns: u64, bytes: &[u8]) {
        // By radio, and from the larger gloves, nothing is heard.
        if self.model != Model::Five || self.faults.is_frozen() {
            return;
        }
        for command in bytes {
            self.obey(now_ns, *command);
        }
    }

    fn poll(&mut self, now_ns: u64) -> Vec<u8> {
        while self.beat.due(now_ns).is_some() {
            self.record();
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
