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
use crate::glove::calibrate::GloveCalibration;
use crate::glove::lucidglove::decode::Info;
use crate::glove::lucidglove::defaults::default_of;
use crate::glove::lucidglove::flow::Flow;
use crate::glove::lucidglove::posture::{Posture, Shape};
use crate::glove::lucidglove::protocol::{
    FAMILY, LINE_END, LISTEN_NS, MAX_LINE, SILENCE_NS, STALL_NS, free_line, limits_line,
    vibration_line,
};
use crate::glove::lucidglove::range::Range;
use crate::glove::lucidglove::settings::LucidGloveSettings;
use crate::session::{DeviceEvent, DeviceInfo, PortRequest, Session, SessionState};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stage {
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
    pub(super) settings: LucidGloveSettings,
    /// The wearer's, as given.
    pub(super) worn: GloveCalibration,
    /// The same with this device's defaults for the present range.
    pub(super) calibration: GloveCalibration,
    pub(super) core: Core,
    pub(super) buffer: StampedBuffer,
    pub(super) stage: Stage,
    pub(super) range: Range,
    pub(super) posture: Posture,
    /// The numbers that the last good line had, and those of the doubtful line behind it.
    pub(super) shape: Option<Shape>,
    pub(super) doubtful: Option<Shape>,
    pub(super) info: Info,
    pub(super) told: Option<DeviceInfo>,
    pub(super) flow: Flow,
    pub(super) giving: Giving,
    /// Whether what comes is thrown away up to the end of the line: its beginning was missed, or it is too long.
    pub(super) mid_line: bool,
    /// Whether the last line was good.
    pub(super) in_step: bool,
    pub(super) last_good_ns: u64,
    pub(super) sequence: u64,
    pub(super) first_bytes: Vec<u8>,
    /// The beginning of the last bad line.
    pub(super) bad_bytes: Vec<u8>,
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
            rate_hz: None,
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
        let n_blank = n_lines.saturating_sub(n_sent);
        bytes.extend(std::iter::repeat_n(LINE_END, n_blank as usize));
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
pub(super) fn filled(worn: &GloveCalibration, max: u16) -> GloveCalibration {
    worn.clone().filled(|sensor| default_of(sensor, max))
}

impl Session for LucidGloveSession {
    fn core(&self) -> &Core {
        &self.core
    }

    fn core_mut(&mut self) -> &mut Core {
        &mut self.core
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
}
