//! What the user may choose about a CyberGlove.

use crate::glove::cyberglove::protocol::{POLL, SILENCE_NS, STREAM};
use crate::glove::sensor::SensorMask;

/// How samples are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sampling {
    /// The glove sends by itself: lowest latency.
    #[default]
    Stream,
    /// Each sample is asked for; survives more firmware versions, at up to 100 Hz.
    Poll {
        /// Time between questions, ns.
        period_ns: u64,
    },
}

/// The two gloves there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorCount {
    /// Without the DIP joints of the four fingers.
    Eighteen,
    /// With them.
    TwentyTwo,
}

/// What the user may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct CyberGloveSettings {
    /// Sensors of the glove when its own answer is not to be believed (CyberGlove III); `None` to ask it.
    pub forced_sensors: Option<SensorCount>,
    /// How samples are asked for.
    pub sampling: Sampling,
    /// Sample rate in Hz, 0.01 to 1000; `None` to leave the glove's own.
    pub rate_hz: Option<f64>,
    /// The glove's own low-pass filter.
    pub filter: bool,
    /// The status byte in each record, which tells of an unplugged glove and of the wrist switch.
    pub status: bool,
}

impl Default for CyberGloveSettings {
    fn default() -> Self {
        Self {
            forced_sensors: None,
            sampling: Sampling::Stream,
            rate_hz: Some(100.0),
            filter: true,
            status: true,
        }
    }
}

impl CyberGloveSettings {
    pub(super) fn forced_mask(&self) -> Option<SensorMask> {
        self.forced_sensors.map(|count| match count {
            SensorCount::Eighteen => SensorMask::EIGHTEEN,
            SensorCount::TwentyTwo => SensorMask::TWENTY_TWO,
        })
    }

    pub(super) const fn letter(&self) -> u8 {
        match self.sampling {
            Sampling::Stream => STREAM,
            Sampling::Poll { .. } => POLL,
        }
    }

    /// Silence after which the glove counts as stalled, ns; longer for a slow rate.
    pub(super) fn silence_ns(&self) -> u64 {
        match self.sampling {
            Sampling::Stream => {
                let slow_ns = self.rate_hz.map_or(0.0, |rate_hz| 3e9 / rate_hz);
                // A float to integer cast saturates, and the least rate makes this 300 s.
                SILENCE_NS.max(slow_ns as u64)
            }
            Sampling::Poll { period_ns } => SILENCE_NS.max(period_ns.saturating_mul(10)),
        }
    }
}
