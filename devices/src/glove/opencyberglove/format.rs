//! What an OpenCyberGlove says, cut into packets.

use crate::glove::calibrate::{GloveCalibration, SensorCalibration};
use crate::glove::format::{Cut, Format, Limits, Sample};
use crate::glove::listening::Listening;
use crate::glove::opencyberglove::packet::{LENGTH, N_VALUES, Packet, RAW_MAX};
use crate::glove::quick_range::usual_range_deg;
use crate::glove::sensor::GloveSensor;
use crate::session::DeviceInfo;
use crate::ticks::Unwrapped;

/// The device family, for messages.
pub const FAMILY: &str = "OpenCyberGlove";
/// Packets per second.
pub const RATE_HZ: u64 = 120;
/// Line rate, bit/s.
pub const BAUD: u32 = 1_000_000;
/// Silence after which something is done, ns.
const SILENCE_NS: u64 = 1_000_000_000;
/// One tick of the glove's clock, ns.
const TICK_NS: f64 = 1.0e6;

/// The joints of the values in the order of the packet, as the maker's own program sorts them: the thumb from its tip,
/// the others from the palm, and the angles between fingers where they lie.
pub const USUAL_ORDER: [GloveSensor; N_VALUES] = [
    GloveSensor::ThumbIp,
    GloveSensor::ThumbMcp,
    GloveSensor::ThumbAbduction,
    GloveSensor::ThumbRotation,
    GloveSensor::IndexMcp,
    GloveSensor::IndexPip,
    GloveSensor::IndexDip,
    GloveSensor::MiddleIndexAbduction,
    GloveSensor::MiddleMcp,
    GloveSensor::MiddlePip,
    GloveSensor::MiddleDip,
    GloveSensor::RingMiddleAbduction,
    GloveSensor::RingMcp,
    GloveSensor::RingPip,
    GloveSensor::RingDip,
    GloveSensor::LittleRingAbduction,
    GloveSensor::LittleMcp,
    GloveSensor::LittlePip,
    GloveSensor::LittleDip,
];

/// What the user may choose about an OpenCyberGlove.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OpenCyberGloveSettings {
    /// The joints of the values in the order of the packet; none for a value that is left out, as is one beyond the last.
    pub order: Vec<Vec<GloveSensor>>,
    /// Whether the ranges of sensors that the wearer's file does not name are learned while the glove is worn.
    pub autocalibrate: bool,
}

impl Default for OpenCyberGloveSettings {
    fn default() -> Self {
        Self {
            order: USUAL_ORDER.iter().map(|sensor| vec![*sensor]).collect(),
            autocalibrate: false,
        }
    }
}

/// An OpenCyberGlove as a state machine. **Emulated, not yet tried on hardware.**
pub type OpenCyberGloveSession = Listening<OpenCyberGloveFormat>;

/// The packets of an OpenCyberGlove.
#[derive(Debug)]
pub struct OpenCyberGloveFormat {
    settings: OpenCyberGloveSettings,
    ticks: Unwrapped,
}

impl OpenCyberGloveSession {
    /// A session for a port that is not open yet.
    #[must_use]
    pub fn new(settings: OpenCyberGloveSettings, calibration: GloveCalibration) -> Self {
        let format = OpenCyberGloveFormat {
            settings,
            ticks: Unwrapped::default(),
        };
        Self::with_format(format, calibration)
    }
}

impl OpenCyberGloveFormat {
    fn sample(&mut self, packet: &Packet) -> Sample {
        let mut sample = Sample {
            device_ticks: Some(self.ticks.unwrap(packet.time_ms)),
            ..Sample::EMPTY
        };
        for (sensors, value) in self.settings.order.iter().zip(packet.values) {
            for sensor in sensors {
                sample.raw[sensor.slot()] = Some(f64::from(value));
            }
        }
        sample
    }
}

impl Format for OpenCyberGloveFormat {
    const FAMILY: &'static str = FAMILY;

    fn limits(&self) -> Limits {
        Limits {
            silence_ns: SILENCE_NS,
            tries: 2,
            record_bytes: LENGTH,
            garbage_bytes: 16 * LENGTH,
        }
    }

    fn raw_span(&self) -> f64 {
        RAW_MAX
    }

    fn default_of(&self, sensor: GloveSensor) -> SensorCalibration {
        default_of(sensor)
    }

    fn learns_ranges(&self) -> bool {
        self.settings.autocalibrate
    }

    fn cut(&mut self, bytes: &[u8]) -> Cut {
        match bytes.first_chunk() {
            None => Cut::Wait,
            Some(bytes) => Packet::decode(bytes).map_or(Cut::Bad(1), |packet| {
                Cut::Record(LENGTH, self.sample(&packet))
            }),
        }
    }

    fn info(&self) -> DeviceInfo {
        DeviceInfo {
            family: FAMILY,
            firmware: String::new(),
            identity: String::new(),
            n_sensors: self.settings.order.iter().map(Vec::len).sum(),
            hand: None,
            tick_ns: Some(TICK_NS),
            rate_hz: None,
        }
    }
}

/// The whole span of the raw values is the usual range of the joint, until a calibration says better.
#[must_use]
pub fn default_of(sensor: GloveSensor) -> SensorCalibration {
    let (min_deg, max_deg) = usual_range_deg(sensor);
    SensorCalibration::from_two_points((0.0, min_deg), (RAW_MAX, max_deg))
        .unwrap_or_else(|| SensorCalibration::default_of(sensor))
}
