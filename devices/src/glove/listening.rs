//! A session for gloves that send by themselves: what they share, from the first byte to recovery.
//!
//! ```text
//!  Closed -> Asking (what the format asks; most ask nothing) -> Listening (records, or waiting for the first)
//!              ^                                                     | silence, or bytes that are no records
//!              +-----------------------------------------------------+ a few times, then the port is opened again
//! ```

use crate::buffer::StampedBuffer;
use crate::core::Core;
use crate::fault::{Fault, hex};
use crate::glove::auto_range::AutoRange;
use crate::glove::calibrate::GloveCalibration;
use crate::glove::format::{Cut, Format, Sample};
use crate::glove::sensor::GloveSensor;
use crate::reading::GloveReading;
use crate::session::{DeviceEvent, DeviceInfo, PortRequest, Session, SessionState};

/// How often a question is put that a device has to answer.
const ATTEMPTS: u32 = 3;
/// Bytes of a device that makes no sense which are kept for the message.
const FIRST_BYTES: usize = 64;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Closed,
    Asking { step: usize, attempt: u32 },
    Listening,
}

/// A glove that sends by itself, as a state machine.
#[derive(Debug)]
pub struct Listening<F> {
    format: F,
    calibration: GloveCalibration,
    /// Sensors that the wearer's file names, by wire slot.
    named: [bool; GloveSensor::N_SLOTS],
    ranges: AutoRange,
    core: Core,
    buffer: StampedBuffer,
    stage: Stage,
    deadline_ns: Option<u64>,
    /// What was last said about the device.
    told: Option<DeviceInfo>,
    sequence: u64,
    /// Whether a record has arrived since the port was opened.
    ran: bool,
    /// Whether the last bytes were a record.
    in_step: bool,
    /// Bytes without a record.
    bad_bytes: usize,
    /// Those since the last record that was counted as lost.
    lost_bytes: usize,
    /// What was done in vain since the last record.
    fruitless: u32,
    /// How many bytes have come since the last record, or since something was done about it.
    heard: usize,
    /// The first of them.
    first_bytes: Vec<u8>,
}

impl<F: Format> Listening<F> {
    /// A session for a port that is not open yet.
    #[must_use]
    pub fn with_format(format: F, calibration: GloveCalibration) -> Self {
        let mut session = Self {
            format,
            calibration: GloveCalibration::default(),
            named: [false; GloveSensor::N_SLOTS],
            ranges: AutoRange::default(),
            core: Core::new(),
            buffer: StampedBuffer::default(),
            stage: Stage::Closed,
            deadline_ns: None,
            told: None,
            sequence: 0,
            ran: false,
            in_step: false,
            bad_bytes: 0,
            lost_bytes: 0,
            fruitless: 0,
            heard: 0,
            first_bytes: Vec::new(),
        };
        session.wear(calibration);
        session
    }

    fn wear(&mut self, calibration: GloveCalibration) {
        self.named = [false; GloveSensor::N_SLOTS];
        for sensor in calibration.sensors.keys() {
            self.named[sensor.slot()] = true;
        }
        self.ranges = AutoRange::default();
        self.calibration = calibration.filled(|sensor| self.format.default_of(sensor));
    }

    /// Forgets the ranges that were learned from another glove.
    fn unlearn(&mut self) {
        self.ranges = AutoRange::default();
        for sensor in GloveSensor::ALL {
            if !self.named[sensor.slot()] {
                let default = self.format.default_of(sensor);
                self.calibration.sensors.insert(sensor, default);
            }
        }
    }

    fn begin(&mut self, now_ns: u64) {
        self.format.begin();
        self.in_step = false;
        self.bad_bytes = 0;
        self.ask(now_ns, 0, 0);
    }

