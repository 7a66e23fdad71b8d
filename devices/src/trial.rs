//! One device tried for a few seconds: what it says, how fast, and with which bytes. For help, never in a running daemon.

use std::collections::VecDeque;
use std::io;
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use crate::clock::Clock;
use crate::fault::Fault;
use crate::network::{LinkSettings, spawn};
use crate::port::{Direction, PortEvent};
use crate::session::{DeviceEvent, DeviceInfo, Session, SessionState, SessionStats};

/// Bytes that are kept, of those that came last.
const LAST_BYTES: usize = 64;
/// Things that may wait for the trial, which does nothing but take them.
const QUEUE: usize = 4096;

/// How long a device is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Longest time of all.
    pub time: Duration,
    /// Readings after which it is known well enough.
    pub readings: u64,
    /// Whether a session that has found nothing in one round of its start-up may go on until the time is over.
    pub patient: bool,
}

/// What came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The last state.
    pub state: SessionState,
    /// Whether the place could be opened.
    pub opened: bool,
    /// What was wrong last, if anything was.
    pub fault: Option<Fault>,
    /// What the device said about itself.
    pub info: Option<DeviceInfo>,
    /// The session's counters.
    pub stats: SessionStats,
    /// Readings that came.
    pub readings: u64,
    /// Readings per second between the first and the last; 0 with fewer than two.
    pub rate_hz: f64,
    /// Readings of which at least one sensor was held at the end of its range.
    pub clamped: u64,
    /// The bytes that came last, at most 64.
    pub last_bytes: Vec<u8>,
}

impl Trial {
    /// Whether readings came.
    #[must_use]
    pub const fn is_well(&self) -> bool {
        matches!(self.state, SessionState::Running) && self.readings > 0
    }
}

enum News {
    Device(Box<DeviceEvent>),
    Stats(SessionStats),
    Bytes(Vec<u8>),
}

/// Runs a session until it is known well enough, or has given up, or the time is over; then closes the place.
///
/// # Errors
/// When the system refuses a thread.
pub fn run(
    mut settings: LinkSettings,
    session: Box<dyn Session + Send>,
    limits: Limits,
) -> io::Result<Trial> {
    settings.raw = true;
    let (sender, news) = sync_channel(QUEUE);
    let start = Instant::now();
    let deliver = move |event: PortEvent<'_>| pass_on(&sender, event);
    let thread = spawn(settings, session, Clock::new(start), deliver)?;
    let mut watch = Watch::default();
    while !watch.is_done(limits) {
        let left = limits.time.saturating_sub(start.elapsed());
        match news.recv_timeout(left) {
            Ok(news) => watch.take(news),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => break,
        }
    }
    thread.stop();
    // The last counters come when the place is closed.
    while let Ok(last) = news.try_recv() {
        if let News::Stats(stats) = last {
            watch.stats = stats;
        }
    }
    Ok(watch.into_trial())
}

/// A full queue loses readings, and the trial is over by then.
fn pass_on(sender: &SyncSender<News>, event: PortEvent<'_>) {
    let _ = sender.try_send(match event {
        PortEvent::Device(event) => News::Device(Box::new(event)),
        PortEvent::Stats(stats) => News::Stats(stats),
        PortEvent::Raw {
            direction: Direction::Received,
            bytes,
            ..
        } => News::Bytes(bytes.to_vec()),
        PortEvent::Raw { .. } => return,
    });
}

#[derive(Default)]
struct Watch {
    state: Option<SessionState>,
    opened: bool,
    fault: Option<Fault>,
    info: Option<DeviceInfo>,
    stats: SessionStats,
    readings: u64,
    clamped: u64,
    first_ns: Option<u64>,
    last_ns: u64,
    has_given_up: bool,
    last_bytes: VecDeque<u8>,
}

impl Watch {
    fn is_done(&self, limits: Limits) -> bool {
        let is_known =
            self.state == Some(SessionState::Running) && self.readings >= limits.readings;
        is_known || (self.has_given_up && !limits.patient)
    }

    fn take(&mut self, news: News) {
        match news {
            News::Bytes(bytes) => {
                self.last_bytes.extend(bytes);
                let n_surplus = self.last_bytes.len().saturating_sub(LAST_BYTES);
                self.last_bytes.drain(..n_surplus);
            }
            News::Stats(stats) => self.stats = stats,
            News::Device(event) => self.take_event(*event),
        }
    }

    fn take_event(&mut self, event: DeviceEvent) {
        match event {
            DeviceEvent::Identified(info) => self.info = Some(info),
            DeviceEvent::State(change) => {
                // Also a session that asks for the port to be opened again has come to its end.
                self.has_given_up |= change.state == SessionState::Absent;
                self.opened |=
                    !matches!(change.state, SessionState::Absent | SessionState::Opening);
                self.state = Some(change.state);
                // Why it stalled stays told while it is tried again.
                if change.fault.is_some() || change.state == SessionState::Running {
                    self.fault = change.fault;
                }
            }
            DeviceEvent::Glove(reading) => {
                let is_clamped = reading
                    .sensors
                    .iter()
                    .flatten()
                    .any(|sensor| sensor.clamped);
                self.clamped += u64::from(is_clamped);
                self.count(reading.stamp_ns);
            }
            DeviceEvent::Tracker(reading) => self.count(reading.stamp_ns),
        }
    }

    fn count(&mut self, stamp_ns: u64) {
        self.readings += 1;
        self.first_ns.get_or_insert(stamp_ns);
        self.last_ns = stamp_ns;
    }

    fn into_trial(self) -> Trial {
        let time_ns = self.last_ns.saturating_sub(self.first_ns.unwrap_or(0));
        let intervals = self.readings.saturating_sub(1) as f64;
        Trial {
            state: self.state.unwrap_or(SessionState::Opening),
            opened: self.opened,
            fault: self.fault,
            info: self.info,
            stats: self.stats,
            readings: self.readings,
            rate_hz: if time_ns == 0 {
                0.0
            } else {
                intervals * 1.0e9 / time_ns as f64
            },
            clamped: self.clamped,
            last_bytes: self.last_bytes.into(),
        }
    }
}
