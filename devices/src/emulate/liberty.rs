//! A Liberty, Patriot or Latus with up to 16 sensors. **No real unit has been compared with it.** Its ASCII frames and
//! the wording of its introduction are made up, and a bad command is passed over in silence, for how a unit answers it is
//! not known.

use nalgebra::{Point3, UnitQuaternion};

use crate::emulate::beat::Beat;
use crate::emulate::deaf::Deafness;
use crate::emulate::liberty_frame::{Moment, ascii_frame, binary_frame, introduction};
use crate::emulate::line_fault::LineFaults;
use crate::emulate::polhemus_command::{Command, CommandReader};
use crate::emulate::receiver::{Receiver, numbered};
use crate::emulate::{Emulator, soonest_ns};
use crate::tracker::liberty::protocol::{CONTINUOUS, Model, N_STATIONS, POLL, READY};

/// How long the unit is deaf after `^Y`, ns.
const RESET_TAKES_NS: u64 = 10_000_000_000;
/// Most items of a list.
const MAX_ITEMS: usize = 20;
/// Items that a list may have.
const ITEMS: [u8; 8] = [0, 1, 2, 4, 7, 8, 9, 10];
/// Frames in a second of a model whose rate is not known.
const ANY_RATE_HZ: u64 = 100;

/// One sensor with what is asked of it.
#[derive(Debug, Clone)]
pub(crate) struct Sensor {
    pub(crate) receiver: Receiver,
    pub(crate) error: Option<u8>,
    pub(crate) pressed: bool,
    pub(crate) list: Vec<u8>,
}

/// A Liberty, Patriot or Latus as a state machine, seen from its side of the line.
#[derive(Debug, Clone)]
pub struct LibertyEmulator {
    /// What goes wrong on the line.
    pub faults: LineFaults,
    /// Time that `^Y` leaves the unit deaf, ns.
    pub reset_takes_ns: u64,
    model: Model,
    sensors: Vec<Sensor>,
    is_binary: bool,
    is_centimetres: bool,
    echoes: bool,
    beat: Beat,
    deaf: Deafness,
    /// Frames since the counters were set to 0.
    n_frames: u32,
    /// When the counters were set to 0, ns.
    zero_ns: u64,
    commands: CommandReader,
    output: Vec<u8>,
}

impl LibertyEmulator {
    /// A unit at power-on (ASCII, inches, polled), with a sensor on station 1, 0.3 m in front of the source.
    #[must_use]
    pub fn new(model: Model) -> Self {
        let sensor = |index| Sensor {
            receiver: Receiver::in_front(index == 0),
            error: None,
            pressed: false,
            list: default_list(),
        };
        Self {
            faults: LineFaults::none(),
            reset_takes_ns: RESET_TAKES_NS,
            model,
            sensors: (0..N_STATIONS).map(sensor).collect(),
            is_binary: false,
            is_centimetres: false,
            echoes: false,
            beat: Beat::new(model.rate_hz().unwrap_or(ANY_RATE_HZ)),
            deaf: Deafness::default(),
            n_frames: 0,
            zero_ns: 0,
            commands: CommandReader::default(),
            output: Vec::new(),
        }
    }

    /// Moves the sensor of a station (1 to 16): position in the source's space in m, and the rotation that takes sensor
    /// coordinates to the source's space. Another station number changes nothing.
    pub fn set_pose(&mut self, station: u8, position: Point3<f64>, rotation: UnitQuaternion<f64>) {
        if let Some(sensor) = self.sensor(station) {
            sensor.receiver.place(position, rotation);
        }
    }

    /// Plugs the sensor of a station (1 to 16) in, or pulls it out: its frames then stay away.
    pub fn set_connected(&mut self, station: u8, connected: bool) {
        if let Some(sensor) = self.sensor(station) {
            sensor.receiver.connected = connected;
        }
    }

    /// The error byte of a station's frames from now on; `None` is good.
    pub fn set_error(&mut self, station: u8, error: Option<u8>) {
        if let Some(sensor) = self.sensor(station) {
            sensor.error = error;
        }
    }

    /// Presses or releases the switch of a stylus.
    pub fn set_switch(&mut self, station: u8, pressed: bool) {
        if let Some(sensor) = self.sensor(station) {
            sensor.pressed = pressed;
        }
    }

    /// Whether the unit repeats what it is told, until it is told not to.
    pub const fn set_echo(&mut self, echoes: bool) {
        self.echoes = echoes;
    }