    /// Puts the question of a step, or listens after the last.
    fn ask(&mut self, now_ns: u64, step: usize, attempt: u32) {
        let mut step = step;
        while let Some(question) = self.format.question(step) {
            // A device that is being revived stays stalled until it sends.
            if self.core.state == SessionState::Resetting {
                let fault = self.core.fault.clone();
                self.core.enter(now_ns, SessionState::Querying, fault);
            }
            self.core.send(question.bytes);
            if let Some(answer_ns) = question.answer_ns {
                self.stage = Stage::Asking { step, attempt };
                self.deadline_ns = Some(now_ns + answer_ns);
                return;
            }
            step += 1;
        }
        self.stage = Stage::Listening;
        self.deadline_ns = Some(now_ns + self.format.limits().silence_ns);
    }

    fn take(&mut self, now_ns: u64) {
        while let Stage::Asking { step, .. } = self.stage {
            let Some(n_bytes) = self.format.answer(step, self.buffer.as_slice()) else {
                return;
            };
            self.buffer.consume(n_bytes);
            self.ask(now_ns, step + 1, 0);
        }
        while self.stage == Stage::Listening && !self.buffer.as_slice().is_empty() {
            match self.format.cut(self.buffer.as_slice()) {
                Cut::Wait => return,
                Cut::Filler(n_bytes) => self.buffer.consume(n_bytes.max(1)),
                Cut::Bad(n_bytes) => self.reject(now_ns, n_bytes.max(1)),
                Cut::About(n_bytes) => {
                    self.buffer.consume(n_bytes.max(1));
                    self.identify();
                }
                Cut::Record(n_bytes, sample) => {
                    let stamp_ns = self.buffer.stamp_ns(n_bytes.max(1) - 1);
                    self.buffer.consume(n_bytes.max(1));
                    self.accept(stamp_ns, &sample);
                }
            }
        }
    }

    /// Tells what is known of the device, unless that was told already. Another device has other ranges.
    fn identify(&mut self) {
        let info = self.format.info();
        if self.told.as_ref() == Some(&info) {
            return;
        }
        if self.told.is_some() {
            self.unlearn();
        }
        self.told = Some(info.clone());
        self.core.emit(DeviceEvent::Identified(info));
    }

    fn accept(&mut self, stamp_ns: u64, sample: &Sample) {
        let told_hand = self.told.as_ref().and_then(|told| told.hand);
        if !self.ran || told_hand != sample.hand {
            self.identify();
        }
        self.core.stats.records += 1;
        self.ran = true;
        self.in_step = true;
        self.bad_bytes = 0;
        self.lost_bytes = 0;
        self.fruitless = 0;
        self.forget_first_bytes();
        self.deadline_ns = Some(stamp_ns + self.format.limits().silence_ns);
        self.core.enter(stamp_ns, SessionState::Running, None);
        if self.format.learns_ranges() {
            let span = self.format.raw_span();
            self.ranges
                .add(&sample.raw, span, &self.named, &mut self.calibration);
        }
        self.core.emit(DeviceEvent::Glove(GloveReading {
            sensors: self.calibration.angles(&sample.raw),
            angles_valid: true,
            device_ticks: sample.device_ticks,
            hand: sample.hand.or(self.calibration.hand),
            controls: sample.controls,
            ..GloveReading::empty(stamp_ns, self.sequence)
        }));
        self.sequence += 1;
    }

    /// Throws bytes away; after many in a row, tries to set the device right.
    fn reject(&mut self, now_ns: u64, n_bytes: usize) {
        self.buffer.consume(n_bytes);
        let limits = self.format.limits();
        if self.in_step {
            self.in_step = false;
            self.core.stats.resyncs += 1;
            self.core.stats.dropped_records += 1;
        } else if self.ran {
            self.lost_bytes += n_bytes;
            let n_lost = self.lost_bytes / limits.record_bytes.max(1);
            self.lost_bytes %= limits.record_bytes.max(1);
            self.core.stats.dropped_records += n_lost as u64;
        }
        self.bad_bytes += n_bytes;
        if self.bad_bytes < limits.garbage_bytes {
            return;
        }
        if !self.ran {
            // What has never made sense is another device, or the line rate is wrong.
            self.fruitless = limits.tries;
        }
        self.recover(now_ns);
    }

