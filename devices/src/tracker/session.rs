//! The conversation that all trackers on a serial line have in common; what differs is a [`Dialect`].
//!
//! ```text
//!  Closed -> Waiting <-> Asking (the steps of a start-up, ever stronger) -> Running
//!               ^           | silent, refused                                  | silence, garbage
//!               +-----------+--------------------------------------------------+
//! ```

use std::collections::VecDeque;

use crate::buffer::StampedBuffer;
use crate::core::Core;
use crate::fault::{Fault, hex};
use crate::reading::TrackerReading;
use crate::session::{DeviceEvent, DeviceInfo, PortRequest, Session, SessionState};
use crate::ticks::Unwrapped;
use crate::tracker::dialect::{Answer, Answered, Dialect, QUIET_NS, Step, TrackerRecord, Verdict};
use crate::tracker::space::TrackerSpace;

/// Stations that a session keeps apart.
pub const MAX_STATIONS: usize = 16;
/// Silence after which a tracker that streams counts as stalled, ns.
pub const SILENCE_NS: u64 = 2_000_000_000;
/// Bad bytes, without a good record between them, after which the tracker is set up anew.
const MAX_BAD_BYTES: u64 = 2_000;
/// First bytes kept for a message.
const N_FIRST_BYTES: usize = 64;

#[derive(Debug, Clone, PartialEq, Eq)]
enum Stage {
    Closed,
    /// What comes is thrown away.
    Waiting,
    Asking {
        question: Vec<u8>,
        needed: bool,
        end_ns: u64,
    },
    Running,
}

/// A tracker as a state machine. **Emulated, not yet tried on hardware.**
#[derive(Debug)]
pub struct TrackerSession<D> {
    dialect: D,
    core: Core,
    buffer: StampedBuffer,
    in_step: bool,
    stage: Stage,
    steps: VecDeque<Step>,
    attempt: usize,
    deadline_ns: Option<u64>,
    sequences: [u64; MAX_STATIONS],
    ticks: Unwrapped,
    bad_bytes: u64,
    first_bytes: Vec<u8>,
    /// Whether the tracker ever answered a question that it had to.
    answered: bool,
    /// Openings of the port since it last did.
    silent_openings: usize,
    /// Start-ups in a row that led to no record.
    fruitless: usize,
    standing: Option<Fault>,
    /// What was last reported about the tracker.
    told: Option<DeviceInfo>,
}

impl<D: Dialect> TrackerSession<D> {
    pub(crate) fn speaking(dialect: D) -> Self {
        Self {
            dialect,
            core: Core::new(),
            buffer: StampedBuffer::default(),
            in_step: false,
            stage: Stage::Closed,
            steps: VecDeque::new(),
            attempt: 0,
            deadline_ns: None,
            sequences: [0; MAX_STATIONS],
            ticks: Unwrapped::default(),
            bad_bytes: 0,
            first_bytes: Vec::new(),
            answered: false,
            silent_openings: 0,
            fruitless: 0,
            standing: None,
            told: None,
        }
    }

    fn begin(&mut self, now_ns: u64, attempt: usize) {
        self.attempt = attempt.min(self.dialect.n_start_ups() - 1);
        self.steps = self.dialect.start_up(self.attempt).into();
        self.standing = None;
        self.ticks = Unwrapped::default();
        self.core
            .enter(now_ns, SessionState::Resetting, self.core.fault.clone());
        self.advance(now_ns);
    }

    /// Takes steps until one has to be waited for.
    fn advance(&mut self, now_ns: u64) {
        self.buffer.clear();
        self.in_step = false;
        while let Some(step) = self.steps.pop_front() {
            match step {
                Step::Send(bytes) => self.core.send(bytes),
                Step::Port(request) => self.core.request(request),
                Step::Wait(wait_ns) => {
                    self.stage = Stage::Waiting;
                    self.deadline_ns = Some(now_ns + wait_ns);
                    return;
                }
                Step::Ask {
                    question,
                    wait_ns,
                    needed,
                } => {
                    self.core.send(question.as_slice());
                    let end_ns = now_ns + wait_ns;
                    self.stage = Stage::Asking {
                        question,
                        needed,
                        end_ns,
                    };
                    self.deadline_ns = Some(end_ns);
                    self.core
                        .enter(now_ns, SessionState::Querying, self.core.fault.clone());
                    return;
                }
            }
        }
        self.stage = Stage::Running;
        self.bad_bytes = 0;
        self.deadline_ns = Some(now_ns + SILENCE_NS);
        self.introduce();
    }

