//! The daemon's time: one monotonic origin, and the wall time that belongs to it.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Reads the time. Copies share one origin.
///
/// Wall time is taken once, at the start, and goes on with the monotonic clock: it never jumps, so differences between
/// stamps of one daemon are durations.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    origin: Instant,
    wall_at_origin_ns: u64,
}

impl Clock {
    /// A clock that starts now.
    pub fn start() -> Self {
        let since_unix = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or(Duration::ZERO);
        Self {
            origin: Instant::now(),
            wall_at_origin_ns: nanoseconds(since_unix),
        }
    }

    /// Nanoseconds since the clock was started.
    pub fn monotonic_ns(&self) -> u64 {
        nanoseconds(self.origin.elapsed())
    }

    /// Nanoseconds since the Unix epoch.
    pub fn wall_ns(&self) -> u64 {
        self.wall_at_origin_ns + self.monotonic_ns()
    }

    /// The wall time of a monotonic stamp of this clock.
    pub const fn wall_of(&self, monotonic_ns: u64) -> u64 {
        self.wall_at_origin_ns + monotonic_ns
    }

    /// The instant at which the clock was started; for those who share its stamps.
    pub const fn origin(&self) -> Instant {
        self.origin
    }
}

/// A duration in whole nanoseconds; 584 years at most.
fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
