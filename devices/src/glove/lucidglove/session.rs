//! The LucidGlove's start-up, silence and recovery. Nothing is asked of the glove: it streams as soon as it runs.
//!
//! ```text
//!  Closed -> Listening (boot text, the end of a line) -> Running (a line, an answer) -> Stalled (silence, no good line)
//!    ^            | no good line in 5 s                      ^                            | a good line   | 4 s
//!    +------------+                                          +----------------------------+               |
//!    +----------------------------------------------------------------------------------------------------+
//! ```

use crate::buffer::StampedBuffer;
use crate::core::Core;
use crate::fault::{Fault, hex};
use crate::feedback::{Feedback, Giving};
use crate::glove::calibrate::{GloveCalibration, Handedness};
use crate::glove::lucidglove::decode::{Info, Sample, decode_line};
use crate::glove::lucidglove::defaults::default_of;
use crate::glove::lucidglove::flow::Flow;
use crate::glove::lucidglove::posture::{Posture, Shape};
use crate::glove::lucidglove::protocol::{
    FAMILY, LINE_END, LISTEN_NS, MAX_LINE, SILENCE_NS, STALL_NS, free_line, limits_line,
    vibration_line,
};
use crate::glove::lucidglove::range::{Range, Verdict};
use crate::glove::lucidglove::settings::LucidGloveSettings;
use crate::reading::GloveReading;
use crate::session::{DeviceEvent, DeviceInfo, PortRequest, Session, SessionState, SessionStats};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Closed,
    /// The port is open since then, ns.
    Listening {
        since_ns: u64,
    },
    Running,
    /// Since then, ns.
    Stalled {
        since_ns: u64,
    },
}

/// A LucidGlove as a state machine. **Emulated, not yet tried on hardware.**
#[derive(Debug)]
pub struct LucidGloveSession {
    settings: LucidGloveSettings,
    /// The wearer's, as given.
    worn: GloveCalibration,
    /// The same with this device's defaults for the present range.
    calibration: GloveCalibration,
    core: Core,
    buffer: StampedBuffer,
    stage: Stage,
    range: Range,
    posture: Posture,
    /// The numbers that the last good line had, and those of the doubtful line behind it.
    shape: Option<Shape>,
    doubtful: Option<Shape>,
    info: Info,
    told: Option<DeviceInfo>,
    flow: Flow,
    giving: Giving,
    /// Whether what comes is thrown away up to the end of the line: its beginning was missed, or it is too long.
    mid_line: bool,
    /// Whether the last line was good.
    in_step: bool,
    last_good_ns: u64,
    sequence: u64,
    first_bytes: Vec<u8>,
    /// The beginning of the last bad line.
    bad_bytes: Vec<u8>,
}

impl LucidGloveSession {
    /// A session for a port that is not open yet.
    #[must_use]
    pub fn new(settings: LucidGloveSettings, calibration: GloveCalibration) -> Self {
        let range = Range::new(settings.max);
        Self {
            calibration: filled(&calibration, range.max()),
            worn: calibration,
            range,
            settings,
            core: Core::new(),
            buffer: StampedBuffer::default(),
            stage: Stage::Closed,
            posture: Posture::default(),
            shape: None,
            doubtful: None,
            info: Info::default(),
            told: None,
            flow: Flow::new(),
            giving: Giving::default(),
            mid_line: true,
            in_step: false,
            last_good_ns: 0,
            sequence: 0,
            first_bytes: Vec::new(),
            bad_bytes: Vec::new(),
        }
    }

    /// Takes every whole line in the buffer; the newest reading among them.
    fn take_lines(&mut self, now_ns: u64, newest: &mut Option<GloveReading>) {
        loop {
            let bytes = self.buffer.as_slice();
            let Some(end) = bytes.iter().position(|byte| *byte == LINE_END) else {
                let n_bytes = bytes.len();
                if self.mid_line {
                    self.buffer.consume(n_bytes);
                } else if n_bytes > MAX_LINE {
                    self.reject(n_bytes);
                    self.mid_line = true;
                    self.buffer.consume(n_bytes);
                }
                return;
            };
            let stamp_ns = self.buffer.stamp_ns(end);
            // A link may put blank lines between the glove's; they are not the glove's and want no answer.
            let is_blank = bytes[..end].trim_ascii().is_empty();
            if !is_blank {
                self.flow.heard(now_ns);
            }
            let line = decode_line(&bytes[..end]).ok();
            if let Some(info) = line.and_then(|line| line.info) {
                self.info.update(&info);
            }
            // The end of a sample looks like a whole one.
            if std::mem::take(&mut self.mid_line) || is_blank {
                self.buffer.consume(end + 1);
                continue;
            }
            match line.map(|line| line.sample) {
                Some(Some(sample)) if self.believes(&sample) => {
                    *newest = Some(self.accept(stamp_ns, &sample));
                }
                Some(None) => self.note_good(stamp_ns),
                _ => self.reject(end),
            }
            self.buffer.consume(end + 1);
        }
    }

