//! What differs from one make of tracker to the next: the steps of its start-up, its answers and its records.

use nalgebra::{Point3, UnitQuaternion};

use crate::fault::Fault;
use crate::session::{DeviceInfo, PortRequest};

/// Silence after which an answer without an end counts as whole, ns.
pub const QUIET_NS: u64 = 60_000_000;

/// One step of a start-up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// Sends bytes.
    Send(Vec<u8>),
    /// Asks the owner of the port.
    Port(PortRequest),
    /// Throws away what comes for a time, ns.
    Wait(u64),
    /// Asks the tracker.
    Ask {
        /// The bytes that ask.
        question: Vec<u8>,
        /// How long to wait for the answer, ns.
        wait_ns: u64,
        /// Whether the start-up has failed without an answer.
        needed: bool,
    },
}

impl Step {
    /// A question that has to be answered.
    #[must_use]
    pub fn ask(question: &[u8], wait_ns: u64) -> Self {
        Self::Ask {
            question: question.to_vec(),
            wait_ns,
            needed: true,
        }
    }

    /// A question that may stay without an answer.
    #[must_use]
    pub fn try_asking(question: &[u8], wait_ns: u64) -> Self {
        Self::Ask {
            question: question.to_vec(),
            wait_ns,
            needed: false,
        }
    }

    /// The same question again and again, so that the end of a long reset is noticed soon; the first answer counts.
    pub fn ask_repeatedly(
        question: &[u8],
        wait_ns: u64,
        n_times: usize,
    ) -> impl Iterator<Item = Self> {
        (1..=n_times).map(move |time| {
            if time == n_times {
                Self::ask(question, wait_ns)
            } else {
                Self::try_asking(question, wait_ns)
            }
        })
    }
}

/// What an accepted answer leads to.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Answered {
    /// Steps that come before those that are left.
    pub then: Vec<Step>,
    /// Errors that the tracker reported with it; each is told once.
    pub reported: Vec<Fault>,
    /// What is wrong and stays so while records arrive.
    pub standing: Option<Fault>,
}

/// What a dialect makes of the bytes after a question.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer {
    /// More bytes are needed.
    More,
    /// It is whole if nothing more comes for [`QUIET_NS`].
    Perhaps,
    /// It is whole.
    Good(Answered),
    /// It is an answer, and says that the start-up cannot go on.
    Bad(Fault),
}

/// What a dialect makes of the bytes of a stream.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// A record of so many bytes.
    Record(usize, TrackerRecord),
    /// So many bytes that belong here and are no record, such as an answer to a command.
    Other(usize),
    /// So many bytes in which the tracker reports an error; it is told until the next record.
    Report(usize, Fault),
    /// More bytes are needed.
    More,
    /// The first byte does not begin anything.
    Skip,
}

/// One decoded record, in SI units and transmitter space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackerRecord {
    /// Station, from 1.
    pub station: u16,
    /// Position, m.
    pub position: Option<Point3<f64>>,
    /// Rotation that takes sensor coordinates to transmitter space.
    pub rotation: Option<UnitQuaternion<f64>>,
    /// The record's error letter; `None` when good.
    pub error: Option<char>,
    /// Whether position and rotation may be used in spite of the error letter.
    pub usable: bool,
    /// The tracker's own counter as it was sent.
    pub ticks: Option<u32>,
    /// A switch on the sensor.
    pub pressed: Option<bool>,
}

/// What one make of tracker says and understands.
pub trait Dialect {
    /// The family's name in messages.
    fn family(&self) -> &'static str;

    /// How many start-ups there are, each stronger than the one before.
    fn n_start_ups(&self) -> usize;

    /// The steps from whatever state the tracker is in to a stream of records. `attempt` is below
    /// [`Dialect::n_start_ups`].
    fn start_up(&mut self, attempt: usize) -> Vec<Step>;

    /// The last start-up before the port is opened anew, after so many openings in a row at which the tracker was silent.
    /// One that has never `answered` may have another line rate, so its port is opened anew soon; one that did is on the
    /// right line and more likely busy with its own reset.
    fn last_start_up(&self, silent_openings: usize, answered: bool) -> usize {
        let strongest = self.n_start_ups() - 1;
        if answered {
            strongest
        } else {
            strongest.min(silent_openings.saturating_add(1))
        }
    }

    /// Judges all bytes that came since a question was sent. At the `end` of the wait nothing more will come.
    fn answer(&mut self, question: &[u8], bytes: &[u8], end: bool) -> Answer;

    /// Judges the front of the stream. While not in step a record needs a sign that another one follows.
    fn judge(&mut self, bytes: &[u8], in_step: bool) -> Verdict;

    /// What is known of the tracker.
    fn info(&self) -> DeviceInfo;

    /// Whether the records of a station are wanted.
    fn wants(&self, station: u16) -> bool;

    /// The bytes that stop the stream.
    fn quiet(&self) -> &'static [u8];
}
