//! The clock of the world: a thread of its own that owns the [`World`](tsukamu_world::World) and steps it.
//!
//! It wakes for two things only: the time of the next step, and a [`Request`](crate::ticker::request::Request). It never waits for a
//! subscriber, a disk or a device.

/// Commands, checked and answered.
mod accepting;
/// The world with everything that enters and leaves it.
pub mod engine;
/// What enters the world in a step.
mod entering;
/// New epochs.
mod epoch;
/// What leaves the world after a step.
mod leaving;
/// Whether it lives.
pub mod pulse;
/// What others ask of it.
pub mod request;
/// When steps are due.
pub mod schedule;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError};
use std::time::Duration;

use crate::settings::Mode;
use engine::Engine;
use pulse::Pulse;
use request::{Refusal, Reply, Request, STEPS_MAX, Stepped};
use schedule::Schedule;

/// Step rate from which the thread spins for the last moments before a step, steps per second. Below it, the 50 to
/// 100 µs by which the system wakes a thread late are a small share of a step.
const SPIN_RATE_HZ: f64 = 500.0;
/// How long it spins then, nanoseconds.
const SPIN_NS: u64 = 60_000;
/// Time over which the step rate is measured, nanoseconds.
const MEASURE_NS: u64 = 1_000_000_000;
/// `Step` requests that wait for their turn, at most.
const STEPS_WAITING_MAX: usize = 64;

/// The tick thread.
#[derive(Debug)]
pub struct Ticker {
    engine: Engine,
    requests: Receiver<Request>,
    mode: Mode,
    /// `None` while the clock is stopped, and in lockstep.
    schedule: Option<Schedule>,
    /// Steps that were asked for, in lockstep.
    steps: VecDeque<(u32, Reply<Stepped>)>,
    /// Start of the present measurement, and steps since.
    measured: (u64, u64),
    pulse: Arc<Pulse>,
}

impl Ticker {
    /// A thread's work; the clock starts when it runs.
    pub fn new(mut engine: Engine, requests: Receiver<Request>, mode: Mode) -> Self {
        engine.set_mode(mode);
        Self {
            engine,
            requests,
            mode,
            schedule: None,
            steps: VecDeque::new(),
            measured: (0, 0),
            pulse: Arc::default(),
        }
    }

    /// What the thread will show of its life.
    pub fn pulse(&self) -> Arc<Pulse> {
        Arc::clone(&self.pulse)
    }

    /// Steps the world until it is told to stop.
    pub fn run(mut self) {
        self.start_clock();
        while self.turn() {}
        self.engine.finish();
    }

    /// One wait, then one step if it is time; false at the end.
    fn turn(&mut self) -> bool {
        if let Some(schedule) = self.schedule {
            return match self.wait_until(schedule.deadline_ns()) {
                Waited::Deadline => {
                    self.timed_step();
                    // Where steps take longer than their time nothing is waited for: requests get their turn here.
                    self.answer_one()
                }
                Waited::Request(request) => self.answer(request),
                Waited::Gone => false,
            };
        }
        if self.steps.is_empty() {
            return self
                .requests
                .recv()
                .is_ok_and(|request| self.answer(request));
        }
        self.asked_step();
        self.answer_one()
    }

    /// Answers a request that waits, if one does; false at the end.
    fn answer_one(&mut self) -> bool {
        match self.requests.try_recv() {
            Ok(request) => self.answer(request),
            Err(TryRecvError::Empty) => true,
            Err(TryRecvError::Disconnected) => false,
        }
    }

    fn timed_step(&mut self) {
        let now = self.engine.now_ns();
        let n_skipped = self
            .schedule
            .as_mut()
            .map_or(0, |schedule| schedule.advance(now));
        self.engine.note_overruns(n_skipped);
        let rate_hz = self.engine.rate_hz();
        self.engine.step();
        self.pulse.note_step();
        if self.engine.rate_hz() != rate_hz {
            // A playback came to an epoch of another rate.
            self.start_clock();
            return;
        }
        self.measured.1 += 1;
        let elapsed = now.saturating_sub(self.measured.0);
        if elapsed >= MEASURE_NS {
            self.engine
                .note_rate(self.measured.1 as f64 / (elapsed as f64 * 1.0e-9));
            self.measured = (now, 0);
        }
    }

