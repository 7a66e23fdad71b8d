//! What a 5DT glove says, cut into records.

use crate::glove::calibrate::{GloveCalibration, Handedness, SensorCalibration};
use crate::glove::fivedt::checksum::Checksum;
use crate::glove::fivedt::long_packet::{self, About};
use crate::glove::fivedt::settings::{FiveDtSettings, FlexureOrder, Model};
use crate::glove::fivedt::short_packet::{self, Information, ShortPacket};
use crate::glove::format::{Cut, Format, Limits, Question, Sample};
use crate::glove::listening::Listening;
use crate::glove::quick_range::usual_range_deg;
use crate::glove::sensor::GloveSensor;
use crate::reading::Controls;
use crate::session::DeviceInfo;

/// The device family, for messages.
pub const FAMILY: &str = "5DT glove";
/// Silence after which the glove is started again, ns: that of the open driver.
const SILENCE_NS: u64 = 2_000_000_000;
/// Time for an answer, ns; the information block takes 17 ms on the line.
const ANSWER_NS: u64 = 500_000_000;

/// The joints that bend with each flexure of a glove of five. A DIP without a sensor follows its PIP.
pub const FLEXED: [[GloveSensor; 2]; 5] = [
    [GloveSensor::ThumbMcp, GloveSensor::ThumbIp],
    [GloveSensor::IndexMcp, GloveSensor::IndexPip],
    [GloveSensor::MiddleMcp, GloveSensor::MiddlePip],
    [GloveSensor::RingMcp, GloveSensor::RingPip],
    [GloveSensor::LittleMcp, GloveSensor::LittlePip],
];

/// A 5DT glove as a state machine. **Emulated, not yet tried on hardware.**
///
/// Readings carry pitch and roll as axes 0 and 1 of their controls, -1 to 1; by the scale of the open driver that is
/// -90° to 90°, of which a real glove is said to reach about ±60°.
pub type FiveDtSession = Listening<FiveDtFormat>;

/// The records of a 5DT glove.
#[derive(Debug)]
pub struct FiveDtFormat {
    settings: FiveDtSettings,
    checksum: Checksum,
    hand: Option<Handedness>,
    /// What the last record or packet said of it.
    last_hand: Option<Handedness>,
    /// `None` while the glove has not said so.
    has_tilt: Option<bool>,
    version: Option<[u8; 2]>,
    name: String,
    /// Whether a record ended where the bytes begin.
    after_record: bool,
}

impl FiveDtSession {
    /// A session for a port that is not open yet.
    #[must_use]
    pub fn new(settings: FiveDtSettings, calibration: GloveCalibration) -> Self {
        Self::with_format(FiveDtFormat::new(settings), calibration)
    }
}

impl FiveDtFormat {
    const fn new(settings: FiveDtSettings) -> Self {
        Self {
            settings,
            checksum: Checksum::new(),
            hand: None,
            last_hand: None,
            has_tilt: None,
            version: None,
            name: String::new(),
            after_record: false,
        }
    }

    /// A glove that has a hand changes it when it says so twice: nothing guards that byte.
    fn note_hand(&mut self, hand: Handedness) {
        if self.hand.is_none() || self.last_hand == Some(hand) {
            self.hand = Some(hand);
        }
        self.last_hand = Some(hand);
    }

    fn cut_short(&mut self, bytes: &[u8], after_record: bool) -> Cut {
        if bytes[0] == short_packet::DONE && after_record {
            return Cut::Filler(1);
        }
        if let Some(n_bytes) = before(bytes, short_packet::HEADER) {
            return Cut::Bad(n_bytes);
        }
        let is_wireless = self.settings.model == Model::FiveWireless;
        let length = if is_wireless {
            short_packet::WIRELESS_LENGTH
        } else {
            short_packet::WIRED_LENGTH
        };
        let Some((record, rest)) = bytes.split_at_checked(length) else {
            return Cut::Wait;
        };
        let (nine, capability) = record.split_at(short_packet::WIRED_LENGTH);
        let hand = capability.first().map(|byte| short_packet::hand_of(*byte));
        if hand == Some(None) {
            return Cut::Bad(1);
        }
        let parts = short_packet::parts(nine);
        let believed = match self.checksum.holds(parts) {
            Some(holds) => Some(holds),
            // In step the last byte of a wireless record says enough.
            None if is_wireless && after_record => Some(true),
            None => begins_another(rest),
        };
        let packet = nine.try_into().ok().and_then(ShortPacket::decode);
        match (believed, packet) {
            (None, _) => Cut::Wait,
            (Some(true), Some(packet)) => {
                if self.checksum.rule().is_none() {
                    self.checksum.learn(parts);
                }
                self.after_record = true;
                if let Some(hand) = hand.flatten() {
                    self.note_hand(hand);
                }
                Cut::Record(length, self.short_sample(&packet))
            }
            _ => Cut::Bad(1),
        }
    }

