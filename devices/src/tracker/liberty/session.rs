//! The start-up, the recovery and the framing of Liberty, Patriot and Latus.

use crate::session::DeviceInfo;
use crate::tracker::dialect::{Answer, Answered, Dialect, Step, Verdict};
use crate::tracker::liberty::decode::{decode_frame, is_header};
use crate::tracker::liberty::protocol::{
    ASCII, HEADER_LENGTH, Model, NO_ECHO, POLL, RESET, WHO_AM_I,
};
use crate::tracker::liberty::settings::{Counter, LibertySettings, commands};
use crate::tracker::liberty::who::{Who, read_who};
use crate::tracker::session::TrackerSession;

/// Wait after [`POLL`] while old input is thrown away, ns.
const DRAIN_NS: u64 = 100_000_000;
/// Wait for the answer to [`WHO_AM_I`], ns; it takes 22 ms, and a Patriot Wireless is slow at first.
const WHO_NS: u64 = 500_000_000;
/// Time between questions to a unit that is busy with its reset, ns.
const PATIENT_NS: u64 = 1_000_000_000;
/// Such questions; a reset takes about 10 s.
const N_PATIENT: usize = 12;
/// One tick of the time stamp, ns.
const TIME_TICK_NS: f64 = 1.0e6;

/// A Liberty, Patriot or Latus as a state machine. **Emulated, not yet tried on hardware.**
pub type LibertySession = TrackerSession<LibertyDialect>;

impl LibertySession {
    /// A session for a port that is not open yet.
    #[must_use]
    pub fn new(settings: LibertySettings) -> Self {
        Self::speaking(LibertyDialect {
            settings,
            who: Who::default(),
            model: None,
        })
    }
}

/// What these units say and understand.
#[derive(Debug)]
pub struct LibertyDialect {
    settings: LibertySettings,
    who: Who,
    /// The model that frames name.
    model: Option<Model>,
}

impl LibertyDialect {
    fn model(&self) -> Model {
        self.model.or(self.who.model).unwrap_or_default()
    }
}

impl Dialect for LibertyDialect {
    fn family(&self) -> &'static str {
        self.model().family()
    }

    fn n_start_ups(&self) -> usize {
        4
    }

    fn start_up(&mut self, attempt: usize) -> Vec<Step> {
        // The carriage return ends a command that was begun; a Patriot Wireless may need it to wake.
        let mut steps = vec![Step::Send([b'\r', POLL].to_vec()), Step::Wait(DRAIN_NS)];
        if attempt >= 3 {
            steps.push(Step::Send(RESET.to_vec()));
        }
        steps.extend([NO_ECHO, ASCII].map(|command| Step::Send(command.to_vec())));
        steps.push(Step::Wait(DRAIN_NS));
        match attempt {
            0 => steps.push(Step::ask(WHO_AM_I, WHO_NS)),
            1 => steps.push(Step::ask(WHO_AM_I, 2 * WHO_NS)),
            _ => steps.extend(Step::ask_repeatedly(WHO_AM_I, PATIENT_NS, N_PATIENT)),
        }
        // A unit that was deaf has not heard the first one.
        steps.push(Step::Send(NO_ECHO.to_vec()));
        steps.extend(commands(&self.settings).into_iter().map(Step::Send));
        steps
    }

    fn answer(&mut self, _question: &[u8], bytes: &[u8], end: bool) -> Answer {
        match read_who(bytes) {
            // Its length is not known, so silence is its end.
            Some(_) if !end => Answer::Perhaps,
            Some(who) => {
                self.who = who;
                Answer::Good(Answered::default())
            }
            None => Answer::More,
        }
    }

    fn judge(&mut self, bytes: &[u8], in_step: bool) -> Verdict {
        let format = self.settings.format();
        if !is_header(bytes, format.payload_length()) {
            return Verdict::Skip;
        }
        let Some((frame, after)) = bytes.split_at_checked(format.length()) else {
            return Verdict::More;
        };
        let Ok((model, record)) = decode_frame(frame, &format) else {
            return Verdict::Skip;
        };
        if !in_step {
            if !is_header(after, format.payload_length()) {
                return Verdict::Skip;
            }
            if after.len() < HEADER_LENGTH / 2 {
                return Verdict::More;
            }
        }
        self.model = model.or(self.model);
        Verdict::Record(frame.len(), record)
    }

    fn info(&self) -> DeviceInfo {
        let model = self.model();
        let tick_ns = match self.settings.counter {
            Counter::Time => Some(TIME_TICK_NS),
            Counter::Frames => model.rate_hz().map(|rate_hz| 1.0e9 / rate_hz as f64),
        };
        let n_sensors = self.settings.stations.iter().filter(|used| **used).count();
        DeviceInfo {
            family: model.family(),
            firmware: self.who.firmware.clone(),
            identity: self.who.identity.clone(),
            n_sensors,
            hand: None,
            tick_ns,
            // More stations share a line that may be too slow for all of them.
            rate_hz: model
                .rate_hz()
                .filter(|_| n_sensors == 1)
                .map(|rate_hz| rate_hz as f64),
        }
    }

    fn wants(&self, station: u16) -> bool {
        self.settings.has_station(station)
    }

    fn quiet(&self) -> &'static [u8] {
        &[POLL]
    }
}
