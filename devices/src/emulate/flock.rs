//! A Flock of Birds: one bird alone, or up to 14 on a bus. **No real unit has been compared with it.** Records with a
//! matrix are not sent, the hemisphere changes nothing, and there is no line RTS.

use nalgebra::{Point3, UnitQuaternion};

use crate::emulate::beat::Beat;
use crate::emulate::deaf::Deafness;
use crate::emulate::flock_record::{FlockForm, answer_to_examine, bird_record};
use crate::emulate::line_fault::LineFaults;
use crate::emulate::receiver::{Receiver, numbered};
use crate::emulate::{Emulator, soonest_ns};
use crate::tracker::flock::protocol::{
    AUTO_CONFIGURE, BUTTON_MODE, CHANGE, ERROR, EVERY_MEASUREMENT, EXAMINE, GROUP_MODE, HEMISPHERE,
    N_ADDRESSES, POINT, RUN, SLEEP, STREAM, TO_BIRD, UNIT_FLIES, UNIT_HAS_SENSOR, UNIT_RUNS,
};
use crate::tracker::flock::settings::Scale;

/// Measurements in a second; the answers about rate and crystal say 103.52.
const RATE_HZ: u64 = 103;
/// Quiet that the bus needs before it is configured, and deafness after, ns.
const BUS_QUIET_NS: u64 = 300_000_000;
/// Time that a unit takes to start, ns.
const STARTING_NS: u64 = 2_000_000_000;
/// Error code: invalid command.
const INVALID_COMMAND: u8 = 6;
/// Error code: no bird at an address.
const NO_BIRD: u8 = 13;

/// One bird with what is asked of it.
#[derive(Debug, Clone)]
pub(crate) struct Bird {
    pub(crate) sensor: Receiver,
    pub(crate) form: FlockForm,
    /// The byte of buttons, while it is asked for.
    pub(crate) sends_buttons: bool,
    pub(crate) buttons: u8,
}

impl Bird {
    fn at_power_on() -> Self {
        Self {
            sensor: Receiver::in_front(true),
            form: FlockForm::PositionAngles,
            sends_buttons: false,
            buttons: 0,
        }
    }
}

/// A Flock of Birds as a state machine, seen from its side of the line.
#[derive(Debug, Clone)]
pub struct FlockEmulator {
    /// What goes wrong on the line.
    pub faults: LineFaults,
    /// Position at full range.
    pub scale: Scale,
    birds: Vec<Bird>,
    /// Whether the units have addresses on a bus.
    on_bus: bool,
    /// Units that the bus is configured for.
    n_configured: u8,
    is_group: bool,
    sleeps: bool,
    /// Measurements for each record of a stream.
    divider: u64,
    error: u8,
    /// Address of the next command.
    address: u8,
    beat: Beat,
    deaf: Deafness,
    /// When the last byte came, ns.
    heard_ns: Option<u64>,
    command: Vec<u8>,
    output: Vec<u8>,
}

impl FlockEmulator {
    /// One bird with switches set to address 0, 0.3 m in front of the transmitter.
    #[must_use]
    pub fn alone() -> Self {
        Self::with(1, false)
    }

    /// Birds at the addresses from 1 on, up to 14, of which none flies until the bus is configured.
    #[must_use]
    pub fn group(n_birds: u8) -> Self {
        Self::with(usize::from(n_birds).clamp(1, N_ADDRESSES), true)
    }

    fn with(n_birds: usize, on_bus: bool) -> Self {
        Self {
            faults: LineFaults::none(),
            scale: Scale::Inches36,
            birds: vec![Bird::at_power_on(); n_birds],
            on_bus,
            n_configured: 0,
            is_group: false,
            sleeps: false,
            divider: 1,
            error: 0,
            address: 1,
            beat: Beat::new(RATE_HZ),
            deaf: Deafness::default(),
            heard_ns: None,
            command: Vec::new(),
            output: Vec::new(),
        }
    }

    /// Moves the sensor of a bird (from 1): position in transmitter space in m, and the rotation that takes sensor
    /// coordinates to transmitter space. Another number changes nothing.
    pub fn set_pose(&mut self, bird: u8, position: Point3<f64>, rotation: UnitQuaternion<f64>) {
        if let Some(bird) = self.bird(bird) {
            bird.sensor.place(position, rotation);
        }
    }

    /// Plugs the sensor of a bird in, or pulls it out; an extended-range controller is a unit without one.
    pub fn set_connected(&mut self, bird: u8, connected: bool) {
        if let Some(bird) = self.bird(bird) {
            bird.sensor.connected = connected;
        }
    }

    /// The byte of buttons of a bird: 00, 10, 30 or 70.
    pub fn set_buttons(&mut self, bird: u8, buttons: u8) {
        if let Some(bird) = self.bird(bird) {
            bird.buttons = buttons;
        }
    }

    /// What the line RTS and a power cut do: everything is forgotten, and the unit starts for 2 s.
    pub fn restart(&mut self, now_ns: u64) {
        for bird in &mut self.birds {
            *bird = Bird {
                sensor: bird.sensor.clone(),
                buttons: bird.buttons,
                ..Bird::at_power_on()
            };
        }
        self.n_configured = 0;
        self.is_group = false;
        self.sleeps = false;
        self.divider = 1;
        self.error = 0;
        self.address = 1;
        self.command.clear();
        self.output.clear();
        self.beat.stop();
        self.deaf.begin(now_ns + STARTING_NS);
    }

