//! What a glove that prints lines of numbers says, cut into lines.

use crate::glove::calibrate::{GloveCalibration, SensorCalibration};
use crate::glove::delimited::line::{LineFault, Row, read_line};
use crate::glove::delimited::settings::{DelimitedSettings, Scale, TimeUnit};
use crate::glove::format::{Cut, Format, Limits, Question, Sample};
use crate::glove::listening::Listening;
use crate::glove::quick_range::usual_range_deg;
use crate::glove::sensor::GloveSensor;
use crate::session::DeviceInfo;
use crate::ticks::Unwrapped;

/// The device family, for messages.
pub const FAMILY: &str = "glove of delimited numbers";
/// The longest line.
pub const MAX_LINE: usize = 1024;
/// Silence after which the glove is asked to start again, ns.
const SILENCE_NS: u64 = 2_000_000_000;
/// So many of them until the port is opened again. That restarts many boards, which then need seconds to come up.
const TRIES: u32 = 5;
/// More than any board says while it starts.
const GARBAGE_BYTES: usize = 4096;
/// The range of angles where the glove sends angles, degrees: nothing that a hand does is beyond it.
const ANGLE_MAX_DEG: f64 = 180.0;
/// One tick of a reading where the unit of the time column is known, ns.
const TICK_NS: f64 = 1_000.0;

/// A glove that prints lines of numbers, as a state machine. **Emulated, not yet tried on hardware.**
pub type DelimitedSession = Listening<DelimitedFormat>;

/// The lines of a glove.
#[derive(Debug)]
pub struct DelimitedFormat {
    settings: DelimitedSettings,
    /// Whether the next line began before anyone listened.
    in_a_line: bool,
    ticks: Unwrapped,
}

impl DelimitedSession {
    /// A session for a port that is not open yet.
    #[must_use]
    pub fn new(settings: DelimitedSettings, calibration: GloveCalibration) -> Self {
        let format = DelimitedFormat {
            settings,
            in_a_line: true,
            ticks: Unwrapped::default(),
        };
        Self::with_format(format, calibration)
    }
}

impl DelimitedFormat {
    fn sample(&mut self, row: &Row) -> Sample {
        Sample {
            raw: row.raw,
            device_ticks: row.time.and_then(|time| self.ticks_of(time)),
            ..Sample::EMPTY
        }
    }

    /// The time as whole µs, or as the counter that it is; `None` for a time before zero.
    fn ticks_of(&mut self, time: f64) -> Option<u64> {
        let per_unit = match self.settings.time_unit {
            TimeUnit::Seconds => 1.0e6,
            TimeUnit::Milliseconds => 1.0e3,
            TimeUnit::Microseconds | TimeUnit::Ticks => 1.0,
        };
        let whole = time.floor();
        if whole < 0.0 {
            return None;
        }
        let unwrapped = if whole <= f64::from(u32::MAX) {
            self.ticks.unwrap(whole as u32) as f64
        } else {
            whole
        };
        // Exact up to 2^53 µs, which is 285 years.
        Some(((unwrapped + (time - whole)) * per_unit).round() as u64)
    }
}

impl Format for DelimitedFormat {
    const FAMILY: &'static str = FAMILY;

    fn limits(&self) -> Limits {
        Limits {
            silence_ns: SILENCE_NS,
            tries: TRIES,
            record_bytes: 2 * self.settings.columns.len(),
            garbage_bytes: GARBAGE_BYTES,
        }
    }

    fn raw_span(&self) -> f64 {
        match self.settings.scale {
            Scale::Range(first, second) => (second - first).abs(),
            Scale::Degrees => 90.0,
            Scale::Radians => 90.0_f64.to_radians(),
        }
    }

    fn default_of(&self, sensor: GloveSensor) -> SensorCalibration {
        default_of(self.settings.scale, sensor)
    }

    fn learns_ranges(&self) -> bool {
        self.settings.autocalibrate
    }

    fn begin(&mut self) {
        self.in_a_line = true;
    }

    fn question(&self, step: usize) -> Option<Question> {
        let start = &self.settings.start;
        (step == 0 && !start.is_empty()).then(|| Question {
            bytes: start.clone().into_bytes(),
            answer_ns: None,
            needed: false,
        })
    }

    fn cut(&mut self, bytes: &[u8]) -> Cut {
        let Some(end) = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r')) else {
            if bytes.len() <= MAX_LINE {
                return Cut::Wait;
            }
            // Its end is no line of its own.
            self.in_a_line = true;
            return Cut::Bad(bytes.len());
        };
        let n_bytes = end + 1;
        if std::mem::take(&mut self.in_a_line) {
            return Cut::Filler(n_bytes);
        }
        let Ok(line) = std::str::from_utf8(&bytes[..end]) else {
            return Cut::Bad(n_bytes);
        };
        match read_line(line, &self.settings) {
            Ok(row) => Cut::Record(n_bytes, self.sample(&row)),
            Err(LineFault::Other) => Cut::Filler(n_bytes),
            Err(LineFault::Columns { .. } | LineFault::Number { .. }) => Cut::Bad(n_bytes),
        }
    }

    fn info(&self) -> DeviceInfo {
        let columns = &self.settings.columns;
        DeviceInfo {
            family: FAMILY,
            firmware: String::new(),
            identity: String::new(),
            n_sensors: columns.iter().map(|column| column.sensors().len()).sum(),
            hand: None,
            tick_ns: (self.settings.time_unit != TimeUnit::Ticks).then_some(TICK_NS),
            rate_hz: None,
        }
    }
}

/// The map from a raw value to an angle until a calibration says better.
#[must_use]
pub fn default_of(scale: Scale, sensor: GloveSensor) -> SensorCalibration {
    let (min_deg, max_deg) = usual_range_deg(sensor);
    let as_angle = |gain_deg_per_count| SensorCalibration {
        raw_at_zero: 0.0,
        gain_deg_per_count,
        min_deg: -ANGLE_MAX_DEG,
        max_deg: ANGLE_MAX_DEG,
        coupling: None,
    };
    match scale {
        Scale::Range(first, second) => {
            SensorCalibration::from_two_points((first, min_deg), (second, max_deg))
                .unwrap_or_else(|| SensorCalibration::default_of(sensor))
        }
        Scale::Degrees => as_angle(1.0),
        Scale::Radians => as_angle(1.0_f64.to_degrees()),
    }
}
