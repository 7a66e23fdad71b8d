//! Rate, jitter, gaps and age of a stream of samples.

/// Seconds over which jitter and longest gap are looked for.
const WINDOW_S: usize = 10;
/// Nanoseconds per second.
const SECOND_NS: u64 = 1_000_000_000;
/// Upper bounds of the classes of gaps, nanoseconds. The usual periods (1, 4.2, 8.3, 10, 16.7, 20, 33 ms) lie well within
/// a class, so that a steady stream fills one and what goes wrong shows in those above it.
const GAP_BOUNDS_NS: [u64; N_BOUNDS] = [
    1_500_000,
    3_000_000,
    6_000_000,
    12_000_000,
    25_000_000,
    50_000_000,
    100_000_000,
    250_000_000,
    500_000_000,
    1_000_000_000,
    2_500_000_000,
    10_000_000_000,
];
const N_BOUNDS: usize = 12;

/// Measures when things arrive. Times are monotonic nanoseconds.
#[derive(Clone, Debug, Default)]
pub struct Meter {
    /// One entry per second, by second modulo the window.
    seconds: [Second; WINDOW_S],
    last_ns: Option<u64>,
    gaps: Gaps,
}

/// All gaps since the start, by their length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gaps {
    /// How many in each class; the last one has no bound.
    pub counts: [u64; N_BOUNDS + 1],
    /// All of them together, seconds.
    pub sum_s: f64,
}

impl Gaps {
    /// Upper bounds of all classes but the last, seconds.
    pub fn bounds_s() -> [f64; N_BOUNDS] {
        GAP_BOUNDS_NS.map(|bound_ns| bound_ns as f64 * 1.0e-9)
    }

    fn note(&mut self, gap_ns: u64) {
        let class = GAP_BOUNDS_NS.partition_point(|bound_ns| *bound_ns < gap_ns);
        self.counts[class] += 1;
        self.sum_s += gap_ns as f64 * 1.0e-9;
    }
}

/// What happened in one second.
#[derive(Clone, Copy, Debug, Default)]
struct Second {
    /// Which one, since the clock's start.
    index: u64,
    n_samples: u32,
    longest_gap_ns: u64,
    n_gaps: u32,
    /// Gaps and their squares, seconds.
    sum_s: f64,
    sum_squares_s2: f64,
}

impl Meter {
    /// Something arrived.
    pub fn note(&mut self, now_ns: u64) {
        let gap = self.last_ns.map(|last| now_ns.saturating_sub(last));
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
        let Some(gap_ns) = gap else { return };
        let gap_s = gap_ns as f64 * 1.0e-9;
        second.longest_gap_ns = second.longest_gap_ns.max(gap_ns);
        second.n_gaps += 1;
        second.sum_s += gap_s;
        second.sum_squares_s2 += gap_s * gap_s;
        self.gaps.note(gap_ns);
    }

    /// Samples per second, over the last whole second.
    pub fn rate_hz(&self, now_ns: u64) -> f64 {
        self.mean_rate_hz(now_ns, 1)
    }

    /// Samples per second, over the last whole seconds, at most nine.
    pub fn mean_rate_hz(&self, now_ns: u64, n_seconds: u64) -> f64 {
        let end = now_ns / SECOND_NS;
        let window = end.saturating_sub(n_seconds)..end;
        let samples = self
            .seconds
            .iter()
            .filter(|s| window.contains(&s.index))
            .map(|s| f64::from(s.n_samples));
        samples.sum::<f64>() / n_seconds.max(1) as f64
    }

    /// Standard deviation of the gaps of the last ten seconds, in seconds; 0 where there are none.
    pub fn jitter_s(&self, now_ns: u64) -> f64 {
        let (mut n, mut sum, mut squares) = (0_u32, 0.0, 0.0);
        for second in self.recent(now_ns) {
            n += second.n_gaps;
            sum += second.sum_s;
            squares += second.sum_squares_s2;
        }
        if n == 0 {
            return 0.0;
        }
        let mean = sum / f64::from(n);
        // Rounding may leave a little less than nothing.
        (squares / f64::from(n) - mean * mean).max(0.0).sqrt()
    }

