//! The CyberGlove while it sends samples: records, losing step and finding it again, silence.

use crate::fault::{Fault, hex};
use crate::glove::cyberglove::decode::{RecordLayout, Sample, decode_record};
use crate::glove::cyberglove::protocol::{
    ERROR, ERROR_CODES, ERROR_NO_GLOVE, FAMILY, MAX_BAD_LENGTHS, MAX_BAD_RECORDS, MAX_LOST_BYTES,
    MAX_RECORD, MAX_RESTARTS, TERMINATOR, TOUCH, TOUCH_ALL, error_meaning,
};
use crate::glove::cyberglove::session::{CyberGloveSession, Stage};
use crate::glove::cyberglove::settings::Sampling;
use crate::glove::sensor::SensorMask;
use crate::reading::GloveReading;
use crate::session::{DeviceEvent, PortRequest, SessionState};

/// How often in a row a record of a length that was not negotiated came.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Learned {
    length: usize,
    n_records: u32,
}

impl CyberGloveSession {
    pub(super) fn start_sampling(&mut self, now_ns: u64) {
        self.buffer.clear();
        // Whatever a host before this one left on is set anew.
        self.giving.repeat();
        self.core.send([self.settings.letter()]);
        self.stage = Stage::Running;
        self.in_step = true;
        self.bad_in_row = 0;
        self.bad_bytes = 0;
        self.learned = Learned::default();
        self.last_record_ns = now_ns;
        self.deadline_ns = Some(self.running_deadline(now_ns));
    }

    /// When polling, the next question; when streaming, the end of patience.
    fn running_deadline(&self, now_ns: u64) -> u64 {
        let silence_ns = self.last_record_ns + self.settings.silence_ns();
        match self.settings.sampling {
            Sampling::Stream => silence_ns,
            Sampling::Poll { period_ns } => silence_ns.min(now_ns + period_ns.max(1)),
        }
    }

    pub(super) fn take_records(&mut self, now_ns: u64) {
        while self.stage == Stage::Running {
            let bytes = self.buffer.as_slice();
            let Some(end) = bytes.iter().position(|byte| *byte == TERMINATOR) else {
                if bytes.len() > 2 * MAX_RECORD {
                    let n_bytes = bytes.len();
                    self.reject(now_ns, n_bytes);
                }
                return;
            };
            let stamp_ns = self.buffer.stamp_ns(end);
            match &bytes[..end] {
                [] => self.buffer.consume(1),
                // The vibrators have been set.
                [TOUCH] => self.buffer.consume(end + 1),
                [ERROR, code] if ERROR_CODES.contains(code) => {
                    let code = *code;
                    self.buffer.consume(end + 1);
                    self.take_error(stamp_ns, code);
                }
                record => match decode_record(record, &self.layout) {
                    Ok(sample) => {
                        self.buffer.consume(end + 1);
                        self.accept(stamp_ns, &sample);
                    }
                    Err(_) => self.reject(now_ns, end + 1),
                },
            }
        }
    }

    fn accept(&mut self, stamp_ns: u64, sample: &Sample) {
        self.core.stats.records += 1;
        self.last_record_ns = stamp_ns;
        self.in_step = true;
        self.bad_in_row = 0;
        self.bad_bytes = 0;
        self.fruitless_resumes = 0;
        self.learned = Learned::default();
        if self.settings.sampling == Sampling::Stream {
            self.deadline_ns = Some(self.running_deadline(stamp_ns));
        }
        self.core.stats.device_errors += u64::from(sample.error.is_some());
        let unplugged = sample.error == Some(ERROR_NO_GLOVE)
            || sample.status.is_some_and(|status| !status.plugged_in);
        let fault = match sample.error {
            _ if unplugged => Some(Fault::GloveUnplugged),
            Some(code) => Some(reported(code)),
            None => None,
        };
        self.core.enter(stamp_ns, SessionState::Running, fault);
        let says = unplugged || sample.status.is_some();
        self.core.emit(DeviceEvent::Glove(GloveReading {
            sensors: self
                .calibration
                .angles(&sample.raw.map(|raw| raw.map(f64::from))),
            angles_valid: !unplugged,
            plugged_in: says.then_some(!unplugged),
            switch_on: sample.status.map(|status| status.switch_on),
            device_ticks: sample.device_ticks.map(|ticks| self.ticks.unwrap(ticks)),
            hand: self.answers.hand,
            error: sample.error.map(char::from),
            ..GloveReading::empty(stamp_ns, self.sequence)
        }));
        self.sequence += 1;
        self.give(stamp_ns);
    }

