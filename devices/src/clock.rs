//! The one place of this crate, outside waiting, that asks what time it is.

use std::time::Instant;

/// Monotonic time as ns since an origin that all sources of a program share.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    origin: Instant,
}

impl Clock {
    /// A clock that counts from `origin`.
    #[must_use]
    pub const fn new(origin: Instant) -> Self {
        Self { origin }
    }

    /// The present time, ns; 0 before the origin.
    #[must_use]
    pub fn now_ns(&self) -> u64 {
        // 584 years fit.
        self.origin.elapsed().as_nanos() as u64
    }
}
