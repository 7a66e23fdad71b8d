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
use crate::glove::calibrate::{GloveCalibration, Handedness, SensorCalibration};
use crate::glove::sensor::GloveSensor;
use crate::reading::{Controls, GloveReading};
use crate::session::{DeviceEvent, DeviceInfo, PortRequest, Session, SessionState, SessionStats};

/// How often a question is put that a device has to answer.
const ATTEMPTS: u32 = 3;
/// Bytes of a device that makes no sense which are kept for the message.
const FIRST_BYTES: usize = 64;

/// What a kind of glove says, and how it is made to. It sees bytes only: no port and no clock.
pub trait Format {
    /// The device family, for messages.
    const FAMILY: &'static str;

    /// When to worry.
    fn limits(&self) -> Limits;

    /// Greatest minus least raw value that the device can send.
    fn raw_span(&self) -> f64;

    /// What a sensor is taken for that the wearer's file does not name.
    fn default_of(&self, sensor: GloveSensor) -> SensorCalibration;

    /// Whether ranges are learned from what the sensors show.
    fn learns_ranges(&self) -> bool {
        false
    }

    /// What came before is forgotten: the port was opened, or the device is made to start again.
    fn begin(&mut self) {}

    /// The question of a step of the start-up; `None` after the last.
    fn question(&self, _step: usize) -> Option<Question> {
        None
    }

    /// Up to where the bytes hold the answer to a step; `None` while they do not.
    fn answer(&mut self, _step: usize, _bytes: &[u8]) -> Option<usize> {
        None
    }

    /// What stands at the front of these bytes.
    fn cut(&mut self, bytes: &[u8]) -> Cut;

    /// What is known of the device.
    fn info(&self) -> DeviceInfo;

    /// The bytes that make the device quiet.
    fn farewell(&self) -> &'static [u8] {
        &[]
    }
}

/// When a device is silent for too long, or makes no sense for too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Time without a record after which something is done, ns.
    pub silence_ns: u64,
    /// How often that is done in vain before the port is opened again.
    pub tries: u32,
    /// Length of a short record, bytes.
    pub record_bytes: usize,
    /// Bytes without a record after which something is done.
    pub garbage_bytes: usize,
}

/// Something that is sent while a device starts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Question {
    /// What is sent.
    pub bytes: Vec<u8>,
    /// How long the answer may take, ns; `None` when there is none.
    pub answer_ns: Option<u64>,
    /// Whether a device that does not answer is none of this family; otherwise the start-up goes on.
    pub needed: bool,
}

/// What stands at the front of the bytes.
#[expect(
    clippy::large_enum_variant,
    reason = "a box would cost an allocation for each of some hundred records in a second"
)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cut {
    /// Too little to tell.
    Wait,
    /// So many bytes that belong there and say nothing.
    Filler(usize),
    /// So many bytes that do not belong there.
    Bad(usize),
    /// So many bytes in which the device said something about itself.
    About(usize),
    /// A record of so many bytes.
    Record(usize, Sample),
}

/// What a record holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Raw values by wire slot; `None` for a sensor that the device lacks.
    pub raw: [Option<f64>; GloveSensor::N_SLOTS],
    /// The device's own counter, unwrapped.
    pub device_ticks: Option<u64>,
    /// Which hand the device says that it is for.
    pub hand: Option<Handedness>,
    /// Buttons and axes.
    pub controls: Controls,
}

impl Sample {
    /// A record without anything in it.
    pub const EMPTY: Self = Self {
        raw: [None; GloveSensor::N_SLOTS],
        device_ticks: None,
        hand: None,
        controls: Controls::NONE,
    };
}

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
    last_record_ns: u64,
    /// The first bytes since the last record.
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
            last_record_ns: 0,
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
        self.last_record_ns = now_ns;
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
        self.first_bytes.clear();
        self.last_record_ns = stamp_ns;
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

    /// What is wrong with a device from which no record comes.
    fn fault(&self) -> Fault {
        let device = F::FAMILY;
        let first_bytes = hex(&self.first_bytes);
        if self.first_bytes.len() < self.format.limits().record_bytes.min(FIRST_BYTES) {
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
        self.first_bytes.clear();
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
    fn port_opening(&mut self, now_ns: u64) {
        self.core.enter(now_ns, SessionState::Opening, None);
    }

    fn port_opened(&mut self, now_ns: u64) {
        self.buffer.clear();
        self.core.forget_port();
        self.first_bytes.clear();
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
            let room = FIRST_BYTES.saturating_sub(self.first_bytes.len());
            self.first_bytes
                .extend_from_slice(&piece[..piece.len().min(room)]);
            self.buffer.push(stamp_ns, piece);
            self.take(stamp_ns);
        }
    }

    fn next_event(&mut self) -> Option<DeviceEvent> {
        self.core.next_event()
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

    fn poll_transmit(&mut self) -> Option<Vec<u8>> {
        self.core.next_transmit()
    }

    fn poll_port_request(&mut self) -> Option<PortRequest> {
        self.core.requests.pop_front()
    }

    fn farewell(&self) -> &'static [u8] {
        self.format.farewell()
    }

    fn set_calibration(&mut self, calibration: GloveCalibration) {
        self.wear(calibration);
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
