//! A CyberGlove behind its interface box. **No real glove has been compared with it.**

use crate::emulate::deaf::Deafness;
use crate::emulate::glove_command::{Command, MAX_COMMAND, next_command};
use crate::emulate::glove_record::{
    RecordParts, ascii_record, binary_record, condition, status_byte,
};
use crate::emulate::line_fault::LineFaults;
use crate::emulate::{Emulator, soonest_ns};
use crate::glove::calibrate::Handedness;
use crate::glove::cyberglove::protocol::{
    ERROR, ERROR_NUMBER, ERROR_UNKNOWN, PARAMETER_TOUCH, QUERY, READY_INITIALISED,
    READY_PLUGGED_IN, REINITIALISE, RESTART, STOP, TERMINATOR, TOUCH, TOUCH_ALL,
};
use crate::glove::cyberglove::settings::SensorCount;
use crate::glove::sensor::{GloveSensor, SensorMask};

/// How long the firmware needs after `^R`, ns.
const RESTART_TAKES_NS: u64 = 1_750_000_000;
/// The fastest that a period of `0 0` gives, ns.
const FASTEST_NS: u64 = 5_000_000;
/// Records sent at once by a device that was not asked for long; older ones are lost.
const MAX_BACKLOG: u64 = 4;

/// What the host can set, and a restart clears.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Registers {
    baud: u8,
    stamp: bool,
    filter: u8,
    switch_controls_light: u8,
    light: bool,
    mask: SensorMask,
    n_sampled: u8,
    flags: [u8; 3],
    quantised: u8,
    period: [u8; 4],
    status: bool,
    external_sync: u8,
}

impl Registers {
    /// The state at power-on: everything off, every sensor sent, 100 Hz.
    const fn at_power_on(mask: SensorMask) -> Self {
        Self {
            baud: 0,
            stamp: false,
            filter: 0,
            switch_controls_light: 0,
            light: false,
            mask,
            n_sampled: mask.count() as u8,
            flags: [0; 3],
            quantised: 0,
            period: [0x04, 0x80, 0x00, 0x01],
            status: false,
            external_sync: 0,
        }
    }
}

/// A CyberGlove as a state machine, seen from its side of the line.
#[derive(Debug, Clone)]
pub struct CyberGloveEmulator {
    /// What goes wrong on the line.
    pub faults: LineFaults,
    /// Time that `^R` takes to be answered, ns.
    pub restart_takes_ns: u64,
    hardware: SensorMask,
    hand: Handedness,
    raw: [u8; GloveSensor::N_SLOTS],
    plugged_in: bool,
    switch_on: bool,
    /// Strengths of the vibrators of a CyberTouch.
    touch: Option<[u8; 6]>,
    registers: Registers,
    input: Vec<u8>,
    output: Vec<u8>,
    /// Next sample of the stream, ns, and whether it is ASCII.
    stream: Option<(u64, bool)>,
    /// While the firmware restarts.
    deaf: Deafness,
}

impl CyberGloveEmulator {
    /// A glove that is plugged in, with every sensor in its middle.
    #[must_use]
    pub fn new(sensors: SensorCount, hand: Handedness) -> Self {
        let hardware = match sensors {
            SensorCount::Eighteen => SensorMask::EIGHTEEN,
            SensorCount::TwentyTwo => SensorMask::TWENTY_TWO,
        };
        Self {
            faults: LineFaults::none(),
            restart_takes_ns: RESTART_TAKES_NS,
            hardware,
            hand,
            raw: [128; GloveSensor::N_SLOTS],
            plugged_in: true,
            switch_on: false,
            touch: None,
            registers: Registers::at_power_on(hardware),
            input: Vec::new(),
            output: Vec::new(),
            stream: None,
            deaf: Deafness::default(),
        }
    }

    /// Bends the glove: raw counts in the order of its record (18 or 22 of them). Values beyond the glove's sensors
    /// are ignored, missing ones stay as they are, and 0 is sent as 1.
    pub fn set_sensors(&mut self, raw: &[u8]) {
        for (slot, value) in self.hardware.slots().zip(raw) {
            self.raw[slot] = (*value).max(1);
        }
    }

    /// Bends the glove: raw counts by wire slot, as [`GloveCalibration::counts`] gives them; 0 is sent as 1.
    ///
    /// [`GloveCalibration::counts`]: crate::glove::calibrate::GloveCalibration::counts
    pub fn set_slots(&mut self, raw: &[u8; GloveSensor::N_SLOTS]) {
        self.raw = raw.map(|value| value.max(1));
    }