    fn short_sample(&self, packet: &ShortPacket) -> Sample {
        let mut flexures = packet.flexures;
        let is_reversed = match self.settings.order {
            FlexureOrder::ByHand => self.hand == Some(Handedness::Left),
            FlexureOrder::ThumbFirst => false,
            FlexureOrder::LittleFirst => true,
        };
        if is_reversed {
            flexures.reverse();
        }
        let mut sample = Sample {
            hand: self.hand,
            ..Sample::EMPTY
        };
        for (sensors, flexure) in FLEXED.iter().zip(flexures) {
            for sensor in sensors {
                sample.raw[sensor.slot()] = Some(f64::from(flexure));
            }
        }
        if self.has_tilt != Some(false) {
            sample.controls = tilt(f64::from(packet.pitch), f64::from(packet.roll), 255.0);
        }
        sample
    }

    fn cut_long(&mut self, bytes: &[u8]) -> Cut {
        if let Some(n_bytes) = before(bytes, long_packet::OPEN) {
            return Cut::Bad(n_bytes);
        }
        match bytes.get(1) {
            None => Cut::Wait,
            Some(&long_packet::ABOUT) => {
                let Some(about) = bytes.first_chunk() else {
                    return Cut::Wait;
                };
                let Some(about) = About::decode(*about) else {
                    return Cut::Bad(1);
                };
                self.note_hand(about.hand);
                self.version = Some(about.version);
                Cut::About(long_packet::ABOUT_LENGTH)
            }
            Some(&long_packet::DATA) => {
                let Some(record) = bytes.first_chunk() else {
                    return Cut::Wait;
                };
                self.cut_data(record, &bytes[long_packet::DATA_LENGTH..])
            }
            Some(_) => Cut::Bad(1),
        }
    }

    fn cut_data(&mut self, record: &[u8; long_packet::DATA_LENGTH], rest: &[u8]) -> Cut {
        let Some(values) = long_packet::decode_data(record) else {
            return Cut::Bad(1);
        };
        let parts = long_packet::parts(record);
        let is_closed = record[long_packet::DATA_LENGTH - 1] == long_packet::CLOSE;
        let believed = match self.checksum.holds(parts) {
            Some(holds) => Some(holds),
            None if is_closed => Some(true),
            // One source only gives the last byte; the next packet tells as much.
            None => match rest {
                [] | [long_packet::OPEN] => None,
                [
                    long_packet::OPEN,
                    long_packet::DATA | long_packet::ABOUT,
                    ..,
                ] => Some(true),
                _ => Some(false),
            },
        };
        match believed {
            None => Cut::Wait,
            Some(false) => Cut::Bad(1),
            Some(true) => {
                if self.checksum.rule().is_none() {
                    self.checksum.learn(parts);
                }
                Cut::Record(long_packet::DATA_LENGTH, self.long_sample(&values))
            }
        }
    }

    fn long_sample(&self, values: &[u16; long_packet::N_VALUES]) -> Sample {
        let values = values.map(f64::from);
        let [.., last, very_last] = values;
        let mut sample = Sample {
            hand: self.hand,
            ..Sample::EMPTY
        };
        for (sensor, value) in long_packet::SENSORS.iter().zip(values) {
            sample.raw[sensor.slot()] = Some(value);
        }
        if self.settings.model == Model::Sixteen {
            for (sensor, value) in long_packet::LAST_SENSORS.iter().zip([last, very_last]) {
                sample.raw[sensor.slot()] = Some(value);
            }
        } else {
            sample.controls = tilt(last, very_last, 4095.0);
        }
        sample
    }
}

/// How many bytes stand before the first that is `header`; `None` when it is the first.
fn before(bytes: &[u8], header: u8) -> Option<usize> {
    match bytes.iter().position(|byte| *byte == header) {
        Some(0) => None,
        Some(index) => Some(index),
        None => Some(bytes.len()),
    }
}

