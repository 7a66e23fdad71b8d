//! The CyberGlove's start-up, silence and recovery.
//!
//! ```text
//!  Closed -> Draining (^C) -> Script (?G ?S ?K … U F D T M N) -> Running (S, or G again and again)
//!               ^   ^           | no answer        | no glove        | silence, bad records
//!               |   +- Restarting (^R) <-+         v                 |
//!               |                            WaitingForGlove (?G)    |
//!               +----------------------------------------------------+
//! ```

use crate::buffer::StampedBuffer;
use crate::core::Core;
use crate::fault::{Fault, hex};
use crate::feedback::{Feedback, Giving};
use crate::glove::calibrate::GloveCalibration;
use crate::glove::cyberglove::decode::RecordLayout;
use crate::glove::cyberglove::protocol::{
    ATTEMPTS, DRAIN_NS, ERROR_NO_GLOVE, FAMILY, MAX_RESTARTS, READY_INITIALISED, READY_PLUGGED_IN,
    REPLUG_NS, REPLY_NS, RESTART, RESTART_NS, STOP, TOUCH, TOUCH_ALL,
};
use crate::glove::cyberglove::reply::{Reply, find_reply};
use crate::glove::cyberglove::running::Learned;
use crate::glove::cyberglove::script::{Answers, SCRIPT, Step, command, take_answer};
use crate::glove::cyberglove::settings::CyberGloveSettings;
use crate::glove::sensor::SensorMask;
use crate::reading::GloveReading;
use crate::session::{DeviceEvent, DeviceInfo, PortRequest, Session, SessionState};
use crate::ticks::Unwrapped;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stage {
    Closed,
    /// `^C` was sent; input is thrown away, then the script starts, or the stream if `resume`.
    Draining {
        resume: bool,
    },
    /// Waits for the answer to a step of the script.
    Script {
        index: usize,
        attempt: u32,
    },
    /// `^R` was sent.
    Restarting,
    /// The box answers, and has no glove.
    WaitingForGlove,
    Running,
}

/// A CyberGlove as a state machine. **Emulated, not yet tried on hardware.**
#[derive(Debug)]
pub struct CyberGloveSession {
    pub(super) settings: CyberGloveSettings,
    pub(super) calibration: GloveCalibration,
    pub(super) core: Core,
    pub(super) buffer: StampedBuffer,
    pub(super) stage: Stage,
    pub(super) deadline_ns: Option<u64>,
    pub(super) answers: Answers,
    pub(super) layout: RecordLayout,
    pub(super) learned: Learned,
    pub(super) giving: Giving,
    pub(super) sequence: u64,
    pub(super) ticks: Unwrapped,
    pub(super) bad_in_row: u32,
    /// Their bytes.
    pub(super) bad_bytes: usize,
    /// Whether the last record was good.
    pub(super) in_step: bool,
    pub(super) last_record_ns: u64,
    pub(super) restarts_here: u32,
    /// Stream restarts without a good record since.
    pub(super) fruitless_resumes: u32,
    /// Openings of the port since the device last answered.
    pub(super) silent_openings: u32,
    pub(super) first_bytes: Vec<u8>,
}

impl CyberGloveSession {
    /// A session for a port that is not open yet.
    #[must_use]
    pub fn new(settings: CyberGloveSettings, calibration: GloveCalibration) -> Self {
        let layout = RecordLayout {
            letter: settings.letter(),
            mask: settings.forced_mask().unwrap_or(SensorMask::TWENTY_TWO),
            stamp: false,
            status: settings.status,
        };
        Self {
            settings,
            calibration,
            core: Core::new(),
            buffer: StampedBuffer::default(),
            stage: Stage::Closed,
            deadline_ns: None,
            answers: Answers::default(),
            layout,
            learned: Learned::default(),
            giving: Giving::default(),
            sequence: 0,
            ticks: Unwrapped::default(),
            bad_in_row: 0,
            bad_bytes: 0,
            in_step: false,
            last_record_ns: 0,
            restarts_here: 0,
            fruitless_resumes: 0,
            silent_openings: 0,
            first_bytes: Vec::new(),
        }
    }