    /// One of the steps that were asked for. Whoever goes away meanwhile needs no more of them.
    fn asked_step(&mut self) {
        while self
            .steps
            .front()
            .is_some_and(|(_, reply)| reply.is_closed())
        {
            self.steps.pop_front();
        }
        let Some((n_left, _)) = self.steps.front_mut() else {
            return;
        };
        if self.engine.step() {
            *n_left -= 1;
        }
        self.pulse.note_answer();
        if *n_left == 0
            && let Some((_, reply)) = self.steps.pop_front()
        {
            // Whoever asked may be gone.
            let _ = reply.send(Ok(self.engine.stepped()));
        }
    }

    /// Waits for a time or a request, whichever comes first. The channel's own timeout is the sleep.
    fn wait_until(&self, deadline_ns: u64) -> Waited {
        let spin_ns = if self.engine.rate_hz() >= SPIN_RATE_HZ {
            SPIN_NS
        } else {
            0
        };
        loop {
            let left = deadline_ns.saturating_sub(self.engine.now_ns());
            if left == 0 {
                return Waited::Deadline;
            }
            if left <= spin_ns {
                std::hint::spin_loop();
                continue;
            }
            match self
                .requests
                .recv_timeout(Duration::from_nanos(left - spin_ns))
            {
                Ok(request) => return Waited::Request(request),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Waited::Gone,
            }
        }
    }

    fn start_clock(&mut self) {
        let now = self.engine.now_ns();
        self.measured = (now, 0);
        self.schedule =
            (self.mode == Mode::Realtime).then(|| Schedule::new(now, self.engine.rate_hz()));
        self.pulse.set_timed(self.schedule.is_some());
    }

    /// Does what is asked; false when that is to end. Replies to whoever is gone are lost, as they should be.
    fn answer(&mut self, request: Request) -> bool {
        match request {
            Request::Stop => return false,
            Request::Pulse => {}
            Request::Step { n, reply } => self.queue_steps(n, reply),
            Request::Pause(reply) => {
                let _ = reply.send(self.pause());
            }
            Request::Resume(reply) => {
                let _ = reply.send(self.resume());
            }
            Request::Command { command, reply } => self.engine.accept_command(command, reply),
            Request::AddObject { spec, reply } => self.engine.accept_object(*spec, reply),
            Request::Load { plan, reply } => {
                self.engine.load(*plan);
                // The new scene may have another rate.
                if self.schedule.is_some() {
                    self.start_clock();
                }
                let _ = reply.send(Ok(self.engine.stamp()));
            }
            Request::OpenHand { hand, reply } => {
                let _ = reply.send(self.engine.open_hand(*hand));
            }
            Request::Record {
                recorder,
                name,
                beginning,
                reply,
            } => {
                let recorder = match self.mode {
                    Mode::Lockstep => recorder.patient(),
                    Mode::Realtime => recorder,
                };
                let _ = reply.send(self.engine.record(recorder, name, beginning));
            }
            Request::StopRecording(reply) => {
                let _ = reply.send(self.engine.stop_recording());
            }
        }
        self.pulse.note_answer();
        true
    }

    fn queue_steps(&mut self, n: u32, reply: Reply<Stepped>) {
        let refusal = if self.mode != Mode::Lockstep {
            Some(Refusal::NotLockstep)
        } else if !(1..=STEPS_MAX).contains(&n) {
            Some(Refusal::Steps(n))
        } else if self.steps.len() >= STEPS_WAITING_MAX {
            Some(Refusal::Busy)
        } else {
            None
        };
        match refusal {
            Some(refusal) => {
                let _ = reply.send(Err(refusal));
            }
            None => self.steps.push_back((n, reply)),
        }
    }

    fn pause(&mut self) -> Result<tsukamu_proto::v1::Stamp, Refusal> {
        if self.mode != Mode::Realtime {
            return Err(Refusal::NotRealtime);
        }
        self.schedule = None;
        self.pulse.set_timed(false);
        self.engine.set_paused(true);
        Ok(self.engine.stamp())
    }

    fn resume(&mut self) -> Result<tsukamu_proto::v1::Stamp, Refusal> {
        if self.mode != Mode::Realtime {
            return Err(Refusal::NotRealtime);
        }
        if self.schedule.is_none() {
            self.start_clock();
            self.engine.set_paused(false);
        }
        Ok(self.engine.stamp())
    }
}

/// What a wait ended with.
enum Waited {
    Deadline,
    Request(Request),
    Gone,
}