/// Whether another record begins with these bytes; `None` while there are too few.
const fn begins_another(rest: &[u8]) -> Option<bool> {
    match rest {
        [] | [short_packet::DONE] => None,
        [short_packet::HEADER, ..] | [short_packet::DONE, short_packet::HEADER, ..] => Some(true),
        _ => Some(false),
    }
}

fn tilt(pitch: f64, roll: f64, raw_max: f64) -> Controls {
    let axis = |raw: f64| Some(2.0 * raw / raw_max - 1.0);
    Controls {
        axes: [axis(pitch), axis(roll), None, None],
        ..Controls::NONE
    }
}

impl Format for FiveDtFormat {
    const FAMILY: &'static str = FAMILY;

    fn limits(&self) -> Limits {
        let record_bytes = match self.settings.model {
            Model::Five | Model::FiveWireless => short_packet::WIRED_LENGTH,
            Model::Fourteen | Model::Sixteen => long_packet::DATA_LENGTH,
        };
        Limits {
            silence_ns: SILENCE_NS,
            tries: 2,
            record_bytes,
            garbage_bytes: 40 * record_bytes,
        }
    }

    fn raw_span(&self) -> f64 {
        self.settings.model.raw_max()
    }

    fn default_of(&self, sensor: GloveSensor) -> SensorCalibration {
        default_of(self.settings.model, sensor)
    }

    fn learns_ranges(&self) -> bool {
        self.settings.autocalibrate
    }

    fn begin(&mut self) {
        self.after_record = false;
    }

    fn question(&self, step: usize) -> Option<Question> {
        if self.settings.model != Model::Five {
            return None;
        }
        let (letter, answer_ns, needed) = match step {
            0 => (short_packet::RESET, Some(ANSWER_NS), true),
            1 => (short_packet::INFORMATION, Some(ANSWER_NS), false),
            2 => (short_packet::STREAM, None, false),
            _ => return None,
        };
        Some(Question {
            bytes: vec![letter],
            answer_ns,
            needed,
        })
    }

    fn answer(&mut self, step: usize, bytes: &[u8]) -> Option<usize> {
        if step == 0 {
            let index = bytes.iter().position(|byte| *byte == short_packet::DONE)?;
            return Some(index + 1);
        }
        // What still comes of an earlier stream stands before it.
        let start = bytes
            .windows(2)
            .position(|pair| pair == short_packet::INFORMATION_HEADER)?;
        let information = Information::decode(bytes[start..].first_chunk()?)?;
        self.hand = Some(information.hand);
        self.has_tilt = Some(information.has_tilt);
        self.version = Some(information.version);
        self.name = information.name;
        Some(start + short_packet::INFORMATION_LENGTH)
    }

    fn cut(&mut self, bytes: &[u8]) -> Cut {
        match self.settings.model {
            Model::Five | Model::FiveWireless => {
                let after_record = std::mem::take(&mut self.after_record);
                let cut = self.cut_short(bytes, after_record);
                // Neither waiting nor the byte after a record leaves the step.
                self.after_record |= after_record && matches!(cut, Cut::Wait | Cut::Filler(_));
                cut
            }
            Model::Fourteen | Model::Sixteen => self.cut_long(bytes),
        }
    }

    fn info(&self) -> DeviceInfo {
        let firmware = self
            .version
            .map_or_else(String::new, |[major, minor]| format!("{major}.{minor}"));
        DeviceInfo {
            family: FAMILY,
            firmware,
            identity: self.name.clone(),
            n_sensors: self.settings.model.n_sensors(),
            hand: self.hand,
            tick_ns: None,
            rate_hz: None,
        }
    }

    fn farewell(&self) -> &'static [u8] {
        match self.settings.model {
            Model::Five => &[short_packet::RESET],
            Model::FiveWireless | Model::Fourteen | Model::Sixteen => &[],
        }
    }
}

/// The whole span of a model's raw values is the usual range of the joint, until a calibration says better.
#[must_use]
pub fn default_of(model: Model, sensor: GloveSensor) -> SensorCalibration {
    let (min_deg, max_deg) = usual_range_deg(sensor);
    SensorCalibration::from_two_points((0.0, min_deg), (model.raw_max(), max_deg))
        .unwrap_or_else(|| SensorCalibration::default_of(sensor))
}
