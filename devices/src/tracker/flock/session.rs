//! The start-up, the recovery and the framing of a Flock of Birds.
//!
//! The line RTS holds a unit in reset, and opening a port raises it. So it is lowered first, a unit that does not answer
//! yet is given the time to start, and only one that stays silent is reset by it.

use crate::fault::Fault;
use crate::session::{DeviceInfo, PortRequest};
use crate::tracker::dialect::{Answer, Answered, Dialect, Step, Verdict};
use crate::tracker::flock::decode::decode_record;
use crate::tracker::flock::protocol::{
    AUTO_CONFIGURE, BUS, CHANGE, CRYSTAL, ERROR, EVERY_MEASUREMENT, EXAMINE, FIRMWARE, GROUP_MODE,
    MODEL, N_ADDRESSES, POINT, RATE, RUN, SLEEP, STREAM, answer_length, error_meaning,
};
use crate::tracker::flock::settings::{FlockSettings, commands};
use crate::tracker::flock::status::{UnitStatus, flying};
use crate::tracker::packed::PHASE;
use crate::tracker::session::TrackerSession;

/// Device family, as it is named in events.
pub const FAMILY: &str = "Flock of Birds";
/// Wait after [`POINT`] while old input is thrown away, ns: two birds' records at 9600 bit/s.
const DRAIN_NS: u64 = 150_000_000;
/// Wait for an answer, ns.
const ANSWER_NS: u64 = 500_000_000;
/// Wait for an answer that not every firmware gives, ns.
const TRY_NS: u64 = 200_000_000;
/// Quiet before the bus is configured, and while group mode is taken on, ns.
const BEFORE_BUS_NS: u64 = 300_000_000;
/// Quiet after the bus is configured, ns.
const AFTER_BUS_NS: u64 = 600_000_000;
/// How long RTS is raised for a reset, ns.
const RESET_NS: u64 = 1_000_000_000;
/// How long a unit takes to start, ns.
const STARTING_NS: u64 = 2_000_000_000;
/// Time between questions to a unit that is busy with its reset, ns.
const PATIENT_NS: u64 = 1_000_000_000;
/// Such questions.
const N_PATIENT: usize = 10;

/// A Flock of Birds as a state machine. **Emulated, not yet tried on hardware.**
pub type FlockSession = TrackerSession<FlockDialect>;

impl FlockSession {
    /// A session for a port that is not open yet.
    #[must_use]
    pub fn new(settings: FlockSettings) -> Self {
        Self::speaking(FlockDialect {
            settings,
            status: UnitStatus::default(),
            thorough: false,
            bus_configured: false,
        })
    }
}

/// What these units say and understand.
#[derive(Debug)]
pub struct FlockDialect {
    settings: FlockSettings,
    status: UnitStatus,
    /// Whether this start-up undoes modes that are seldom on, and configures the bus even if it seems to be.
    thorough: bool,
    /// Whether this start-up has configured the bus.
    bus_configured: bool,
}

impl FlockDialect {
    fn configure_bus(&mut self) -> Vec<Step> {
        self.bus_configured = true;
        vec![
            Step::Wait(BEFORE_BUS_NS),
            Step::Send(vec![CHANGE, AUTO_CONFIGURE, self.settings.n_units()]),
            Step::Wait(AFTER_BUS_NS),
            Step::Send(vec![CHANGE, GROUP_MODE, 1]),
            Step::Wait(BEFORE_BUS_NS),
            Step::ask(&[EXAMINE, BUS], ANSWER_NS),
        ]
    }

    /// What the bus status leads to: the commands to each bird, or the bus has to be configured first.
    fn take_bus(&mut self, bus: &[u8; N_ADDRESSES]) -> Answer {
        let flying = flying(bus);
        let missing = self
            .settings
            .birds
            .iter()
            .copied()
            .find(|bird| !flying.contains(bird));
        if !self.bus_configured && (missing.is_some() || self.thorough) {
            return Answer::Good(Answered {
                then: self.configure_bus(),
                ..Answered::default()
            });
        }
        let standing = missing.map(|bird| Fault::Reported {
            device: FAMILY,
            code: format!("bird {bird}"),
            meaning: "not on the bus, or without a sensor; check its address and its switch to fly",
        });
        match standing {
            Some(fault) if flying.is_empty() => Answer::Bad(fault),
            standing => Answer::Good(Answered {
                // All that fly, for one that is not used would send records of another length.
                then: flying
                    .into_iter()
                    .map(|bird| Step::Send(commands(&self.settings, Some(bird), self.thorough)))
                    .collect(),
                standing,
                ..Answered::default()
            }),
        }
    }
}

fn reported(code: u8) -> Answer {
    let fault = (code != 0).then(|| Fault::Reported {
        device: FAMILY,
        code: code.to_string(),
        meaning: error_meaning(code),
    });
    Answer::Good(Answered {
        reported: fault.into_iter().collect(),
        ..Answered::default()
    })
}

