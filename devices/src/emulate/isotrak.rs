//! An Isotrak II or 3SPACE Tracker with up to two receivers. **No real unit has been compared with it.** The form of its
//! ASCII records and the fields of its status are not known; those of the Fastrak stand in.

use nalgebra::{Point3, UnitQuaternion};

use crate::emulate::beat::Beat;
use crate::emulate::deaf::Deafness;
use crate::emulate::fastrak_record::{data_record, refusal, status_flags};
use crate::emulate::line_fault::LineFaults;
use crate::emulate::polhemus_command::{Command, CommandReader};
use crate::emulate::receiver::{Receiver, numbered};
use crate::emulate::{Emulator, soonest_ns};
use crate::tracker::fastrak::decode::{Encoding, Item, LengthUnit};
use crate::tracker::fastrak::protocol::{
    ASCII, BINARY, CENTIMETRES, CONTINUOUS, DATA, DEFAULTS, FLAG_BINARY, FLAG_CENTIMETRES,
    FLAG_CONTINUOUS, GOOD, INCHES, POLL, QUIET, REINITIALISE, STATUS,
};
use crate::tracker::isotrak::protocol::{
    BUTTON_DOWN, BUTTON_UP, Model, N_STATIONS, QUATERNION_SCALE, RECORD_LENGTH, STATUS_LENGTH,
    TOTAL_RATE_HZ,
};
use crate::tracker::packed::pack_sevens;

/// How long the unit is deaf after `^Y`, ns.
const REINITIALISE_TAKES_NS: u64 = 10_000_000_000;

#[derive(Debug, Clone)]
struct Station {
    receiver: Receiver,
    pressed: Option<bool>,
}

/// An Isotrak II or 3SPACE Tracker as a state machine, seen from its side of the line.
#[derive(Debug, Clone)]
pub struct IsotrakEmulator {
    /// What goes wrong on the line.
    pub faults: LineFaults,
    /// Time that `^Y` leaves the unit deaf, ns.
    pub reinitialise_takes_ns: u64,
    model: Model,
    stations: [Station; N_STATIONS],
    is_binary: bool,
    is_centimetres: bool,
    /// Whether the list is position and quaternion, the only one that is sent in binary here.
    has_list: bool,
    beat: Beat,
    deaf: Deafness,
    commands: CommandReader,
    output: Vec<u8>,
}

impl IsotrakEmulator {
    /// A unit at power-on (ASCII, inches, polled), with a receiver on station 1, 0.3 m in front of the transmitter.
    #[must_use]
    pub fn new(model: Model) -> Self {
        Self {
            faults: LineFaults::none(),
            reinitialise_takes_ns: REINITIALISE_TAKES_NS,
            model,
            stations: std::array::from_fn(|index| Station {
                receiver: Receiver::in_front(index == 0),
                pressed: None,
            }),
            is_binary: false,
            is_centimetres: false,
            has_list: false,
            beat: Beat::new(TOTAL_RATE_HZ),
            deaf: Deafness::default(),
            commands: CommandReader::default(),
            output: Vec::new(),
        }
    }

    /// Moves the receiver of a station (1 or 2): position in transmitter space in m, and the rotation that takes sensor
    /// coordinates to transmitter space. Another station number changes nothing.
    pub fn set_pose(&mut self, station: u8, position: Point3<f64>, rotation: UnitQuaternion<f64>) {
        if let Some(station) = self.station(station) {
            station.receiver.place(position, rotation);
        }
    }

    /// Plugs the receiver of a station (1 or 2) in, or pulls it out: its records then stay away.
    pub fn set_connected(&mut self, station: u8, connected: bool) {
        if let Some(station) = self.station(station) {
            station.receiver.connected = connected;
        }
    }

    /// The button of a stylus on a station (1 or 2); `None` is a receiver without one.
    pub fn set_button(&mut self, station: u8, pressed: Option<bool>) {
        if let Some(station) = self.station(station) {
            station.pressed = pressed;
        }
    }

    fn station(&mut self, number: u8) -> Option<&mut Station> {
        numbered(&mut self.stations, number)
    }

    fn say(&mut self, bytes: Vec<u8>) {
        let bytes = self.faults.apply(bytes);
        self.output.extend(bytes);
    }

