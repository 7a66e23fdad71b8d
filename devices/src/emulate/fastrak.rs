//! A Fastrak with up to four receivers. **No real unit has been compared with it.**

use nalgebra::{Point3, UnitQuaternion};

use crate::emulate::beat::Beat;
use crate::emulate::deaf::Deafness;
use crate::emulate::fastrak_record::{data_record, refusal, status_flags, status_record};
use crate::emulate::line_fault::LineFaults;
use crate::emulate::polhemus_command::{Command, CommandReader};
use crate::emulate::receiver::{Receiver, numbered};
use crate::emulate::{Emulator, soonest_ns};
use crate::tracker::fastrak::decode::{Encoding, Item, LengthUnit};
use crate::tracker::fastrak::protocol::{
    ASCII, BINARY, CENTIMETRES, CONTINUOUS, DEFAULTS, FLAG_BINARY, FLAG_CENTIMETRES,
    FLAG_CONTINUOUS, INCHES, N_STATIONS, POLL, QUIET, REINITIALISE, RESUME, SAVE, STATUS, SUSPEND,
    TOTAL_RATE_HZ,
};

/// How long the unit is deaf after `^Y`, ns.
const REINITIALISE_TAKES_NS: u64 = 10_000_000_000;
/// Longest record that the unit takes on.
const MAX_RECORD: usize = 254;

#[derive(Debug, Clone)]
struct Station {
    receiver: Receiver,
    on: bool,
    list: Vec<Item>,
}

impl Station {
    fn at_power_on() -> Self {
        Self {
            receiver: Receiver::in_front(true),
            on: true,
            list: vec![Item::Position, Item::Euler, Item::CrLf],
        }
    }
}

/// A Fastrak as a state machine, seen from its side of the line.
#[derive(Debug, Clone)]
pub struct FastrakEmulator {
    /// What goes wrong on the line.
    pub faults: LineFaults,
    /// Time that `^Y` leaves the unit deaf, ns.
    pub reinitialise_takes_ns: u64,
    stations: [Station; N_STATIONS],
    encoding: Encoding,
    unit: LengthUnit,
    suspended: bool,
    beat: Beat,
    deaf: Deafness,
    commands: CommandReader,
    output: Vec<u8>,
}

impl FastrakEmulator {
    /// A unit at power-on (ASCII, inches, polled, every station on), 0.3 m in front of the transmitter.
    #[must_use]
    pub fn new() -> Self {
        Self {
            faults: LineFaults::none(),
            reinitialise_takes_ns: REINITIALISE_TAKES_NS,
            stations: std::array::from_fn(|_| Station::at_power_on()),
            encoding: Encoding::Ascii,
            unit: LengthUnit::Inches,
            suspended: false,
            beat: Beat::new(TOTAL_RATE_HZ / N_STATIONS as u64),
            deaf: Deafness::default(),
            commands: CommandReader::default(),
            output: Vec::new(),
        }
    }

    /// Moves the receiver of a station (1 to 4): position in transmitter space in m, and the rotation that takes
    /// sensor coordinates to transmitter space. Another station number changes nothing.
    pub fn set_pose(&mut self, station: u8, position: Point3<f64>, rotation: UnitQuaternion<f64>) {
        if let Some(station) = self.station(station) {
            station.receiver.place(position, rotation);
        }
    }

    /// Plugs the receiver of a station (1 to 4) in, or pulls it out: its records then carry `k`.
    pub fn set_connected(&mut self, station: u8, connected: bool) {
        if let Some(station) = self.station(station) {
            station.receiver.connected = connected;
        }
    }

    fn station(&mut self, number: u8) -> Option<&mut Station> {
        numbered(&mut self.stations, number)
    }

    fn say(&mut self, bytes: Vec<u8>) {
        let bytes = self.faults.apply(bytes);
        self.output.extend(bytes);
    }

    fn flags(&self) -> u16 {
        status_flags([
            (FLAG_BINARY, self.encoding == Encoding::Binary),
            (FLAG_CENTIMETRES, self.unit == LengthUnit::Centimetres),
            (FLAG_CONTINUOUS, self.beat.next_ns().is_some()),
        ])
    }

    /// The rate is shared by the stations that are on.
    fn share_rate(&mut self) {
        let n_on = self.stations.iter().filter(|station| station.on).count();
        self.beat.set_rate(TOTAL_RATE_HZ / n_on.max(1) as u64);
    }