    /// Whether a line that decodes is the glove's: it has the numbers that the last one had, within the range. A line
    /// that is otherwise is believed when the next one agrees.
    fn believes(&mut self, sample: &Sample) -> bool {
        match self.range.judge(sample) {
            Verdict::Fits => {}
            Verdict::Raised => self.calibration = filled(&self.worn, self.range.max()),
            Verdict::Doubtful => return false,
        }
        let shape = Shape::of(sample);
        let doubtful = self.doubtful.take();
        if self.shape.is_none_or(|known| known == shape) || doubtful == Some(shape) {
            self.shape = Some(shape);
            return true;
        }
        self.doubtful = Some(shape);
        false
    }

    fn accept(&mut self, stamp_ns: u64, sample: &Sample) -> GloveReading {
        self.posture.take(sample);
        self.note_good(stamp_ns);
        let max = self.range.max();
        GloveReading {
            sensors: self.calibration.angles(&self.posture.raw(max)),
            angles_valid: true,
            hand: self.hand(),
            controls: self.posture.controls(max),
            ..GloveReading::empty(stamp_ns, self.sequence)
        }
    }

    fn hand(&self) -> Option<Handedness> {
        self.settings.hand.or(self.info.hand)
    }

    fn note_good(&mut self, stamp_ns: u64) {
        self.core.stats.records += 1;
        self.in_step = true;
        self.last_good_ns = stamp_ns;
        self.stage = Stage::Running;
        let fault = self.range.is_set_wrong().then(|| Fault::Reported {
            device: FAMILY,
            code: format!("numbers beyond {}", self.range.max()),
            meaning: "its setting `max` is too small",
        });
        self.core.enter(stamp_ns, SessionState::Running, fault);
    }

    /// A line that cannot be the glove's: the first `n_bytes` of the buffer.
    fn reject(&mut self, n_bytes: usize) {
        let shown = n_bytes.min(64);
        self.bad_bytes.clear();
        self.bad_bytes
            .extend_from_slice(&self.buffer.as_slice()[..shown]);
        // What comes before the first good line is the board's boot text.
        if !matches!(self.stage, Stage::Listening { .. }) {
            self.core.stats.dropped_records += 1;
            self.core.stats.resyncs += u64::from(self.in_step);
        }
        self.in_step = false;
    }

    /// Says what the glove is, when that is news.
    fn identify(&mut self) {
        let info = DeviceInfo {
            family: FAMILY,
            firmware: self
                .info
                .firmware
                .map_or_else(String::new, |v| v.to_string()),
            identity: match self.info.device_type {
                None => String::new(),
                Some(0) => "lucidgloves".to_owned(),
                Some(other) => format!("device type {other}"),
            },
            n_sensors: self.posture.n_sensors(),
            hand: self.hand(),
            tick_ns: None,
        };
        if self.told.as_ref() != Some(&info) {
            self.told = Some(info.clone());
            self.core.emit(DeviceEvent::Identified(info));
        }
    }

    /// Sends `n_lines` lines: forces and vibrations if any are due, and line feeds for the rest.
    fn answer(&mut self, now_ns: u64, n_lines: u32) {
        if n_lines == 0 {
            return;
        }
        let mut bytes = Vec::new();
        let mut n_sent = 0;
        if self.stage != Stage::Closed && self.shape.is_some() {
            let vibration = self.giving.vibration(now_ns);
            if let Some(vibration) = vibration.filter(|_| self.settings.haptics) {
                bytes.extend(vibration_line(&vibration));
                // The firmware takes this line for one that names no finger, and frees them all.
                self.giving.repeat();
                n_sent += 1;
            }
            if self.settings.feedback
                && let Some(limits) = self.giving.due(now_ns, self.settings.feedback_max)
            {
                bytes.extend(limits_line(self.posture.encoding(), limits));
                n_sent += 1;
            }
        }
        for _ in n_sent..n_lines {
            bytes.push(LINE_END);
        }
        self.flow.note_extra(n_sent.saturating_sub(n_lines));
        self.core.send(bytes);
    }

    /// No good line for too long.
    fn stall(&mut self, now_ns: u64) {
        let fault = if self.bad_bytes.is_empty() {
            Fault::Silent { device: FAMILY }
        } else {
            Fault::Garbled {
                device: FAMILY,
                first_bytes: hex(&self.bad_bytes),
            }
        };
        self.core.enter(now_ns, SessionState::Stalled, Some(fault));
        self.core.stats.restarts += 1;
        self.core.request(PortRequest::ReapplySettings);
        // Whatever it still hears frees the fingers.
        self.giving.release();
        if self.settings.feedback {
            self.core.send(free_line(self.posture.encoding()));
            self.flow.note_extra(1);
        }
        self.stage = Stage::Stalled { since_ns: now_ns };
    }

