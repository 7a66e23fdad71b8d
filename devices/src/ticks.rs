//! Device counters that wrap, made into ones that do not.

/// Unwraps a counter of 32 bits.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Unwrapped {
    last: Option<u32>,
    turns: u64,
}

impl Unwrapped {
    /// The counter as if it had 64 bits. A small step back (a record out of order, a counter set anew) is no turn.
    pub(crate) fn unwrap(&mut self, ticks: u32) -> u64 {
        if let Some(last) = self.last
            && last > ticks
            && last - ticks > u32::MAX / 2
        {
            self.turns += 1;
        }
        self.last = Some(ticks);
        (self.turns << 32) | u64::from(ticks)
    }
}

#[cfg(test)]
mod tests {
    use super::Unwrapped;

    #[test]
    fn a_turn_goes_on_and_a_step_back_is_none() {
        let mut unwrapped = Unwrapped::default();
        let given = [u32::MAX - 1, u32::MAX, 0, 5, 3, 7];
        let expected = [0, 1, 2, 7, 5, 9].map(|ticks: u64| ticks + u64::from(u32::MAX) - 1);
        assert_eq!(given.map(|ticks| unwrapped.unwrap(ticks)), expected);
    }
}