    fn bird(&mut self, number: u8) -> Option<&mut Bird> {
        numbered(&mut self.birds, number)
    }

    fn say(&mut self, bytes: Vec<u8>) {
        let bytes = self.faults.apply(bytes);
        self.output.extend(bytes);
    }

    fn send_round(&mut self) {
        if self.sleeps {
            return;
        }
        let records: Vec<_> = (1..)
            .zip(&self.birds)
            .filter(|(address, bird)| {
                let flies = !self.is_group || *address <= self.n_configured;
                bird.sensor.connected && flies && (self.is_group || *address == 1)
            })
            .map(|(address, bird)| {
                bird_record(bird, self.is_group.then_some(address), self.scale.metres())
            })
            .collect();
        records.into_iter().for_each(|record| self.say(record));
    }

    /// One byte for each address.
    fn bus_status(&self) -> [u8; N_ADDRESSES] {
        let mut status = [0; N_ADDRESSES];
        for ((address, unit), bird) in (1..).zip(&mut status).zip(&self.birds) {
            if !self.on_bus || address <= self.n_configured {
                *unit = UNIT_FLIES;
                *unit |= if self.sleeps { 0 } else { UNIT_RUNS };
            }
            *unit |= if bird.sensor.connected {
                UNIT_HAS_SENSOR
            } else {
                0
            };
        }
        status
    }

    fn change(&mut self, now_ns: u64, parameter: u8, value: u8) {
        match parameter {
            AUTO_CONFIGURE if self.on_bus => {
                let was_quiet = self
                    .heard_ns
                    .is_none_or(|heard_ns| now_ns.saturating_sub(heard_ns) >= BUS_QUIET_NS);
                if was_quiet && usize::from(value) <= self.birds.len() {
                    self.n_configured = value;
                } else {
                    self.error = NO_BIRD;
                }
                self.deaf.begin(now_ns + BUS_QUIET_NS);
            }
            GROUP_MODE if self.on_bus => self.is_group = value != 0,
            _ => self.error = INVALID_COMMAND,
        }
    }

    fn examine(&mut self, parameter: u8) {
        let answer = answer_to_examine(parameter, &self.bus_status(), self.error);
        match answer {
            Some(answer) => self.say(answer),
            None => self.error = INVALID_COMMAND,
        }
        if parameter == ERROR {
            self.error = 0;
        }
    }

    /// Obeys the command that has been gathered; false while operands are missing.
    fn obey(&mut self, now_ns: u64) -> bool {
        match *self.command.as_slice() {
            [] | [CHANGE | EXAMINE | BUTTON_MODE | HEMISPHERE | b'A' | b'0'] => return false,
            [CHANGE | HEMISPHERE, _] => return false,
            [POINT] => {
                self.beat.stop();
                self.send_round();
            }
            [STREAM] => {
                self.beat = Beat::new(RATE_HZ / self.divider);
                self.beat.start(now_ns);
            }
            [RUN] => self.sleeps = false,
            [SLEEP] => self.sleeps = true,
            [byte @ EVERY_MEASUREMENT..=b'T'] => {
                let dividers = [1, 2, 8, 32];
                self.divider = dividers[usize::from(byte - EVERY_MEASUREMENT)];
            }
            [CHANGE, parameter, value] => self.change(now_ns, parameter, value),
            [EXAMINE, parameter] => self.examine(parameter),
            [prefix] if prefix > TO_BIRD => {
                self.address = prefix - TO_BIRD;
                self.command.clear();
                return true;
            }
            ref command => {
                let (command, address) = (command.to_vec(), self.address);
                self.error = self
                    .obey_bird(address, &command)
                    .err()
                    .unwrap_or(self.error);
            }
        }
        self.command.clear();
        self.address = 1;
        true
    }

    /// A command to one bird, or the code of the error.
    fn obey_bird(&mut self, address: u8, command: &[u8]) -> Result<(), u8> {
        let bird = self.bird(address).ok_or(NO_BIRD)?;
        match *command {
            [BUTTON_MODE, on] => bird.sends_buttons = on != 0,
            [HEMISPHERE, _, _] | [b'A' | b'0', _] => {}
            [letter] => bird.form = FlockForm::from_command(letter).ok_or(INVALID_COMMAND)?,
            _ => return Err(INVALID_COMMAND),
        }
        Ok(())
    }
}

impl Emulator for FlockEmulator {
    fn push(&mut self, now_ns: u64, bytes: &[u8]) {
        self.deaf.ends(now_ns);
        for byte in bytes {
            if self.faults.is_frozen() || self.deaf.is_on() {
                return;
            }
            self.command.push(*byte);
            if self.obey(now_ns) {
                self.heard_ns = Some(now_ns);
            }
        }
    }

    fn poll(&mut self, now_ns: u64) -> Vec<u8> {
        self.deaf.ends(now_ns);
        while self.beat.due(now_ns).is_some() {
            self.send_round();
        }
        std::mem::take(&mut self.output)
    }

    fn deadline(&self) -> Option<u64> {
        soonest_ns(&self.output, [self.beat.next_ns(), self.deaf.end_ns()])
    }
}
