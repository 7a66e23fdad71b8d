//! The start-up, the recovery and the framing of Isotrak II and 3SPACE Tracker.

use crate::session::DeviceInfo;
use crate::tracker::dialect::{Answer, Answered, Dialect, Step, Verdict};
use crate::tracker::fastrak::protocol::{CONTINUOUS, CONTROL, DATA, DRAIN_NS, QUIET, STATUS};
use crate::tracker::isotrak::decode::decode_record;
use crate::tracker::isotrak::protocol::{STATUS_LENGTHS, WIRE_LENGTH};
use crate::tracker::isotrak::settings::{IsotrakSettings, commands};
use crate::tracker::packed::PHASE;
use crate::tracker::session::TrackerSession;

/// Wait for the status, ns; it takes 22 ms at 9600 bit/s.
const STATUS_NS: u64 = 500_000_000;
/// Time between questions to a unit that is busy with its reset, ns.
const PATIENT_NS: u64 = 1_000_000_000;
/// Such questions; a reset takes about 10 s.
const N_PATIENT: usize = 12;

/// An Isotrak II or 3SPACE Tracker as a state machine. **Emulated, not yet tried on hardware.**
pub type IsotrakSession = TrackerSession<IsotrakDialect>;

impl IsotrakSession {
    /// A session for a port that is not open yet.
    #[must_use]
    pub fn new(settings: IsotrakSettings) -> Self {
        Self::speaking(IsotrakDialect {
            settings,
            identity: String::new(),
        })
    }
}

/// What these units say and understand.
#[derive(Debug)]
pub struct IsotrakDialect {
    settings: IsotrakSettings,
    /// The text of the last status.
    identity: String,
}

impl Dialect for IsotrakDialect {
    fn family(&self) -> &'static str {
        self.settings.model.family()
    }

    fn n_start_ups(&self) -> usize {
        4
    }

    fn start_up(&mut self, attempt: usize) -> Vec<Step> {
        let mut steps = match attempt {
            0 => vec![
                Step::Send(vec![QUIET]),
                Step::Wait(DRAIN_NS),
                Step::ask(&[STATUS], STATUS_NS),
            ],
            // The carriage return ends a command that was begun.
            1 => vec![
                Step::Send(b"c\r".to_vec()),
                Step::Wait(3 * DRAIN_NS),
                Step::ask(&[STATUS], 2 * STATUS_NS),
            ],
            attempt => {
                let reset: &[u8] = if attempt == 2 { b"c\r" } else { b"c\r\x19" };
                let questions = Step::ask_repeatedly(&[STATUS], PATIENT_NS, N_PATIENT);
                [Step::Send(reset.to_vec()), Step::Wait(DRAIN_NS)]
                    .into_iter()
                    .chain(questions)
                    .collect()
            }
        };
        steps.extend(commands(&self.settings).into_iter().map(Step::Send));
        steps.push(Step::Send(vec![CONTINUOUS]));
        steps
    }

    fn answer(&mut self, _question: &[u8], bytes: &[u8], _end: bool) -> Answer {
        let Some(text) = find_status(bytes) else {
            return Answer::More;
        };
        self.identity = text;
        Answer::Good(Answered::default())
    }

    fn judge(&mut self, bytes: &[u8], in_step: bool) -> Verdict {
        match bytes.first() {
            None => return Verdict::More,
            Some(&CONTROL) => return judge_control(bytes),
            Some(&first) if first != DATA | PHASE => return Verdict::Skip,
            Some(_) => {}
        }
        let window = &bytes[1..bytes.len().min(WIRE_LENGTH)];
        if window.iter().any(|byte| byte & PHASE != 0) {
            return Verdict::Skip;
        }
        let Some(wire) = bytes.get(..WIRE_LENGTH) else {
            return Verdict::More;
        };
        let Ok(record) = decode_record(wire, self.settings.model) else {
            return Verdict::Skip;
        };
        match bytes.get(WIRE_LENGTH) {
            _ if in_step => Verdict::Record(WIRE_LENGTH, record),
            None => Verdict::More,
            Some(&next) if next == DATA | PHASE || next == CONTROL => {
                Verdict::Record(WIRE_LENGTH, record)
            }
            Some(_) => Verdict::Skip,
        }
    }

    fn info(&self) -> DeviceInfo {
        DeviceInfo {
            family: self.family(),
            firmware: String::new(),
            identity: self.identity.clone(),
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

impl IsotrakSettings {
    /// Whether that station, numbered from 1, is used.
    #[must_use]
    pub fn has_station(&self, station: u16) -> bool {
        let index = usize::from(station).wrapping_sub(1);
        self.stations.get(index).is_some_and(|used| *used)
    }
}

const fn is_text(byte: &u8) -> bool {
    matches!(byte, b' '..=b'~' | b'\r')
}

/// The text of the first status in `bytes`: `2`, a station or a space, then text up to LF. What stands before it, such as
/// the rest of a record, is passed over.
fn find_status(bytes: &[u8]) -> Option<String> {
    let mut start = 0;
    while let Some(length) = bytes[start..].iter().position(|byte| *byte == b'\n') {
        let line = &bytes[start..start + length];
        let text = line.iter().rev().take_while(|byte| is_text(byte)).count();
        let line = &line[length - text..];
        let begins = |pair: &[u8]| {
            pair[0] == CONTROL && (pair[1] == b' ' || (b'0'..=b'4').contains(&pair[1]))
        };
        if let Some(at) = line.windows(2).position(begins)
            && STATUS_LENGTHS.contains(&(line.len() - at + 1))
        {
            let text = String::from_utf8_lossy(&line[at + 1..]);
            return Some(text.trim().to_owned());
        }
        start += length + 1;
    }
    None
}

/// An answer in the stream: text from `2` to LF.
fn judge_control(bytes: &[u8]) -> Verdict {
    let window = &bytes[..bytes.len().min(*STATUS_LENGTHS.end())];
    match window.iter().position(|byte| !is_text(byte)) {
        Some(end) if window[end] == b'\n' => Verdict::Other(end + 1),
        None if window.len() < *STATUS_LENGTHS.end() => Verdict::More,
        Some(_) | None => Verdict::Skip,
    }
}
