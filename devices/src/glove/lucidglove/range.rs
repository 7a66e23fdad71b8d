//! How far a glove's numbers go, which it does not say.

use crate::glove::lucidglove::decode::Sample;
use crate::glove::lucidglove::protocol::{MAX_10_BITS, MAX_12_BITS};

/// Lines in a row beyond the set maximum after which the setting is called wrong.
const WRONG_AFTER: u32 = 3;

/// What is thought of a line's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// They fit.
    Fits,
    /// They fit from now on: the range was found to be greater.
    Raised,
    /// They do not fit; perhaps a byte was spoilt.
    Doubtful,
}

/// The greatest number, and how sure that is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Range {
    max: u16,
    is_fixed: bool,
    /// Lines in a row beyond it.
    n_beyond: u32,
}

impl Range {
    pub(super) fn new(fixed: Option<u16>) -> Self {
        Self {
            max: fixed.unwrap_or(MAX_10_BITS).max(1),
            is_fixed: fixed.is_some(),
            n_beyond: 0,
        }
    }

    pub(super) const fn max(&self) -> u16 {
        self.max
    }

    /// Whether the glove keeps going beyond the maximum that the settings give it.
    pub(super) const fn is_set_wrong(&self) -> bool {
        self.is_fixed && self.n_beyond >= WRONG_AFTER
    }

    /// A board of 12 bits shows itself by the first number above 1023, which its resting stick already is; one line
    /// alone is not believed. Where the settings say the maximum, what is beyond is left to be clamped.
    pub(super) fn judge(&mut self, sample: &Sample) -> Verdict {
        let greatest = greatest(sample);
        if greatest <= self.max {
            self.n_beyond = 0;
            return Verdict::Fits;
        }
        if self.is_fixed {
            self.n_beyond = self.n_beyond.saturating_add(1);
            return Verdict::Fits;
        }
        if greatest > MAX_12_BITS {
            return Verdict::Doubtful;
        }
        self.n_beyond += 1;
        if self.n_beyond < 2 {
            return Verdict::Doubtful;
        }
        self.max = MAX_12_BITS;
        self.n_beyond = 0;
        Verdict::Raised
    }
}

/// The greatest number of a sample but for the trigger, which may be one more than the range.
fn greatest(sample: &Sample) -> u16 {
    let joints = sample.joints.iter().flatten();
    let all = sample.curls.iter().chain(joints);
    let all = all.chain(&sample.splays).chain(&sample.stick);
    all.flatten().copied().max().unwrap_or(0)
}
