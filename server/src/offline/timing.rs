//! How long steps take.

use std::time::Duration;

use serde::Serialize;

/// Times of steps, as they were measured around [`World::step`](tsukamu_world::World::step).
#[derive(Clone, Debug, Default)]
pub(super) struct StepTimes(Vec<u32>);

/// Median, 99th percentile and longest time of a step, in microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StepTimeUs {
    /// Half of the steps took no longer.
    pub p50: f64,
    /// 99 of 100 steps took no longer.
    pub p99: f64,
    /// The longest.
    pub max: f64,
}

impl StepTimes {
    pub(super) fn add(&mut self, time: Duration) {
        self.0
            .push(u32::try_from(time.as_nanos()).unwrap_or(u32::MAX));
    }

    /// Sum of all, in seconds.
    pub(super) fn total_s(&self) -> f64 {
        self.0.iter().map(|ns| f64::from(*ns)).sum::<f64>() * 1.0e-9
    }

    /// Nearest-rank percentiles; zeros without steps.
    pub(super) fn summary(mut self) -> StepTimeUs {
        self.0.sort_unstable();
        let at = |percent: usize| {
            let rank = (self.0.len() * percent).div_ceil(100).max(1);
            self.0
                .get(rank - 1)
                .map_or(0.0, |ns| f64::from(*ns) * 1.0e-3)
        };
        StepTimeUs {
            p50: at(50),
            p99: at(99),
            max: at(100),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_of_the_nearest_rank() {
        let mut times = StepTimes::default();
        (1..=200)
            .rev()
            .for_each(|us| times.add(Duration::from_micros(us)));
        assert!((times.total_s() - 0.0201).abs() < 1.0e-12);
        assert_eq!(
            times.summary(),
            StepTimeUs {
                p50: 100.0,
                p99: 198.0,
                max: 200.0
            }
        );
        assert_eq!(StepTimes::default().summary(), StepTimeUs::default());
    }
}