    pub(super) fn drain(&mut self, now_ns: u64, resume: bool) {
        self.core.send([STOP]);
        self.stage = Stage::Draining { resume };
        self.deadline_ns = Some(now_ns + DRAIN_NS);
    }

    /// Sends the command of a step, or of the first after it that is needed; at the end, starts sampling.
    fn ask(&mut self, now_ns: u64, index: usize, attempt: u32) {
        match &self.core.fault {
            // While no glove is plugged in, each question is not worth a change of state.
            Some(Fault::GloveUnplugged) if index == 0 => {}
            fault => {
                let fault = fault.clone().filter(|_| index == 0);
                self.core.enter(now_ns, SessionState::Querying, fault);
            }
        }
        for (index, step) in SCRIPT.iter().enumerate().skip(index) {
            if let Some(command) = command(*step, &self.settings, &self.answers) {
                self.core.send(command.bytes);
                self.stage = Stage::Script { index, attempt };
                self.deadline_ns = Some(now_ns + REPLY_NS);
                return;
            }
        }
        self.identify();
        self.start_sampling(now_ns);
    }

    fn identify(&mut self) {
        if let Some(mask) = self.answers.mask(self.settings.forced_mask()) {
            self.layout.mask = mask;
        }
        self.layout.status = self.answers.status;
        self.layout.stamp = false;
        let firmware = self.answers.version.map_or_else(String::new, |version| {
            let [box_major, box_minor, glove_major, glove_minor] = version;
            format!("box {box_major}.{box_minor}, glove {glove_major}.{glove_minor}")
        });
        self.core.emit(DeviceEvent::Identified(DeviceInfo {
            family: FAMILY,
            firmware,
            identity: String::new(),
            n_sensors: self.layout.mask.count(),
            hand: self.answers.hand,
            tick_ns: None,
            rate_hz: None,
        }));
    }

    fn take_reply(&mut self, now_ns: u64, index: usize) {
        let step = SCRIPT[index];
        let Some(command) = command(step, &self.settings, &self.answers) else {
            return;
        };
        let echo = &command.bytes[..command.n_echo];
        match find_reply(self.buffer.as_slice(), echo, command.n_data) {
            Reply::Missing { n_bytes } => self.buffer.consume(n_bytes),
            Reply::Refused { code, n_bytes } => {
                self.buffer.consume(n_bytes);
                self.core.stats.device_errors += 1;
                match (step, code) {
                    (Step::Ready, ERROR_NO_GLOVE) => self.take_readiness(now_ns, READY_INITIALISED),
                    // Whoever does not know `?G` is not the device that we look for: let it time out.
                    (Step::Ready, _) => {}
                    _ => self.ask(now_ns, index + 1, 0),
                }
            }
            Reply::Data { data, n_bytes } => {
                self.buffer.consume(n_bytes);
                if step == Step::Ready {
                    self.take_readiness(now_ns, data[0]);
                } else {
                    take_answer(step, &data, &self.settings, &mut self.answers);
                    self.ask(now_ns, index + 1, 0);
                }
            }
        }
    }

    fn take_readiness(&mut self, now_ns: u64, flags: u8) {
        self.silent_openings = 0;
        self.restarts_here = 0;
        if flags == READY_INITIALISED | READY_PLUGGED_IN {
            self.answers = Answers::default();
            self.ask(now_ns, 1, 0);
            return;
        }
        if flags & READY_PLUGGED_IN == 0 {
            self.report_unplugged(now_ns);
        }
        self.stage = Stage::WaitingForGlove;
        self.deadline_ns = Some(now_ns + REPLUG_NS);
    }

    pub(super) fn report_unplugged(&mut self, now_ns: u64) {
        self.core
            .enter(now_ns, SessionState::Stalled, Some(Fault::GloveUnplugged));
        let reading = GloveReading {
            plugged_in: Some(false),
            error: Some(char::from(ERROR_NO_GLOVE)),
            ..GloveReading::empty(now_ns, self.sequence)
        };
        self.sequence += 1;
        self.core.emit(DeviceEvent::Glove(reading));
    }

