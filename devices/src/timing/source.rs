//! All streams of one device, each stamped in the best way there is.

use super::Stamped;
use super::dejitter::DeJitter;
use super::fit::ClockFit;
use crate::glove::calibrate::Handedness;

/// Streams of one device that are told apart; what is beyond keeps its arrivals.
const STREAMS_MAX: usize = 256;

/// What of a device sends at a rhythm of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// A glove, by the hand that it says it is on.
    Glove(Option<Handedness>),
    /// A station of a tracker, from 1.
    Station(u16),
}

/// How samples get the time at which they were taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClockKind {
    /// From the device's own counter.
    Counter,
    /// From the rhythm of their arrivals.
    Even,
    /// They are their arrivals.
    Arrival,
}

impl ClockKind {
    /// The name on the wire and in messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Counter => "counter",
            Self::Even => "even",
            Self::Arrival => "arrival",
        }
    }
}

/// How well a device's samples are stamped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockReport {
    /// In which way.
    pub kind: ClockKind,
    /// How much faster the device's clock runs than the daemon's, parts per million; `None` where that is not known.
    pub drift_ppm: Option<f64>,
    /// How far a stamp may be off, s, beside the shortest time of arrival; `None` where that is not known.
    pub error_s: Option<f64>,
    /// Measured length of a tick of the counter, or time between two samples, s; `None` where that is not known.
    pub tick_s: Option<f64>,
    /// Times that the fit began anew.
    pub n_restarts: u64,
}

#[derive(Debug, Clone)]
struct StreamClock {
    stream: Stream,
    rhythm: DeJitter,
    /// The newest stamp, ns.
    last_ns: u64,
}

/// Stamps the readings of one device.
#[derive(Debug, Clone)]
pub struct SourceClock {
    counter: ClockFit,
    streams: Vec<StreamClock>,
    kind: ClockKind,
}

impl Default for SourceClock {
    fn default() -> Self {
        Self::new()
    }
}

impl SourceClock {
    /// One that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self {
            counter: ClockFit::new(None),
            streams: Vec::new(),
            kind: ClockKind::Arrival,
        }
    }

    /// The device said how long a tick of its counter is, ns; `None` where it did not.
    pub fn set_tick(&mut self, tick_ns: Option<f64>) {
        self.counter.set_tick(tick_ns);
    }

    /// The device was gone, or was started anew: its counter may begin anywhere.
    pub fn restart(&mut self) {
        self.counter.restart();
        for stream in &mut self.streams {
            stream.rhythm.restart();
        }
        self.kind = ClockKind::Arrival;
    }

    /// Stamps a reading of a stream that arrived at a monotonic time, ns. Stamps of a stream never fall.
    pub fn stamp(&mut self, stream: Stream, arrival_ns: u64, ticks: Option<u64>) -> Stamped {
        let on_arrival = Stamped {
            ticks,
            ..Stamped::on_arrival(arrival_ns)
        };
        let Some(index) = self.index(stream) else {
            return on_arrival;
        };
        let known = &mut self.streams[index];
        let (fitted_ns, kind) = match ticks {
            Some(ticks) => (self.counter.push(ticks, arrival_ns), ClockKind::Counter),
            None => (known.rhythm.push(arrival_ns), ClockKind::Even),
        };
        self.kind = fitted_ns.map_or(ClockKind::Arrival, |_| kind);
        // A line that was moved must not turn the order of samples round.
        let fitted_ns = fitted_ns
            .unwrap_or(arrival_ns)
            .max(known.last_ns.saturating_add(1))
            .min(arrival_ns);
        known.last_ns = fitted_ns;
        Stamped {
            fitted_ns,
            ..on_arrival
        }
    }

    /// How well it does.
    #[must_use]
    pub fn report(&self) -> ClockReport {
        let rhythm = self.streams.first().map(|stream| &stream.rhythm);
        let n_restarts = self.counter.n_restarts() + rhythm.map_or(0, DeJitter::n_restarts);
        let (drift_ppm, error_s, tick_s) = match self.kind {
            ClockKind::Counter => (
                self.counter.drift_ppm(),
                self.counter.error_s(),
                self.counter.tick_s(),
            ),
            ClockKind::Even => (
                None,
                rhythm.and_then(DeJitter::error_s),
                rhythm.and_then(DeJitter::period_s),
            ),
            ClockKind::Arrival => (None, None, None),
        };
        ClockReport {
            kind: self.kind,
            drift_ppm,
            error_s,
            tick_s,
            n_restarts,
        }
    }

    fn index(&mut self, stream: Stream) -> Option<usize> {
        let found = self.streams.iter().position(|known| known.stream == stream);
        if found.is_some() || self.streams.len() >= STREAMS_MAX {
            return found;
        }
        self.streams.push(StreamClock {
            stream,
            rhythm: DeJitter::new(),
            last_ns: 0,
        });
        Some(self.streams.len() - 1)
    }
}