    fn send_round(&mut self) {
        for number in 1..=N_STATIONS as u8 {
            let station = &self.stations[usize::from(number) - 1];
            if station.on {
                let error = if station.receiver.connected {
                    None
                } else {
                    Some(b'k')
                };
                let form = (self.encoding, self.unit);
                let pose = &station.receiver.pose;
                let record = data_record(number, error, pose, &station.list, form);
                self.say(record);
            }
        }
    }

    fn obey_letter(&mut self, now_ns: u64, letter: u8) {
        match letter {
            POLL => self.send_round(),
            CONTINUOUS => self.beat.start(now_ns),
            QUIET => self.beat.stop(),
            ASCII => self.encoding = Encoding::Ascii,
            BINARY => self.encoding = Encoding::Binary,
            INCHES => self.unit = LengthUnit::Inches,
            CENTIMETRES => self.unit = LengthUnit::Centimetres,
            STATUS => {
                let stations = self.stations.each_ref().map(|station| station.on);
                let status = status_record(self.flags(), stations);
                self.say(status);
            }
            SUSPEND => self.suspended = true,
            RESUME => self.suspended = false,
            DEFAULTS => self.restore_defaults(),
            REINITIALISE => {
                self.restore_defaults();
                self.output.clear();
                self.deaf.begin(now_ns + self.reinitialise_takes_ns);
            }
            // Saving, test results and recovery toggles change nothing that can be seen here; CR and LF end nothing.
            SAVE | b'T' | b'Y' | b't' | b'\r' | b'\n' => {}
            // Unknown bytes are ignored.
            _ => {}
        }
    }

    fn restore_defaults(&mut self) {
        self.encoding = Encoding::Ascii;
        self.unit = LengthUnit::Inches;
        self.suspended = false;
        self.beat.stop();
        for station in &mut self.stations {
            *station = Station {
                receiver: station.receiver.clone(),
                ..Station::at_power_on()
            };
        }
        self.share_rate();
    }

    /// Obeys a command with operands, given without its CR; what is no text is ignored.
    fn obey_line(&mut self, line: &[u8]) {
        let Ok(line) = std::str::from_utf8(line) else {
            return;
        };
        let numbers: Option<Vec<f64>> = line[1..]
            .split(',')
            .map(|word| word.trim().parse().ok())
            .collect();
        let Some(numbers) = numbers else {
            // Reading back the station map has an operand that is no number; alignment and the like may have none.
            if line.starts_with(['l', 'O', 'H', 'x', 'v']) && line.len() > 2 {
                self.say(refusal(line, -2));
            }
            return;
        };
        let done = match line.as_bytes()[0] {
            b'O' => self.set_list(&numbers),
            b'l' => self.set_on(&numbers),
            b'H' => numbers.len() == 4,
            b'x' | b'v' => numbers.len() == 4,
            _ => true,
        };
        if !done {
            self.say(refusal(line, -3));
        }
    }

    fn set_list(&mut self, numbers: &[f64]) -> bool {
        let [number, items @ ..] = numbers else {
            return false;
        };
        let items: Option<Vec<Item>> = items
            .iter()
            .map(|item| Item::from_number(*item as u8))
            .collect();
        let encoding = self.encoding;
        let (Some(station), Some(items)) = (self.station(*number as u8), items) else {
            return false;
        };
        let length: usize = items.iter().map(|item| item.length(encoding)).sum();
        let fits = items.len() <= 32 && length <= MAX_RECORD;
        if fits {
            station.list = items;
        }
        fits
    }

    fn set_on(&mut self, numbers: &[f64]) -> bool {
        let &[number, on] = numbers else {
            return false;
        };
        let station = self.station(number as u8);
        let found = station.is_some();
        if let Some(station) = station {
            station.on = on > 0.5;
        }
        self.share_rate();
        found
    }
}

/// Whether a command with operands begins so.
fn begins_line(letter: u8) -> bool {
    b"OlHxvARBbGNoIQVXreE".contains(&letter)
}

impl Default for FastrakEmulator {
    fn default() -> Self {
        Self::new()
    }
}

impl Emulator for FastrakEmulator {
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
            if !self.suspended {
                self.send_round();
            }
        }
        std::mem::take(&mut self.output)
    }

    fn deadline(&self) -> Option<u64> {
        soonest_ns(&self.output, [self.beat.next_ns(), self.deaf.end_ns()])
    }
}
