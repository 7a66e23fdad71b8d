//! Rate, longest gap and age of a stream of samples.

/// Seconds over which the longest gap is looked for.
const WINDOW_S: usize = 10;
/// Nanoseconds per second.
const SECOND_NS: u64 = 1_000_000_000;

/// Measures when things arrive. Times are monotonic nanoseconds.
#[derive(Clone, Debug, Default)]
pub struct Meter {
    /// One entry per second, by second modulo the window.
    seconds: [Second; WINDOW_S],
    last_ns: Option<u64>,
}

/// What happened in one second.
#[derive(Clone, Copy, Debug, Default)]
struct Second {
    /// Which one, since the clock's start.
    index: u64,
    n_samples: u32,
    longest_gap_ns: u64,
}

impl Meter {
    /// Something arrived.
    pub fn note(&mut self, now_ns: u64) {
        let gap = self.last_ns.map_or(0, |last| now_ns.saturating_sub(last));
        self.last_ns = Some(now_ns);
        let index = now_ns / SECOND_NS;
        let second = &mut self.seconds[index as usize % WINDOW_S];
        if second.index != index {
            *second = Second {
                index,
                ..Second::default()
            };
        }
        second.n_samples += 1;
        second.longest_gap_ns = second.longest_gap_ns.max(gap);
    }

    /// Samples per second, over the last whole second.
    pub fn rate_hz(&self, now_ns: u64) -> f64 {
        let last = (now_ns / SECOND_NS).saturating_sub(1);
        self.seconds
            .iter()
            .filter(|s| s.index == last)
            .map(|s| f64::from(s.n_samples))
            .sum()
    }

    /// Longest gap in the last ten seconds, in seconds, the one that goes on now included.
    pub fn longest_gap_s(&self, now_ns: u64) -> f64 {
        let oldest = (now_ns / SECOND_NS).saturating_sub(WINDOW_S as u64 - 1);
        let gaps = self
            .seconds
            .iter()
            .filter(|s| s.index >= oldest && s.n_samples > 0)
            .map(|s| s.longest_gap_ns);
        let present = self.last_ns.map_or(0, |last| now_ns.saturating_sub(last));
        gaps.max().unwrap_or(0).max(present) as f64 * 1.0e-9
    }

    /// Time since the last one, in seconds; negative when there was none.
    pub fn age_s(&self, now_ns: u64) -> f64 {
        self.last_ns
            .map_or(-1.0, |last| now_ns.saturating_sub(last) as f64 * 1.0e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_measures_a_steady_stream_and_its_gaps() {
        let mut meter = Meter::default();
        assert_eq!(meter.age_s(5), -1.0);
        let ms = |t: u64| t * 1_000_000;
        (0..300)
            .filter(|k| *k < 210 || *k >= 250)
            .for_each(|k| meter.note(ms(k * 10)));
        assert_eq!(meter.rate_hz(ms(2050)), 100.0);
        assert_eq!(meter.rate_hz(ms(3050)), 60.0);
        assert!((meter.longest_gap_s(ms(3050)) - 0.41).abs() < 1e-9);
        assert!((meter.age_s(ms(3050)) - 0.06).abs() < 1e-9);
        assert_eq!(meter.rate_hz(ms(60_000)), 0.0);
        assert!(
            (meter.longest_gap_s(ms(60_000)) - 57.01).abs() < 1e-9,
            "the silence counts"
        );
    }
}
