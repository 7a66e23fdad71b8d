use std::collections::VecDeque;

/// How far back the meter looks, nanoseconds.
const WINDOW_NS: u64 = 1_000_000_000;
/// Most frames in the window; above the highest step rate.
const CAPACITY: usize = 4096;
/// Time that one bar of the history stands for, nanoseconds.
const BAR_NS: u64 = 250_000_000;
/// Bars of the history.
const N_BARS: usize = 40;

/// Rate and latency of the frames that arrived in the last second, and the worst latency of each quarter of a second.
#[derive(Clone, Debug, Default)]
pub(super) struct Meter {
    /// Arrival and latency, nanoseconds.
    frames: VecDeque<(u64, f64)>,
    /// Start and worst latency of each bar, nanoseconds.
    bars: VecDeque<(u64, f64)>,
}

impl Meter {
    pub(super) fn push(&mut self, arrival_ns: u64, latency_ns: Option<f64>) {
        if self.frames.len() == CAPACITY {
            self.frames.pop_front();
        }
        self.frames
            .push_back((arrival_ns, latency_ns.unwrap_or(f64::NAN)));
        let Some(latency_ns) = latency_ns else { return };
        let bar_start = arrival_ns - arrival_ns % BAR_NS;
        match self.bars.back_mut() {
            Some((start, worst)) if *start == bar_start => *worst = worst.max(latency_ns),
            _ => {
                if self.bars.len() == N_BARS {
                    self.bars.pop_front();
                }
                self.bars.push_back((bar_start, latency_ns));
            }
        }
    }

    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Frames per second over the last second.
    pub(super) fn rate_hz(&mut self, now_ns: u64) -> f64 {
        self.forget(now_ns);
        let Some((first, _)) = self.frames.front() else {
            return 0.0;
        };
        // At the start the window is not full yet.
        let span_ns = now_ns.saturating_sub(*first).max(WINDOW_NS / 10);
        self.frames.len() as f64 / (span_ns as f64 * 1e-9)
    }

    /// Median and largest latency over the last second, nanoseconds.
    pub(super) fn latency_ns(&mut self, now_ns: u64) -> Option<(f64, f64)> {
        self.forget(now_ns);
        let mut latencies: Vec<f64> = self
            .frames
            .iter()
            .map(|frame| frame.1)
            .filter(|ns| ns.is_finite())
            .collect();
        latencies.sort_by(f64::total_cmp);
        Some((*latencies.get(latencies.len() / 2)?, *latencies.last()?))
    }

    /// Worst latencies, oldest first, nanoseconds.
    pub(super) fn history(&self) -> impl Iterator<Item = f64> {
        self.bars.iter().map(|bar| bar.1)
    }

    fn forget(&mut self, now_ns: u64) {
        while self
            .frames
            .front()
            .is_some_and(|frame| frame.0 + WINDOW_NS < now_ns)
        {
            self.frames.pop_front();
        }
    }
}

/// Values as a row of bars from 0 to the largest of them.
pub(super) fn sparkline(values: impl Iterator<Item = f64>) -> String {
    const LEVELS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let values: Vec<f64> = values.map(|value| value.max(0.0)).collect();
    let most = values.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    values
        .iter()
        .map(|value| LEVELS[((value / most * 7.0).round() as usize).min(7)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_second_counts() {
        let mut meter = Meter::default();
        for n in 0..200 {
            meter.push(10_000_000 * n, Some(1_000.0 * (n % 5) as f64));
        }
        assert!((meter.rate_hz(2_000_000_000) - 100.0).abs() < 1e-9);
        assert_eq!(meter.latency_ns(2_000_000_000), Some((2_000.0, 4_000.0)));
        assert_eq!(meter.history().count(), 8);
        assert_eq!(meter.rate_hz(9_000_000_000), 0.0);
        assert_eq!(meter.latency_ns(9_000_000_000), None);
    }

    #[test]
    fn it_is_bounded() {
        let mut meter = Meter::default();
        for n in 0..10_000 {
            meter.push(n, None);
        }
        assert_eq!(meter.frames.len(), CAPACITY);
        assert_eq!(meter.latency_ns(10_000), None);
    }

    #[test]
    fn sparklines() {
        assert_eq!(sparkline([0.0, 3.5, 7.0].into_iter()), "▁▅█");
        assert_eq!(sparkline([0.0, -1.0].into_iter()), "▁▁");
        assert_eq!(sparkline(std::iter::empty()), "");
    }
}