    /// No answer to a step: ask again, skip it, or restart the firmware.
    fn step_timed_out(&mut self, now_ns: u64, index: usize, attempt: u32) {
        if attempt + 1 < ATTEMPTS {
            self.ask(now_ns, index, attempt + 1);
        } else if SCRIPT[index] != Step::Ready {
            if SCRIPT[index] == Step::Status {
                // Its answer was lost rather than the setting: a record that lost a byte must not pass for one without
                // status. If it was not, the length is learned.
                self.answers.status = self.settings.status;
            }
            self.ask(now_ns, index + 1, 0);
        } else if self.restarts_here < (1 + self.silent_openings).min(MAX_RESTARTS) {
            self.restarts_here += 1;
            self.core.stats.restarts += 1;
            self.core.send([RESTART]);
            self.stage = Stage::Restarting;
            self.deadline_ns = Some(now_ns + RESTART_NS);
            let fault = self.no_answer();
            self.core
                .enter(now_ns, SessionState::Resetting, Some(fault));
        } else {
            self.give_up(now_ns);
        }
    }

    fn no_answer(&self) -> Fault {
        if self.first_bytes.is_empty() {
            Fault::Silent { device: FAMILY }
        } else {
            Fault::NotThisDevice {
                device: FAMILY,
                first_bytes: hex(&self.first_bytes),
            }
        }
    }

    fn give_up(&mut self, now_ns: u64) {
        let fault = self.no_answer();
        self.core.enter(now_ns, SessionState::Stalled, Some(fault));
        self.silent_openings = self.silent_openings.saturating_add(1);
        self.core.stats.restarts += 1;
        self.core.request(PortRequest::Reopen);
        self.stage = Stage::Closed;
        self.deadline_ns = None;
    }
}

impl Session for CyberGloveSession {
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
        self.restarts_here = 0;
        self.fruitless_resumes = 0;
        let fault = match self.core.fault.take() {
            Some(kept @ (Fault::Silent { .. } | Fault::NotThisDevice { .. })) => Some(kept),
            _ => None,
        };
        self.core.enter(now_ns, SessionState::Resetting, fault);
        self.drain(now_ns, false);
    }

    fn port_lost(&mut self, now_ns: u64, fault: Fault) {
        self.buffer.clear();
        self.core.forget_port();
        self.giving.release();
        self.stage = Stage::Closed;
        self.deadline_ns = None;
        self.core.enter(now_ns, SessionState::Absent, Some(fault));
    }

    fn push(&mut self, stamp_ns: u64, bytes: &[u8]) {
        self.core.stats.bytes += bytes.len() as u64;
        let room = 64_usize.saturating_sub(self.first_bytes.len());
        self.first_bytes
            .extend_from_slice(&bytes[..bytes.len().min(room)]);
        for piece in bytes.chunks(512) {
            match self.stage {
                Stage::Closed
                | Stage::Draining { .. }
                | Stage::Restarting
                | Stage::WaitingForGlove => {}
                Stage::Script { index, .. } => {
                    self.buffer.push(stamp_ns, piece);
                    self.take_reply(stamp_ns, index);
                }
                Stage::Running => {
                    self.buffer.push(stamp_ns, piece);
                    self.take_records(stamp_ns);
                }
            }
        }
    }

    fn deadline(&self) -> Option<u64> {
        self.deadline_ns
    }

    fn handle_timeout(&mut self, now_ns: u64) {
        if self
            .deadline_ns
            .is_none_or(|deadline_ns| now_ns < deadline_ns)
        {
            return;
        }
        match self.stage {
            Stage::Closed => self.deadline_ns = None,
            Stage::Draining { resume: true } => self.start_sampling(now_ns),
            Stage::Draining { resume: false } | Stage::Restarting | Stage::WaitingForGlove => {
                self.ask(now_ns, 0, 0);
            }
            Stage::Script { index, attempt } => self.step_timed_out(now_ns, index, attempt),
            Stage::Running => self.running_timed_out(now_ns),
        }
    }

    fn farewell(&self) -> &'static [u8] {
        if self.answers.vibrates {
            &[TOUCH, TOUCH_ALL, 0, 0, 0, 0, 0, 0, STOP]
        } else {
            &[STOP]
        }
    }

    fn set_calibration(&mut self, calibration: GloveCalibration) {
        self.calibration = calibration;
    }

    fn set_feedback(&mut self, now_ns: u64, feedback: Feedback) {
        self.giving.ask(now_ns, feedback);
        self.give(now_ns);
    }
}
