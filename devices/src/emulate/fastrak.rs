//! A Fastrak with up to four receivers. **No real unit has been compared with it.**

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

use crate::emulate::Emulator;
use crate::emulate::fastrak_record::{data_record, refusal, status_record};
use crate::emulate::line_fault::LineFaults;
use crate::tracker::fastrak::decode::{Encoding, Item, LengthUnit};
use crate::tracker::fastrak::protocol::{
    ASCII, BINARY, CENTIMETRES, CONTINUOUS, DEFAULTS, FLAG_BINARY, FLAG_CENTIMETRES,
    FLAG_CONTINUOUS, FLAGS_ALWAYS, INCHES, N_STATIONS, POLL, QUIET, REINITIALISE, RESUME, SAVE,
    STATUS, SUSPEND, TOTAL_RATE_HZ,
};

/// How long the unit is deaf after `^Y`, ns.
const REINITIALISE_TAKES_NS: u64 = 10_000_000_000;
/// Longest command with operands.
const MAX_COMMAND: usize = 128;
/// Longest record that the unit takes on.
const MAX_RECORD: usize = 254;
/// Rounds of records sent at once by a unit that was not asked for long; older ones are lost.
const MAX_BACKLOG: u64 = 4;

#[derive(Debug, Clone)]
struct Station {
    pose: Isometry3<f64>,
    connected: bool,
    on: bool,
    list: Vec<Item>,
}

impl Station {
    fn at_power_on() -> Self {
        Self {
            pose: Isometry3::translation(0.3, 0.0, 0.0),
            connected: true,
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
    /// When the next round of records is due, while output is continuous, ns.
    next_round_ns: Option<u64>,
    deaf_until_ns: Option<u64>,
    command: Vec<u8>,
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
            next_round_ns: None,
            deaf_until_ns: None,
            command: Vec::new(),
            output: Vec::new(),
        }
    }

    /// Moves the receiver of a station (1 to 4): position in transmitter space in m, and the rotation that takes
    /// sensor coordinates to transmitter space. Another station number changes nothing.
    pub fn set_pose(&mut self, station: u8, position: Point3<f64>, rotation: UnitQuaternion<f64>) {
        if let Some(station) = self.station(station) {
            station.pose = Isometry3::from_parts(Translation3::from(position.coords), rotation);
        }
    }

    /// Plugs the receiver of a station (1 to 4) in, or pulls it out: its records then carry `k`.
    pub fn set_connected(&mut self, station: u8, connected: bool) {
        if let Some(station) = self.station(station) {
            station.connected = connected;
        }
    }

    fn station(&mut self, number: u8) -> Option<&mut Station> {
        usize::from(number)
            .checked_sub(1)
            .and_then(|index| self.stations.get_mut(index))
    }

    fn say(&mut self, bytes: Vec<u8>) {
        let bytes = self.faults.apply(bytes);
        self.output.extend(bytes);
    }

    fn flags(&self) -> u16 {
        let set = [
            (FLAG_BINARY, self.encoding == Encoding::Binary),
            (FLAG_CENTIMETRES, self.unit == LengthUnit::Centimetres),
            (FLAG_CONTINUOUS, self.next_round_ns.is_some()),
        ];
        set.iter()
            .filter(|(_, on)| *on)
            .fold(FLAGS_ALWAYS, |flags, (flag, _)| flags | flag)
    }

    /// Time between rounds: the rate is shared by the stations that are on.
    fn period_ns(&self) -> u64 {
        let n_on = self.stations.iter().filter(|station| station.on).count();
        1_000_000_000 * n_on.max(1) as u64 / TOTAL_RATE_HZ
    }

    fn send_round(&mut self) {
        for number in 1..=N_STATIONS as u8 {
            let station = &self.stations[usize::from(number) - 1];
            if station.on {
                let error = if station.connected { None } else { Some(b'k') };
                let form = (self.encoding, self.unit);
                let record = data_record(number, error, &station.pose, &station.list, form);
                self.say(record);
            }
        }
    }

    /// Obeys a command of one letter; false when the letter begins a longer one.
    fn obey_letter(&mut self, now_ns: u64, letter: u8) -> bool {
        match letter {
            POLL => self.send_round(),
            CONTINUOUS => self.next_round_ns = Some(now_ns + self.period_ns()),
            QUIET => self.next_round_ns = None,
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
                self.deaf_until_ns = Some(now_ns + self.reinitialise_takes_ns);
            }
            // Saving, test results and recovery toggles change nothing that can be seen here; CR and LF end nothing.
            SAVE | b'T' | b'Y' | b't' | b'\r' | b'\n' => {}
            b'O' | b'l' | b'H' | b'x' | b'v' | b'A' | b'R' | b'B' | b'b' | b'G' | b'N' | b'o'
            | b'I' | b'Q' | b'V' | b'X' | b'r' | b'e' | b'E' => return false,
            // Unknown bytes are ignored.
            _ => {}
        }
        true
    }

    fn restore_defaults(&mut self) {
        self.encoding = Encoding::Ascii;
        self.unit = LengthUnit::Inches;
        self.suspended = false;
        self.next_round_ns = None;
        for station in &mut self.stations {
            let kept = station.clone();
            *station = Station {
                pose: kept.pose,
                connected: kept.connected,
                ..Station::at_power_on()
            };
        }
    }

    /// Obeys a command with operands, given without its CR.
    fn obey_line(&mut self, line: &str) {
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
        found
    }

    fn wake(&mut self, now_ns: u64) {
        if self.deaf_until_ns.is_some_and(|end_ns| end_ns <= now_ns) {
            self.deaf_until_ns = None;
        }
    }
}

impl Default for FastrakEmulator {
    fn default() -> Self {
        Self::new()
    }
}

impl Emulator for FastrakEmulator {
    fn push(&mut self, now_ns: u64, bytes: &[u8]) {
        self.wake(now_ns);
        for byte in bytes {
            if self.faults.is_frozen() || self.deaf_until_ns.is_some() {
                return;
            }
            if self.command.is_empty() {
                if !self.obey_letter(now_ns, *byte) {
                    self.command.push(*byte);
                }
            } else if matches!(byte, b'\r' | b'\n') {
                let command = std::mem::take(&mut self.command);
                if let Ok(line) = std::str::from_utf8(&command) {
                    self.obey_line(line);
                }
            } else {
                self.command.push(*byte);
                if self.command.len() > MAX_COMMAND {
                    self.command.clear();
                    self.say(refusal("", -5));
                }
            }
        }
    }

    fn poll(&mut self, now_ns: u64) -> Vec<u8> {
        self.wake(now_ns);
        let period_ns = self.period_ns();
        if let Some(next_ns) = self.next_round_ns {
            let oldest_ns = now_ns.saturating_sub(MAX_BACKLOG * period_ns);
            let mut next_ns = next_ns.max(oldest_ns);
            while next_ns <= now_ns {
                if !self.suspended {
                    self.send_round();
                }
                next_ns += period_ns;
            }
            self.next_round_ns = Some(next_ns);
        }
        std::mem::take(&mut self.output)
    }

    fn deadline(&self) -> Option<u64> {
        let due_now = (!self.output.is_empty()).then_some(0);
        [self.next_round_ns, self.deaf_until_ns, due_now]
            .into_iter()
            .flatten()
            .min()
    }
}