    /// Bends one sensor, raw counts.
    pub fn set_sensor(&mut self, sensor: GloveSensor, raw: u8) {
        self.raw[sensor.slot()] = raw.max(1);
    }

    /// Puts the wrist switch on or off.
    pub const fn set_switch(&mut self, switch_on: bool) {
        self.switch_on = switch_on;
    }

    /// Plugs the glove into its box, or pulls it out: records then carry `eg`.
    pub const fn set_plugged_in(&mut self, plugged_in: bool) {
        self.plugged_in = plugged_in;
    }

    /// Makes it a CyberTouch, with still vibrators.
    pub const fn add_touch(&mut self) {
        self.touch = Some([0; 6]);
    }

    /// The strengths of the vibrators of a CyberTouch: thumb to little finger, palm.
    #[must_use]
    pub const fn touch(&self) -> Option<[u8; 6]> {
        self.touch
    }

    fn set_touch(&mut self, operands: &[u8]) {
        let Some(touch) = &mut self.touch else {
            return;
        };
        match operands {
            [TOUCH_ALL, strengths @ ..] => {
                for (place, strength) in touch.iter_mut().zip(strengths) {
                    *place = *strength;
                }
            }
            [_, pairs @ ..] => {
                for pair in pairs.chunks_exact(2) {
                    if let Some(place) = touch.get_mut(usize::from(pair[0])) {
                        *place = pair[1];
                    }
                }
            }
            [] => {}
        }
    }

    fn say(&mut self, bytes: Vec<u8>) {
        let bytes = self.faults.apply(bytes);
        self.output.extend(bytes);
    }

    fn period_ns(&self) -> u64 {
        let [a, b, c, d] = self.registers.period.map(u64::from);
        let product = (256 * a + b) * (256 * c + d);
        (product * 1_000_000_000 / 115_200).max(FASTEST_NS)
    }

    fn sample(&mut self, now_ns: u64, letter: u8, ascii: bool) {
        let sent = self.hardware.intersection(self.registers.mask);
        let sensors: Vec<u8> = sent
            .slots()
            .take(usize::from(self.registers.n_sampled))
            .map(|slot| self.raw[slot])
            .collect();
        let parts = RecordParts {
            sensors: &sensors,
            // The unit is not known from any source; milliseconds serve.
            stamp: self.registers.stamp.then_some((now_ns / 1_000_000) as u32),
            status: self.registers.status.then_some(status_byte(
                self.plugged_in,
                (self.switch_on, self.registers.light),
            )),
            error: condition(self.plugged_in),
        };
        let record = if ascii {
            ascii_record(letter, &parts)
        } else {
            binary_record(letter, &parts)
        };
        self.say(record);
    }

    fn obey(&mut self, now_ns: u64, command: Command) {
        match command {
            Command::Stop => {
                self.stream = None;
                self.say(vec![STOP, TERMINATOR]);
            }
            Command::Restart => {
                self.stream = None;
                self.input.clear();
                self.deaf.begin(now_ns + self.restart_takes_ns);
            }
            Command::Reinitialise => self.say(vec![REINITIALISE, b'\r', b'\n', TERMINATOR]),
            Command::Sample { ascii } => self.sample(now_ns, b'G', ascii),
            Command::Stream { ascii } => self.stream = Some((now_ns, ascii)),
            Command::Information => self.say(b"?iCyberGlove, emulated\r\n\0".to_vec()),
            Command::Query { letter, ascii } => self.answer(letter, ascii),
            Command::Set {
                letter,
                operands,
                ascii,
            } => self.set(letter, &operands, ascii),
            Command::Unknown => self.refuse(ERROR_UNKNOWN),
        }
    }

    fn refuse(&mut self, code: u8) {
        self.say(vec![ERROR, code, TERMINATOR]);
    }

    fn answer(&mut self, letter: u8, ascii: bool) {
        let Some(data) = self.query_data(letter) else {
            self.refuse(ERROR_UNKNOWN);
            return;
        };
        if ascii {
            let numbers: String = data.iter().map(|byte| format!(" {byte}")).collect();
            let letter = char::from(letter.to_ascii_lowercase());
            self.say(format!("?{letter}{numbers}\r\n\0").into_bytes());
        } else {
            let mut reply = vec![QUERY, letter];
            reply.extend(data);
            reply.push(TERMINATOR);
            self.say(reply);
        }
    }