    /// Longest gap in the last ten seconds, in seconds, the one that goes on now included.
    pub fn longest_gap_s(&self, now_ns: u64) -> f64 {
        let gaps = self.recent(now_ns).map(|s| s.longest_gap_ns);
        let present = self.last_ns.map_or(0, |last| now_ns.saturating_sub(last));
        gaps.max().unwrap_or(0).max(present) as f64 * 1.0e-9
    }

    /// Time since the last one, in seconds; negative when there was none.
    pub fn age_s(&self, now_ns: u64) -> f64 {
        self.last_ns
            .map_or(-1.0, |last| now_ns.saturating_sub(last) as f64 * 1.0e-9)
    }

    /// All gaps since the start.
    pub const fn gaps(&self) -> &Gaps {
        &self.gaps
    }

    fn recent(&self, now_ns: u64) -> impl Iterator<Item = &Second> {
        let oldest = (now_ns / SECOND_NS).saturating_sub(WINDOW_S as u64 - 1);
        self.seconds
            .iter()
            .filter(move |s| s.index >= oldest && s.n_samples > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(t: u64) -> u64 {
        t * 1_000_000
    }

    #[test]
    fn it_measures_a_steady_stream_and_its_gaps() {
        let mut meter = Meter::default();
        assert_eq!(meter.age_s(5), -1.0);
        (0..300)
            .filter(|k| *k < 210 || *k >= 250)
            .for_each(|k| meter.note(ms(k * 10)));
        assert_eq!(meter.rate_hz(ms(2050)), 100.0);
        assert_eq!(meter.rate_hz(ms(3050)), 60.0);
        assert_eq!(meter.mean_rate_hz(ms(3050), 2), 80.0);
        assert!((meter.longest_gap_s(ms(3050)) - 0.41).abs() < 1e-9);
        assert!((meter.age_s(ms(3050)) - 0.06).abs() < 1e-9);
        assert_eq!(meter.rate_hz(ms(60_000)), 0.0);
        assert!(
            (meter.longest_gap_s(ms(60_000)) - 57.01).abs() < 1e-9,
            "the silence counts"
        );
    }

    #[test]
    fn jitter_is_that_of_the_gaps() {
        let mut meter = Meter::default();
        assert_eq!(meter.jitter_s(0), 0.0);
        (0..500).for_each(|k| meter.note(ms(k * 10)));
        assert!(meter.jitter_s(ms(5000)) < 1e-9);
        // By turns 8 and 12 ms.
        (0..500).for_each(|k| meter.note(ms(20_000 + k * 10 + k % 2 * 2)));
        let jitter_s = meter.jitter_s(ms(30_500));
        assert!((jitter_s - 0.002).abs() < 1e-5, "{jitter_s}");
        assert_eq!(meter.jitter_s(ms(60_000)), 0.0);
    }

    #[test]
    fn every_gap_is_in_one_class() {
        let mut meter = Meter::default();
        let arrivals_ms = [0, 10, 20, 20, 45, 30_045];
        arrivals_ms.into_iter().for_each(|at| meter.note(ms(at)));
        let gaps = meter.gaps();
        let expected = [(0, 1), (3, 2), (4, 1), (12, 1)];
        for (class, count) in gaps.counts.iter().enumerate() {
            let found = expected.iter().find(|(at, _)| *at == class);
            assert_eq!(*count, found.map_or(0, |(_, n)| *n), "class {class}");
        }
        assert!((gaps.sum_s - 30.045).abs() < 1e-9);
        let bounds_s = Gaps::bounds_s();
        assert!(bounds_s.is_sorted() && bounds_s.len() + 1 == gaps.counts.len());
    }
}