    fn forget_first_bytes(&mut self) {
        self.heard = 0;
        self.first_bytes.clear();
    }

    /// What is wrong with a device from which no record comes.
    fn fault(&self) -> Fault {
        let device = F::FAMILY;
        let first_bytes = hex(&self.first_bytes);
        if self.heard < self.format.limits().record_bytes {
            Fault::Silent { device }
        } else if self.ran {
            Fault::Garbled {
                device,
                first_bytes,
            }
        } else {
            Fault::NotThisDevice {
                device,
                first_bytes,
            }
        }
    }

    /// Starts the device again, or after a few times has the port opened again.
    fn recover(&mut self, now_ns: u64) {
        let fault = self.fault();
        self.core.enter(now_ns, SessionState::Stalled, Some(fault));
        self.core.stats.restarts += 1;
        self.fruitless += 1;
        self.forget_first_bytes();
        if self.fruitless >= self.format.limits().tries {
            self.give_up();
        } else {
            self.core.request(PortRequest::ReapplySettings);
            self.begin(now_ns);
        }
    }

    fn give_up(&mut self) {
        self.core.request(PortRequest::Reopen);
        self.stage = Stage::Closed;
        self.deadline_ns = None;
    }

    fn unanswered(&mut self, now_ns: u64, step: usize, attempt: u32) {
        let needed = self
            .format
            .question(step)
            .is_some_and(|question| question.needed);
        if attempt + 1 < ATTEMPTS {
            self.ask(now_ns, step, attempt + 1);
        } else if needed {
            let fault = self.fault();
            self.core.enter(now_ns, SessionState::Stalled, Some(fault));
            self.core.stats.restarts += 1;
            self.give_up();
        } else {
            self.ask(now_ns, step + 1, 0);
        }
    }
}

impl<F: Format> Session for Listening<F> {
    fn core(&self) -> &Core {
        &self.core
    }

    fn core_mut(&mut self) -> &mut Core {
        &mut self.core
    }

    fn port_opened(&mut self, now_ns: u64) {
        self.buffer.clear();
        self.core.forget_port();
        self.forget_first_bytes();
        self.ran = false;
        self.fruitless = 0;
        let fault = match self.core.fault.take() {
            Some(
                kept @ (Fault::Silent { .. } | Fault::NotThisDevice { .. } | Fault::Garbled { .. }),
            ) => Some(kept),
            _ => None,
        };
        self.core.enter(now_ns, SessionState::Resetting, fault);
        self.begin(now_ns);
    }

    fn port_lost(&mut self, now_ns: u64, fault: Fault) {
        self.buffer.clear();
        self.core.forget_port();
        self.stage = Stage::Closed;
        self.deadline_ns = None;
        self.core.enter(now_ns, SessionState::Absent, Some(fault));
    }

    fn push(&mut self, stamp_ns: u64, bytes: &[u8]) {
        self.core.stats.bytes += bytes.len() as u64;
        for piece in bytes.chunks(512) {
            if self.stage == Stage::Closed {
                return;
            }
            self.heard = self.heard.saturating_add(piece.len());
            let room = FIRST_BYTES.saturating_sub(self.first_bytes.len());
            self.first_bytes
                .extend_from_slice(&piece[..piece.len().min(room)]);
            self.buffer.push(stamp_ns, piece);
            self.take(stamp_ns);
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
            Stage::Asking { step, attempt } => self.unanswered(now_ns, step, attempt),
            Stage::Listening => self.recover(now_ns),
        }
    }

    fn farewell(&self) -> &'static [u8] {
        self.format.farewell()
    }

    fn set_calibration(&mut self, calibration: GloveCalibration) {
        self.wear(calibration);
    }
}