    /// Says what the tracker is, unless that has been said.
    fn introduce(&mut self) {
        let info = self.dialect.info();
        if self.told.as_ref() != Some(&info) {
            self.told = Some(info.clone());
            self.core.emit(DeviceEvent::Identified(info));
        }
    }

    /// Judges what came after a question; at the `end` of the wait for the last time.
    fn hear(&mut self, now_ns: u64, end: bool) {
        let Stage::Asking {
            question,
            needed,
            end_ns,
        } = &self.stage
        else {
            return;
        };
        let (needed, end_ns) = (*needed, *end_ns);
        match self.dialect.answer(question, self.buffer.as_slice(), end) {
            Answer::Good(answered) => self.go_on(now_ns, answered),
            Answer::Bad(fault) => self.stall(now_ns, fault),
            Answer::Perhaps if !end => self.deadline_ns = Some(end_ns.min(now_ns + QUIET_NS)),
            Answer::More if !end => self.deadline_ns = Some(end_ns),
            Answer::More | Answer::Perhaps if needed => self.no_answer(now_ns),
            Answer::More | Answer::Perhaps => self.advance(now_ns),
        }
    }

    fn go_on(&mut self, now_ns: u64, answered: Answered) {
        self.answered = true;
        self.silent_openings = 0;
        if let Stage::Asking {
            question: asked, ..
        } = &self.stage
        {
            // What was to be asked again has been answered.
            while matches!(self.steps.front(), Some(Step::Ask { question, .. }) if question == asked)
            {
                self.steps.pop_front();
            }
        }
        for step in answered.then.into_iter().rev() {
            self.steps.push_front(step);
        }
        self.standing = answered.standing.or_else(|| self.standing.take());
        for fault in answered.reported {
            self.report(now_ns, fault);
        }
        self.advance(now_ns);
    }

    /// An error that the tracker itself names.
    fn report(&mut self, now_ns: u64, fault: Fault) {
        self.core.stats.device_errors += 1;
        self.core.enter(now_ns, self.core.state, Some(fault));
    }

    /// A stronger start-up, or the port again.
    fn no_answer(&mut self, now_ns: u64) {
        let device = self.dialect.family();
        let fault = if self.first_bytes.is_empty() {
            Fault::Silent { device }
        } else {
            let first_bytes = hex(&self.first_bytes);
            Fault::NotThisDevice {
                device,
                first_bytes,
            }
        };
        self.core.stats.restarts += 1;
        self.core.enter(now_ns, SessionState::Stalled, Some(fault));
        let last = self
            .dialect
            .last_start_up(self.silent_openings, self.answered);
        if self.attempt < last {
            self.begin(now_ns, self.attempt + 1);
        } else {
            self.silent_openings = self.silent_openings.saturating_add(1);
            self.core.request(PortRequest::Reopen);
            self.close();
        }
    }

    fn stall(&mut self, now_ns: u64, fault: Fault) {
        self.core.enter(now_ns, SessionState::Stalled, Some(fault));
        self.core.stats.restarts += 1;
        self.first_bytes.clear();
        let attempt = self.fruitless;
        self.fruitless = self.fruitless.saturating_add(1);
        self.begin(now_ns, attempt);
    }

    fn close(&mut self) {
        self.stage = Stage::Closed;
        self.deadline_ns = None;
        self.steps.clear();
    }

