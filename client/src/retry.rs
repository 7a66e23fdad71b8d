use std::time::Duration;

/// How often to try again, and how long to wait in between: each delay is twice the one before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RetryPolicy {
    /// Attempts before giving up, at least 1.
    pub attempts: u32,
    /// Before the second attempt.
    pub first_delay: Duration,
    /// The longest delay.
    pub max_delay: Duration,
}

impl Default for RetryPolicy {
    /// Ten attempts within about twelve seconds.
    fn default() -> Self {
        Self {
            attempts: 10,
            first_delay: Duration::from_millis(100),
            max_delay: Duration::from_secs(2),
        }
    }
}

impl RetryPolicy {
    /// One attempt.
    pub const ONCE: Self = Self {
        attempts: 1,
        first_delay: Duration::ZERO,
        max_delay: Duration::ZERO,
    };

    /// Attempts for about that long: the least number of them whose delays add up to it.
    pub fn lasting(duration: Duration) -> Self {
        let mut retry = Self {
            attempts: 1,
            ..Self::default()
        };
        let mut total = Duration::ZERO;
        while total < duration && retry.attempts < 1_000_000 {
            retry.attempts += 1;
            total += retry
                .delay_after(retry.attempts - 1)
                .unwrap_or(retry.max_delay);
        }
        retry
    }

    /// The wait after that many failed attempts, or `None` when it is time to give up.
    pub fn delay_after(&self, n_failed: u32) -> Option<Duration> {
        if n_failed >= self.attempts.max(1) {
            return None;
        }
        let doublings = n_failed.saturating_sub(1).min(31);
        Some(
            self.first_delay
                .saturating_mul(1 << doublings)
                .min(self.max_delay),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_double_up_to_a_bound() {
        let retry = RetryPolicy {
            attempts: 5,
            first_delay: Duration::from_millis(100),
            max_delay: Duration::from_millis(350),
        };
        let delays: Vec<_> = (1..=5)
            .map(|n| retry.delay_after(n).map(|delay| delay.as_millis()))
            .collect();
        assert_eq!(delays, [Some(100), Some(200), Some(350), Some(350), None]);
        assert_eq!(RetryPolicy::ONCE.delay_after(1), None);
        assert_eq!(RetryPolicy::lasting(Duration::ZERO).attempts, 1);
        // 0.1 + 0.2 + 0.4 + 0.8 + 1.6 = 3.1 s is the first sum past 3 s.
        assert_eq!(RetryPolicy::lasting(Duration::from_secs(3)).attempts, 6);
        assert_eq!(
            RetryPolicy {
                attempts: u32::MAX,
                ..retry
            }
            .delay_after(4_000_000),
            Some(retry.max_delay)
        );
    }
}