    fn query_data(&self, letter: u8) -> Option<Vec<u8>> {
        let registers = &self.registers;
        let ready = if self.plugged_in { READY_PLUGGED_IN } else { 0 } | READY_INITIALISED;
        Some(match letter {
            b'B' => vec![registers.baud],
            b'C' => {
                let n_sensors = self.hardware.count();
                [vec![0; n_sensors], vec![128; n_sensors]].concat()
            }
            b'D' => vec![u8::from(registers.stamp)],
            b'F' => vec![registers.filter],
            b'G' => vec![ready],
            b'J' => vec![registers.switch_controls_light],
            b'K' => self.hardware.to_wire().to_vec(),
            b'L' => vec![u8::from(registers.light)],
            b'M' => registers.mask.to_wire().to_vec(),
            b'N' => vec![registers.n_sampled],
            b'P' => {
                let [first, second, last] = registers.flags;
                let touch = if self.touch.is_some() {
                    PARAMETER_TOUCH
                } else {
                    0
                };
                vec![first, second, last | touch]
            }
            b'Q' => vec![registers.quantised],
            b'R' => vec![u8::from(self.hand == Handedness::Right)],
            b'S' => vec![self.hardware.count() as u8],
            b'T' => registers.period.to_vec(),
            b'U' => vec![u8::from(registers.status)],
            b'V' => vec![1, 0, 2, 0],
            b'W' => vec![u8::from(self.switch_on)],
            b'Y' => vec![registers.external_sync],
            _ => return None,
        })
    }

    fn set(&mut self, letter: u8, operands: &[u8], ascii: bool) {
        let registers = &mut self.registers;
        match (letter, operands) {
            (b'B', [code]) => registers.baud = *code,
            (b'D', [on @ 0..=1]) => registers.stamp = *on == 1,
            (b'F', [on @ 0..=1]) => registers.filter = *on,
            (b'J', [on @ 0..=1]) => registers.switch_controls_light = *on,
            (b'L', [on @ 0..=1]) => registers.light = *on == 1,
            (b'M', [a, b, c]) => registers.mask = SensorMask::from_wire([*a, *b, *c]),
            (b'N', [count @ 1..=24]) => registers.n_sampled = *count,
            (b'P', [a, b, c]) => registers.flags = [*a, *b, *c],
            (b'Q', [on @ 0..=1]) => registers.quantised = *on,
            (b'T', [a, b, c, d]) => registers.period = [*a, *b, *c, *d],
            (b'U', [on @ 0..=1]) => registers.status = *on == 1,
            (b'Y', [on @ 0..=1]) => registers.external_sync = *on,
            (TOUCH, [_, ..]) => self.set_touch(operands),
            // The on-board calibration is taken and changes nothing here.
            (b'C', [_, ..]) => {}
            _ => {
                self.refuse(ERROR_NUMBER);
                return;
            }
        }
        if ascii {
            self.say(vec![letter.to_ascii_lowercase(), b'\r', b'\n', TERMINATOR]);
        } else {
            self.say(vec![letter, TERMINATOR]);
        }
    }

    fn finish_restart(&mut self, now_ns: u64) {
        if self.deaf.ends(now_ns) {
            self.registers = Registers::at_power_on(self.hardware);
            self.say(vec![RESTART, b'\r', b'\n', TERMINATOR]);
        }
    }
}

impl Emulator for CyberGloveEmulator {
    fn push(&mut self, now_ns: u64, bytes: &[u8]) {
        self.finish_restart(now_ns);
        if self.faults.is_frozen() {
            return;
        }
        for byte in bytes {
            if self.deaf.is_on() {
                return;
            }
            self.input.push(*byte);
            while let Some((command, n_bytes)) = next_command(&self.input, self.hardware.count()) {
                self.input.drain(..n_bytes);
                self.obey(now_ns, command);
            }
            if self.input.len() > MAX_COMMAND {
                self.input.clear();
                self.refuse(ERROR_NUMBER);
            }
        }
    }

    fn poll(&mut self, now_ns: u64) -> Vec<u8> {
        self.finish_restart(now_ns);
        let period_ns = self.period_ns();
        if let Some((next_ns, ascii)) = self.stream {
            let oldest_ns = now_ns.saturating_sub(MAX_BACKLOG * period_ns);
            let mut next_ns = next_ns.max(oldest_ns);
            while next_ns <= now_ns {
                self.sample(next_ns, b'S', ascii);
                next_ns += period_ns;
            }
            self.stream = Some((next_ns, ascii));
        }
        std::mem::take(&mut self.output)
    }

    fn deadline(&self) -> Option<u64> {
        let stream_ns = self.stream.map(|(next_ns, _)| next_ns);
        soonest_ns(&self.output, [stream_ns, self.deaf.end_ns()])
    }
}