    fn give_up(&mut self, now_ns: u64) {
        if matches!(self.stage, Stage::Listening { .. }) {
            let fault = if self.first_bytes.is_empty() {
                Fault::Silent { device: FAMILY }
            } else {
                Fault::NotThisDevice {
                    device: FAMILY,
                    first_bytes: hex(&self.first_bytes),
                }
            };
            self.core.enter(now_ns, SessionState::Stalled, Some(fault));
        }
        self.core.stats.restarts += 1;
        self.core.request(PortRequest::Reopen);
        self.stage = Stage::Closed;
    }

    /// When the present stage is given up, ns.
    fn patience_ns(&self) -> Option<u64> {
        match self.stage {
            Stage::Closed => None,
            Stage::Listening { since_ns } => Some(since_ns + LISTEN_NS),
            Stage::Running => Some(self.last_good_ns + SILENCE_NS),
            Stage::Stalled { since_ns } => Some(since_ns + STALL_NS),
        }
    }
}

/// The wearer's calibration with this device's defaults.
fn filled(worn: &GloveCalibration, max: u16) -> GloveCalibration {
    worn.clone().filled(|sensor| default_of(sensor, max))
}

impl Session for LucidGloveSession {
    fn port_opening(&mut self, now_ns: u64) {
        self.core.enter(now_ns, SessionState::Opening, None);
    }

    fn port_opened(&mut self, now_ns: u64) {
        self.buffer.clear();
        self.core.forget_port();
        self.first_bytes.clear();
        self.bad_bytes.clear();
        // The range stays: a glove that comes back is the same one, and may be half bent.
        self.shape = None;
        self.doubtful = None;
        self.mid_line = true;
        self.in_step = false;
        self.flow.open(now_ns);
        let fault = match self.core.fault.take() {
            Some(kept @ (Fault::Silent { .. } | Fault::NotThisDevice { .. })) => Some(kept),
            _ => None,
        };
        self.core.enter(now_ns, SessionState::Resetting, fault);
        self.stage = Stage::Listening { since_ns: now_ns };
    }

    fn port_lost(&mut self, now_ns: u64, fault: Fault) {
        self.buffer.clear();
        self.core.forget_port();
        self.giving.release();
        self.stage = Stage::Closed;
        self.core.enter(now_ns, SessionState::Absent, Some(fault));
    }

    fn push(&mut self, stamp_ns: u64, bytes: &[u8]) {
        self.core.stats.bytes += bytes.len() as u64;
        let room = 64_usize.saturating_sub(self.first_bytes.len());
        self.first_bytes
            .extend_from_slice(&bytes[..bytes.len().min(room)]);
        if self.stage == Stage::Closed {
            return;
        }
        // Several lines at once are old news but for the last.
        let mut newest = None;
        let n_before = self.core.stats.records;
        for piece in bytes.chunks(MAX_LINE) {
            self.buffer.push(stamp_ns, piece);
            self.take_lines(stamp_ns, &mut newest);
        }
        if self.core.stats.records != n_before {
            self.bad_bytes.clear();
            self.identify();
        }
        if let Some(reading) = newest {
            self.sequence += 1;
            self.core.emit(DeviceEvent::Glove(reading));
        }
        let n_lines = self.flow.take_due();
        self.answer(stamp_ns, n_lines);
    }

    fn next_event(&mut self) -> Option<DeviceEvent> {
        self.core.next_event()
    }

    fn deadline(&self) -> Option<u64> {
        self.patience_ns()
            .map(|patience_ns| patience_ns.min(self.flow.deadline_ns()))
    }

    fn handle_timeout(&mut self, now_ns: u64) {
        let Some(patience_ns) = self.patience_ns() else {
            return;
        };
        if now_ns >= patience_ns {
            if self.stage == Stage::Running {
                self.stall(now_ns);
            } else {
                self.give_up(now_ns);
            }
        } else if self.flow.nudges(now_ns) {
            self.answer(now_ns, 1);
        }
    }

    fn poll_transmit(&mut self) -> Option<Vec<u8>> {
        self.core.next_transmit()
    }

    fn poll_port_request(&mut self) -> Option<PortRequest> {
        self.core.requests.pop_front()
    }

    fn farewell(&self) -> &'static [u8] {
        if self.settings.feedback && self.shape.is_some() {
            free_line(self.posture.encoding())
        } else {
            &[]
        }
    }

    fn set_calibration(&mut self, calibration: GloveCalibration) {
        self.calibration = filled(&calibration, self.range.max());
        self.worn = calibration;
    }

    fn set_feedback(&mut self, now_ns: u64, feedback: Feedback) {
        self.giving.ask(now_ns, feedback);
    }

    fn state(&self) -> SessionState {
        self.core.state
    }

    fn fault(&self) -> Option<&Fault> {
        self.core.fault.as_ref()
    }

    fn stats(&self) -> SessionStats {
        self.core.stats
    }
}