    /// Takes whole records from the front of the stream.
    fn run(&mut self, now_ns: u64) {
        let mut n_skipped = 0;
        while self.stage == Stage::Running {
            let in_step = self.in_step && n_skipped == 0;
            let verdict = self.dialect.judge(self.buffer.as_slice(), in_step);
            if matches!(verdict, Verdict::Skip) && !self.buffer.as_slice().is_empty() {
                self.buffer.consume(1);
                n_skipped += 1;
                continue;
            }
            if n_skipped > 0 {
                self.reject(now_ns, std::mem::take(&mut n_skipped));
                continue;
            }
            match verdict {
                Verdict::Record(length, record) => {
                    let stamp_ns = self.buffer.stamp_ns(length.saturating_sub(1));
                    self.buffer.consume(length);
                    self.in_step = true;
                    self.accept(stamp_ns, &record);
                }
                Verdict::Other(length) => self.buffer.consume(length.max(1)),
                Verdict::Report(length, fault) => {
                    self.buffer.consume(length.max(1));
                    self.report(now_ns, fault);
                }
                Verdict::More | Verdict::Skip => return,
            }
        }
    }

    fn accept(&mut self, stamp_ns: u64, record: &TrackerRecord) {
        self.core.stats.records += 1;
        self.bad_bytes = 0;
        self.fruitless = 0;
        self.deadline_ns = Some(stamp_ns + SILENCE_NS);
        if self.core.state != SessionState::Running {
            // The first record may tell more than the answers did.
            self.introduce();
        }
        self.core
            .enter(stamp_ns, SessionState::Running, self.standing.clone());
        self.core.stats.device_errors += u64::from(!record.usable);
        let index = usize::from(record.station).wrapping_sub(1);
        let Some(sequence) = self.sequences.get_mut(index) else {
            return;
        };
        if !self.dialect.wants(record.station) {
            return;
        }
        self.core.emit(DeviceEvent::Tracker(TrackerReading {
            stamp_ns,
            sequence: *sequence,
            station: record.station,
            space: TrackerSpace::ZDown,
            position: record.position,
            rotation: record.rotation,
            position_valid: record.usable && record.position.is_some(),
            rotation_valid: record.usable && record.rotation.is_some(),
            error: record.error,
            device_ticks: record.ticks.map(|ticks| self.ticks.unwrap(ticks)),
            stylus_pressed: record.pressed,
        }));
        *sequence += 1;
    }

    fn reject(&mut self, now_ns: u64, n_bytes: u64) {
        self.core.stats.resyncs += u64::from(self.in_step);
        self.core.stats.dropped_records += u64::from(self.in_step);
        self.in_step = false;
        self.bad_bytes += n_bytes;
        if self.bad_bytes > MAX_BAD_BYTES {
            let fault = Fault::Garbled {
                device: self.dialect.family(),
                first_bytes: hex(&self.first_bytes),
            };
            self.stall(now_ns, fault);
        }
    }
}

impl<D: Dialect> Session for TrackerSession<D> {
    fn core(&self) -> &Core {
        &self.core
    }

    fn core_mut(&mut self) -> &mut Core {
        &mut self.core
    }

    fn port_opened(&mut self, now_ns: u64) {
        self.core.forget_port();
        self.first_bytes.clear();
        self.core.fault =
            self.core.fault.take().filter(|fault| {
                matches!(fault, Fault::Silent { .. } | Fault::NotThisDevice { .. })
            });
        self.begin(now_ns, 0);
    }

    fn port_lost(&mut self, now_ns: u64, fault: Fault) {
        self.buffer.clear();
        self.core.forget_port();
        self.close();
        self.core.enter(now_ns, SessionState::Absent, Some(fault));
    }

    fn push(&mut self, stamp_ns: u64, bytes: &[u8]) {
        self.core.stats.bytes += bytes.len() as u64;
        let room = N_FIRST_BYTES.saturating_sub(self.first_bytes.len());
        self.first_bytes
            .extend_from_slice(&bytes[..bytes.len().min(room)]);
        for part in bytes.chunks(512) {
            match self.stage {
                Stage::Closed | Stage::Waiting => return,
                Stage::Asking { .. } => {
                    self.buffer.push(stamp_ns, part);
                    self.hear(stamp_ns, false);
                }
                Stage::Running => {
                    self.buffer.push(stamp_ns, part);
                    self.run(stamp_ns);
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
            Stage::Waiting => self.advance(now_ns),
            Stage::Asking { .. } => self.hear(now_ns, true),
            Stage::Running => {
                let device = self.dialect.family();
                self.stall(now_ns, Fault::Silent { device });
            }
        }
    }

    fn farewell(&self) -> &'static [u8] {
        self.dialect.quiet()
    }
}
