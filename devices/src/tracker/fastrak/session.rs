//! The start-up, the recovery and the framing of a Fastrak.
//!
//! A header can occur inside float bytes, so after losing step a record is trusted only when another record begins where
//! it ends.

use crate::fault::Fault;
use crate::session::DeviceInfo;
use crate::tracker::dialect::{Answer, Answered, Dialect, Step, TrackerRecord, Verdict};
use crate::tracker::fastrak::decode::{Encoding, RecordFormat, Sample, decode_record, is_header};
use crate::tracker::fastrak::protocol::{
    ATTEMPTS, CONTINUOUS, CONTROL, DRAIN_NS, FAMILY, HEADER_LENGTH, QUIET, RESETS, STATUS,
    STATUS_NS, data_usable,
};
use crate::tracker::fastrak::settings::{FastrakSettings, commands};
use crate::tracker::fastrak::status::{ControlRecord, Front, StatusRecord, read_front};
use crate::tracker::session::TrackerSession;

/// Times that a unit which has answered is asked whether it has taken the settings, should an answer be lost.
const N_CHECKS: usize = 2;

/// A Fastrak as a state machine. **Emulated, not yet tried on hardware.**
pub type FastrakSession = TrackerSession<FastrakDialect>;

impl FastrakSession {
    /// A session for a port that is not open yet.
    #[must_use]
    pub fn new(settings: FastrakSettings) -> Self {
        Self::speaking(FastrakDialect {
            format: settings.format(),
            settings,
            status: StatusRecord::default(),
            n_sent: 0,
        })
    }
}

/// What a Fastrak says and understands.
#[derive(Debug)]
pub struct FastrakDialect {
    settings: FastrakSettings,
    format: RecordFormat,
    /// The last status.
    status: StatusRecord,
    /// Times that this start-up has sent the settings.
    n_sent: u32,
}

impl FastrakDialect {
    /// The setting that the unit has not taken.
    fn missing(&self) -> Option<&'static str> {
        if !self.status.centimetres() {
            Some("centimetres")
        } else if self.status.binary() != (self.settings.encoding == Encoding::Binary) {
            Some("binary or ASCII")
        } else {
            None
        }
    }

    /// The first status says who it is; those that follow, whether it has taken the settings.
    fn take_status(&mut self, status: StatusRecord, reported: Vec<Fault>) -> Answer {
        self.status = status;
        let mut then = Vec::new();
        match self.missing() {
            None if self.n_sent > 0 => {}
            Some(setting) if self.n_sent >= ATTEMPTS => {
                return Answer::Bad(Fault::Refused {
                    device: FAMILY,
                    setting: setting.to_owned(),
                });
            }
            None | Some(_) => {
                self.n_sent += 1;
                then.extend(commands(&self.settings).into_iter().map(Step::Send));
                then.extend(Step::ask_repeatedly(&[STATUS], STATUS_NS, N_CHECKS));
            }
        }
        Answer::Good(Answered {
            then,
            reported,
            standing: None,
        })
    }

    fn judge_data(&self, bytes: &[u8], in_step: bool) -> Verdict {
        let Some((record, after)) = bytes.split_at_checked(self.format.length()) else {
            return Verdict::More;
        };
        let Ok(sample) = decode_record(record, &self.format) else {
            return Verdict::Skip;
        };
        let followed = is_header(after) || after.first() == Some(&CONTROL);
        match (in_step, followed) {
            (false, false) => Verdict::Skip,
            (false, true) if after.len() < HEADER_LENGTH => Verdict::More,
            (true, _) | (false, true) => Verdict::Record(record.len(), record_from_sample(&sample)),
        }
    }
}

fn record_from_sample(sample: &Sample) -> TrackerRecord {
    TrackerRecord {
        station: sample.station.into(),
        position: sample.position,
        rotation: sample.rotation,
        error: sample.error.map(char::from),
        usable: sample.error.is_none_or(data_usable),
        ticks: None,
        pressed: sample.stylus_pressed,
    }
}

const fn refusal(code: String) -> Fault {
    Fault::Reported {
        device: FAMILY,
        code,
        meaning: "command refused",
    }
}

impl Dialect for FastrakDialect {
    fn family(&self) -> &'static str {
        FAMILY
    }

    fn n_start_ups(&self) -> usize {
        RESETS.len()
    }

    fn start_up(&mut self, attempt: usize) -> Vec<Step> {
        self.n_sent = 0;
        let (reset, n_questions) = RESETS[attempt];
        let mut steps = vec![Step::Send(reset.to_vec()), Step::Wait(DRAIN_NS)];
        steps.extend(Step::ask_repeatedly(&[STATUS], STATUS_NS, n_questions));
        steps.push(Step::Send(vec![CONTINUOUS]));
        steps
    }

    /// All resets in a row take three quarters of a minute, so the port is opened anew in between in any case.
    fn last_start_up(&self, silent_openings: usize, _answered: bool) -> usize {
        let strongest = self.n_start_ups() - 1;
        strongest.min(silent_openings.saturating_add(1))
    }

    fn answer(&mut self, _question: &[u8], bytes: &[u8], _end: bool) -> Answer {
        let mut reported = Vec::new();
        let mut rest = bytes;
        while !rest.is_empty() {
            let n_read = match read_front(rest) {
                Front::Whole(_, ControlRecord::Status(status)) => {
                    return self.take_status(status, reported);
                }
                Front::Whole(length, ControlRecord::Refusal(code)) => {
                    reported.push(refusal(code));
                    length
                }
                // The status may begin within what seems to be another record.
                Front::Whole(_, ControlRecord::Other) | Front::Part | Front::Other => 1,
            };
            rest = &rest[n_read..];
        }
        Answer::More
    }

    fn judge(&mut self, bytes: &[u8], in_step: bool) -> Verdict {
        match bytes.first() {
            None => Verdict::More,
            Some(&CONTROL) => match read_front(bytes) {
                Front::Whole(length, ControlRecord::Refusal(code)) => {
                    Verdict::Report(length, refusal(code))
                }
                Front::Whole(length, _) => Verdict::Other(length),
                Front::Part => Verdict::More,
                Front::Other => Verdict::Skip,
            },
            Some(_) if is_header(bytes) => self.judge_data(bytes, in_step),
            Some(_) => Verdict::Skip,
        }
    }

    fn info(&self) -> DeviceInfo {
        DeviceInfo {
            family: FAMILY,
            firmware: self.status.firmware.clone(),
            identity: self.status.identity.clone(),
            n_sensors: self.settings.stations.iter().filter(|used| **used).count(),
            hand: None,
            tick_ns: None,
            rate_hz: None,
        }
    }

    fn wants(&self, station: u16) -> bool {
        self.settings.has_station(station)
    }

    fn quiet(&self) -> &'static [u8] {
        &[QUIET]
    }
}