    fn sensor(&mut self, number: u8) -> Option<&mut Sensor> {
        numbered(&mut self.sensors, number)
    }

    fn say(&mut self, bytes: Vec<u8>) {
        let bytes = self.faults.apply(bytes);
        self.output.extend(bytes);
    }

    fn send_round(&mut self, now_ns: u64, command: u8) {
        let moment = Moment {
            time_ms: (now_ns.saturating_sub(self.zero_ns) / 1_000_000) as u32,
            n_frames: self.n_frames,
            command,
        };
        let frames: Vec<_> = (1..)
            .zip(&self.sensors)
            .filter(|(_, sensor)| sensor.receiver.connected)
            .map(|(station, sensor)| {
                if self.is_binary {
                    binary_frame(self.model, station, sensor, moment, self.is_centimetres)
                } else {
                    ascii_frame(station, sensor, moment, self.is_centimetres)
                }
            })
            .collect();
        self.n_frames = self.n_frames.wrapping_add(1);
        frames.into_iter().for_each(|frame| self.say(frame));
    }

    /// Obeys a command, given in capitals and without its CR.
    fn obey(&mut self, now_ns: u64, line: &[u8]) {
        match line {
            b"F0" => self.is_binary = false,
            b"F1" => self.is_binary = true,
            b"U0" => self.is_centimetres = false,
            b"U1" => self.is_centimetres = true,
            b"Q0" => {
                self.n_frames = 0;
                self.zero_ns = now_ns;
            }
            b"\x050" => self.echoes = false,
            b"\x16" => self.say(introduction(self.model)),
            b"\x19" => self.restart(now_ns),
            [letter] if *letter == CONTINUOUS[0] => self.beat.start(now_ns),
            [b'O', operands @ ..] => self.set_list(operands),
            // Hemisphere and filters change nothing that can be seen here; what is unknown is passed over.
            _ => {}
        }
    }

    /// A station or `*`, then item numbers.
    fn set_list(&mut self, operands: &[u8]) {
        let text = String::from_utf8_lossy(operands);
        let mut words = text.split(',').map(str::trim);
        let station = words.next().unwrap_or_default();
        let Some(list) = words
            .map(|word| word.parse().ok().filter(|item| ITEMS.contains(item)))
            .collect::<Option<Vec<u8>>>()
            .filter(|list| list.len() <= MAX_ITEMS)
        else {
            return;
        };
        if station == "*" {
            for sensor in &mut self.sensors {
                sensor.list.clone_from(&list);
            }
        } else if let Some(sensor) = station
            .parse()
            .ok()
            .and_then(|station| self.sensor(station))
        {
            sensor.list = list;
        }
    }

    /// What `^Y` and a power cut do.
    fn restart(&mut self, now_ns: u64) {
        self.is_binary = false;
        self.is_centimetres = false;
        self.beat.stop();
        self.commands.clear();
        self.output.clear();
        for sensor in &mut self.sensors {
            sensor.list = default_list();
        }
        self.deaf.begin(now_ns + self.reset_takes_ns);
    }

    fn wake(&mut self, now_ns: u64) {
        if self.deaf.ends(now_ns) && self.model == Model::Patriot {
            self.say([READY, b"\r\n"].concat());
        }
    }
}

fn default_list() -> Vec<u8> {
    vec![2, 4, 1]
}

impl Emulator for LibertyEmulator {
    fn push(&mut self, now_ns: u64, bytes: &[u8]) {
        self.wake(now_ns);
        for byte in bytes {
            if self.faults.is_frozen() || self.deaf.is_on() {
                return;
            }
            if self.echoes {
                self.output.push(*byte);
            }
            let begins_line = |byte| !matches!(byte, POLL | b'\r' | b'\n');
            let command = self.commands.take(byte.to_ascii_uppercase(), begins_line);
            match command {
                Some(Command::Letter(POLL)) => {
                    self.beat.stop();
                    self.send_round(now_ns, POLL);
                }
                Some(Command::Line(line)) => self.obey(now_ns, &line),
                Some(Command::Letter(_) | Command::Overflow) | None => {}
            }
        }
    }

    fn poll(&mut self, now_ns: u64) -> Vec<u8> {
        self.wake(now_ns);
        while self.beat.due(now_ns).is_some() {
            self.send_round(now_ns, CONTINUOUS[0]);
        }
        std::mem::take(&mut self.output)
    }

    fn deadline(&self) -> Option<u64> {
        soonest_ns(&self.output, [self.beat.next_ns(), self.deaf.end_ns()])
    }
}