    /// Sets the vibrators of a CyberTouch, if they are due: each finger's to the resistance that it is to feel. The
    /// palm's stays off.
    pub(super) fn give(&mut self, now_ns: u64) {
        if self.stage != Stage::Running || !self.answers.vibrates {
            return;
        }
        if let Some([thumb, index, middle, ring, little]) = self.giving.due(now_ns, 255) {
            // None is above 255.
            let fingers = [thumb, index, middle, ring, little].map(|level| level as u8);
            self.core
                .send([&[TOUCH, TOUCH_ALL][..], &fingers, &[0]].concat());
        }
    }

    fn take_error(&mut self, now_ns: u64, code: u8) {
        self.core.stats.device_errors += 1;
        if code == ERROR_NO_GLOVE {
            self.report_unplugged(now_ns);
            self.last_record_ns = now_ns;
        } else {
            self.core
                .enter(now_ns, self.core.state, Some(reported(code)));
        }
    }

    /// Drops a record that failed a check; after a few in a row, learns the layout or starts the stream again.
    fn reject(&mut self, now_ns: u64, n_bytes: usize) {
        let record: Vec<u8> = self.buffer.as_slice()[..n_bytes].to_vec();
        self.buffer.consume(n_bytes);
        // The bare letter is a mere echo.
        if record == [self.layout.letter, TERMINATOR] {
            return;
        }
        self.core.stats.dropped_records += 1;
        self.core.stats.resyncs += u64::from(self.in_step);
        self.in_step = false;
        self.bad_in_row += 1;
        self.bad_bytes += n_bytes;
        let many = self.bad_in_row >= MAX_BAD_RECORDS
            && self.bad_bytes >= MAX_BAD_LENGTHS * (self.layout.length() + 1);
        if self.learns(&record) || !many {
            return;
        }
        self.core.stats.restarts += 1;
        self.fruitless_resumes += 1;
        let resume = self.fruitless_resumes < MAX_RESTARTS;
        if !resume {
            let first_bytes = hex(&record);
            self.core.enter(
                now_ns,
                SessionState::Stalled,
                Some(Fault::Garbled {
                    device: FAMILY,
                    first_bytes,
                }),
            );
            self.fruitless_resumes = 0;
        }
        self.drain(now_ns, resume);
    }

    /// Adopts the layout of three bad records of equal length, if that length is one of a glove's. Shorter ones have to be
    /// five where there were good ones before: on a bad line three in a row may well have lost a byte each.
    ///
    /// Only so, because a record that lost one byte can look like one of another layout.
    fn learns(&mut self, record: &[u8]) -> bool {
        let body = &record[..record.len() - 1];
        let again = self.learned.length == body.len();
        self.learned = Learned {
            length: body.len(),
            n_records: if again { self.learned.n_records + 1 } else { 1 },
        };
        let is_shorter = self.core.stats.records > 0 && body.len() < self.layout.length();
        let n_needed = if is_shorter {
            MAX_LOST_BYTES
        } else {
            MAX_BAD_RECORDS
        };
        if self.learned.n_records < n_needed {
            return false;
        }
        let certain = self.answers.mask(self.settings.forced_mask());
        let masks = certain.map_or_else(
            || vec![SensorMask::TWENTY_TWO, SensorMask::EIGHTEEN],
            |mask| vec![mask],
        );
        let found = masks
            .into_iter()
            .flat_map(|mask| {
                [(false, true), (false, false), (true, true), (true, false)].map(
                    |(stamp, status)| RecordLayout {
                        mask,
                        stamp,
                        status,
                        ..self.layout
                    },
                )
            })
            .find(|layout| decode_record(body, layout).is_ok());
        if let Some(layout) = found {
            self.layout = layout;
            self.bad_in_row = 0;
            self.bad_bytes = 0;
        }
        found.is_some()
    }

    pub(super) fn running_timed_out(&mut self, now_ns: u64) {
        if now_ns < self.last_record_ns + self.settings.silence_ns() {
            if self.settings.sampling != Sampling::Stream {
                self.core.send([self.settings.letter()]);
            }
            self.deadline_ns = Some(self.running_deadline(now_ns));
            return;
        }
        let fault = match &self.core.fault {
            Some(Fault::GloveUnplugged) => Fault::GloveUnplugged,
            _ => Fault::Silent { device: FAMILY },
        };
        self.core.enter(now_ns, SessionState::Stalled, Some(fault));
        self.core.stats.restarts += 1;
        self.first_bytes.clear();
        self.core.request(PortRequest::ReapplySettings);
        self.drain(now_ns, false);
    }
}

fn reported(code: u8) -> Fault {
    Fault::Reported {
        device: FAMILY,
        code: char::from(code).to_string(),
        meaning: error_meaning(code),
    }
}
