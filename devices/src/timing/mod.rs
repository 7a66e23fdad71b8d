//! When a sample was taken: from arrival times, and a device's own counter where it has one. Pure: times are arguments.
//!
//! [`source::SourceClock`] is the way in: it stamps each reading of a device, by its counter ([`fit::ClockFit`]) or, where
//! it has none, by the rhythm of its arrivals ([`dejitter::DeJitter`]).

pub mod source;

pub mod fit;

pub mod dejitter;

mod envelope;

/// The times of one reading. All are kept: a fit can be done anew from a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamped {
    /// When its last byte was read, monotonic ns.
    pub arrival_ns: u64,
    /// When the device sent it, as far as that can be told, monotonic ns; never later than the arrival. This is the time
    /// to interpolate, filter and join by.
    pub fitted_ns: u64,
    /// The device's own counter; `None` when it has none.
    pub ticks: Option<u64>,
}

impl Stamped {
    /// A reading of which nothing is known but its arrival.
    #[must_use]
    pub const fn on_arrival(arrival_ns: u64) -> Self {
        Self {
            arrival_ns,
            fitted_ns: arrival_ns,
            ticks: None,
        }
    }
}