    /// Rounds in a second: the rate is shared by the receivers that are plugged in.
    fn rate_hz(&self) -> u64 {
        let connected = self
            .stations
            .iter()
            .filter(|station| station.receiver.connected);
        TOTAL_RATE_HZ / connected.count().max(1) as u64
    }

    fn send_round(&mut self) {
        for (number, station) in (1..).zip(self.stations.clone()) {
            if !station.receiver.connected {
                continue;
            }
            let record = if self.is_binary && self.has_list {
                self.binary_record(number, &station)
            } else {
                let list = [Item::Position, Item::Euler, Item::CrLf];
                let unit = if self.is_centimetres {
                    LengthUnit::Centimetres
                } else {
                    LengthUnit::Inches
                };
                let pose = &station.receiver.pose;
                data_record(number, None, pose, &list, (Encoding::Ascii, unit))
            };
            self.say(record);
        }
    }

    fn binary_record(&self, number: u8, station: &Station) -> Vec<u8> {
        let third = match station.pressed {
            None => GOOD,
            Some(true) => BUTTON_DOWN,
            Some(false) => BUTTON_UP,
        };
        let mut bytes = Vec::with_capacity(RECORD_LENGTH);
        bytes.extend([DATA, b'0' + number, third]);
        let pose = &station.receiver.pose;
        let position = pose.translation.vector / self.model.metres_per_step();
        let rotation = pose.rotation;
        let wxyz = [rotation.w, rotation.i, rotation.j, rotation.k];
        let steps = position
            .iter()
            .copied()
            .chain(wxyz.map(|part| part * QUATERNION_SCALE));
        for step in steps {
            // A float to integer cast saturates: what is out of reach is held at the limit.
            bytes.extend((step.round() as i16).to_le_bytes());
        }
        pack_sevens(&bytes)
    }

    fn status(&self) -> Vec<u8> {
        let flags = status_flags([
            (FLAG_BINARY, self.is_binary),
            (FLAG_CENTIMETRES, self.is_centimetres),
            (FLAG_CONTINUOUS, self.beat.next_ns().is_some()),
        ]);
        let width = STATUS_LENGTH - 8;
        format!("21S{flags:03X}{:<width$}\r\n", "EMULATED").into_bytes()
    }

    fn obey_letter(&mut self, now_ns: u64, letter: u8) {
        match letter {
            POLL => self.send_round(),
            CONTINUOUS => {
                self.beat.set_rate(self.rate_hz());
                self.beat.start(now_ns);
            }
            QUIET => self.beat.stop(),
            ASCII => self.is_binary = false,
            BINARY => self.is_binary = true,
            INCHES => self.is_centimetres = false,
            CENTIMETRES => self.is_centimetres = true,
            STATUS => self.say(self.status()),
            DEFAULTS => self.restore_defaults(),
            REINITIALISE => {
                self.restore_defaults();
                self.output.clear();
                self.deaf.begin(now_ns + self.reinitialise_takes_ns);
            }
            // Unknown bytes are ignored.
            _ => {}
        }
    }

    fn restore_defaults(&mut self) {
        self.is_binary = false;
        self.is_centimetres = false;
        self.has_list = false;
        self.beat.stop();
    }

    /// Obeys a command with operands, given without its CR; what is no text is ignored.
    fn obey_line(&mut self, line: &[u8]) {
        let Ok(line) = std::str::from_utf8(line) else {
            return;
        };
        match (line.as_bytes().first(), line) {
            (Some(b'O'), "O2,11") => self.has_list = true,
            (Some(b'O'), "O2,4,1") => self.has_list = false,
            (Some(b'O'), _) => self.say(refusal(line, -3)),
            _ => {}
        }
    }
}

/// Whether a command with operands begins so.
fn begins_line(letter: u8) -> bool {
    b"OHxvARBbGNl".contains(&letter)
}

impl Emulator for IsotrakEmulator {
    fn push(&mut self, now_ns: u64, bytes: &[u8]) {
        self.deaf.ends(now_ns);
        for byte in bytes {
            if self.faults.is_frozen() || self.deaf.is_on() {
                return;
            }
            match self.commands.take(*byte, begins_line) {
                Some(Command::Letter(letter)) => self.obey_letter(now_ns, letter),
                Some(Command::Line(line)) => self.obey_line(&line),
                Some(Command::Overflow) => self.say(refusal("", -5)),
                None => {}
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