impl Dialect for FlockDialect {
    fn family(&self) -> &'static str {
        FAMILY
    }

    fn n_start_ups(&self) -> usize {
        3
    }

    fn start_up(&mut self, attempt: usize) -> Vec<Step> {
        self.thorough = attempt > 0;
        self.bus_configured = false;
        let low = Step::Port(PortRequest::SetRts(false));
        let stop = [Step::Send(vec![POINT]), Step::Wait(DRAIN_NS)];
        let crystal = [EXAMINE, CRYSTAL];
        let mut steps = match attempt {
            0 => vec![low],
            1 => vec![low, Step::Wait(STARTING_NS)],
            _ => vec![
                Step::Port(PortRequest::SetRts(true)),
                Step::Wait(RESET_NS),
                low,
                Step::Wait(STARTING_NS),
                Step::Send(vec![POINT, SLEEP]),
                Step::Wait(DRAIN_NS),
                Step::Send(vec![RUN]),
            ],
        };
        steps.extend(stop);
        if attempt < 2 {
            steps.push(Step::ask(&crystal, ANSWER_NS));
        } else {
            steps.extend(Step::ask_repeatedly(&crystal, PATIENT_NS, N_PATIENT));
        }
        steps.push(Step::try_asking(&[EXAMINE, ERROR], TRY_NS));
        if self.settings.group {
            steps.push(Step::Send(vec![CHANGE, GROUP_MODE, 1]));
            steps.push(Step::ask(&[EXAMINE, BUS], ANSWER_NS));
        } else {
            if self.thorough {
                steps.push(Step::Send(vec![CHANGE, GROUP_MODE, 0]));
            }
            steps.push(Step::Send(commands(&self.settings, None, self.thorough)));
        }
        steps.push(Step::Send(vec![EVERY_MEASUREMENT]));
        steps.extend(
            [RATE, FIRMWARE, MODEL]
                .map(|parameter| Step::try_asking(&[EXAMINE, parameter], TRY_NS)),
        );
        steps.push(Step::Send(vec![STREAM]));
        steps
    }

    fn answer(&mut self, question: &[u8], bytes: &[u8], _end: bool) -> Answer {
        let Some(&parameter) = question.get(1) else {
            return Answer::More;
        };
        // What was still on its way stands before the answer.
        let Some(tail) = answer_length(parameter)
            .and_then(|length| bytes.len().checked_sub(length))
            .map(|start| &bytes[start..])
        else {
            return Answer::More;
        };
        match (parameter, tail) {
            (CRYSTAL, &[low, high]) if !self.status.take_crystal([low, high]) => {
                return Answer::More;
            }
            (RATE, &[low, high]) => self.status.take_rate([low, high]),
            (FIRMWARE, &[low, high]) => self.status.take_firmware([low, high]),
            (MODEL, name) => self.status.take_model(name),
            (ERROR, &[code]) => return reported(code),
            (BUS, bus) => {
                if let Ok(bus) = bus.try_into() {
                    return self.take_bus(bus);
                }
            }
            _ => {}
        }
        Answer::Good(Answered::default())
    }

    fn judge(&mut self, bytes: &[u8], in_step: bool) -> Verdict {
        let format = self.settings.format();
        let length = format.length();
        match bytes.first() {
            None => return Verdict::More,
            Some(first) if first & PHASE == 0 => return Verdict::Skip,
            Some(_) => {}
        }
        // A byte was lost: the next record begins too soon.
        let rest = &bytes[1..bytes.len().min(length)];
        if rest.iter().any(|byte| byte & PHASE != 0) {
            return Verdict::Skip;
        }
        let Some((record, after)) = bytes.split_at_checked(length) else {
            return Verdict::More;
        };
        let Ok(mut record) = decode_record(record, &format) else {
            return Verdict::Skip;
        };
        match after.first() {
            None if !in_step => return Verdict::More,
            // Too long, so it is another record than the one that was asked for, or a byte came in between.
            Some(next) if next & PHASE == 0 => return Verdict::Skip,
            None | Some(_) => {}
        }
        if self.settings.invert_quaternion {
            record.rotation = record.rotation.map(|rotation| rotation.inverse());
        }
        Verdict::Record(length, record)
    }

    fn info(&self) -> DeviceInfo {
        DeviceInfo {
            family: FAMILY,
            firmware: self.status.firmware.clone(),
            identity: self.status.identity(),
            n_sensors: self.settings.birds.len(),
            hand: None,
            tick_ns: None,
            rate_hz: self
                .status
                .rate_hz()
                .map(|rate_hz| rate_hz * self.settings.birds.len() as f64),
        }
    }

    fn wants(&self, station: u16) -> bool {
        self.settings.has_station(station)
    }

    fn quiet(&self) -> &'static [u8] {
        &[POINT]
    }
}
