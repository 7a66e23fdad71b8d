use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// A steady clock that reads like the wall clock: nanoseconds since the Unix epoch at the moment it was made, and
/// monotonic from then on. All stamps of one client come from one such clock, so that their differences are times.
#[derive(Clone, Copy, Debug)]
pub struct ClientClock {
    origin: Instant,
    origin_unix_ns: u64,
}

impl ClientClock {
    /// Reads the wall clock once.
    pub fn start() -> Self {
        let since_epoch = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or(Duration::ZERO);
        Self {
            origin: Instant::now(),
            origin_unix_ns: nanoseconds(since_epoch),
        }
    }

    /// Now, in nanoseconds since the Unix epoch.
    pub fn now_ns(&self) -> u64 {
        self.origin_unix_ns
            .saturating_add(nanoseconds(self.origin.elapsed()))
    }

    /// Seconds since this clock was started.
    pub fn elapsed_s(&self) -> f64 {
        self.origin.elapsed().as_secs_f64()
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
