//! Where a stream will be a little later.
//!
//! Constant velocity, damped: `x(t + h) = x(t) + v T (1 - e^(-h/T))`, on the pose's or the joint angles' own space. The
//! velocity is the trend of a double exponential smoothing, which LaViola ("Double Exponential Smoothing: An Alternative to
//! Kalman Filter-Based Predictive Tracking", EGVE 2003) found to predict a hand as well as a Kalman filter does, for a
//! fraction of the work. Here it is in the form of a fading-memory filter, which takes samples at uneven times:
//!
//! ```text
//!   θ = e^(-Δt/M)     error = sample - (smoothed + v Δt)
//!   smoothed += v Δt + (1 - θ²) error      v += (1 - θ)² error / Δt
//! ```
//!
//! It is added to the newest sample itself: the smoothed value is quieter, but was further off on recorded hands at every
//! lead. Memory and damping were chosen by the error on recorded hands, which the tests of this module print.

use nalgebra::SVector;

use super::moving::Moving;

/// Longest prediction, in seconds.
pub const LEAD_MAX_S: f64 = 0.1;
/// Shortest time that a jump is told by, in seconds: of two samples at nearly one time it takes little to be fast.
const JUMP_TIME_MIN_S: f64 = 0.005;

/// How something moves that a hand moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Habit {
    /// Memory `M` of its trend, in seconds: a shorter one is too restless for the device, a longer one too slow for a throw.
    pub memory_s: f64,
    /// Damping time `T` of its velocity, in seconds.
    pub damping_s: f64,
    /// Speed of a change's two kinds, per second, that no hand reaches: beyond it a sensor jumped, and nothing follows
    /// from it.
    pub jump_speed: [f64; 2],
}

/// A wrist: m/s and rad/s.
pub const WRIST: Habit = Habit {
    memory_s: 0.005,
    damping_s: 0.2,
    jump_speed: [20.0, 50.0],
};
/// Joint angles, rad/s: fingers start and stop within a few hundredths of a second.
pub const FINGERS: Habit = Habit {
    memory_s: 0.01,
    damping_s: 0.05,
    jump_speed: [30.0, 30.0],
};

/// The trend of one stream.
#[derive(Clone, Debug)]
pub struct Trend<T, const N: usize> {
    habit: Habit,
    memory: Option<Memory<T, N>>,
}

#[derive(Clone, Debug)]
struct Memory<T, const N: usize> {
    at_ns: i64,
    smoothed: T,
    /// Per second.
    velocity: SVector<f64, N>,
}

impl<T: Moving<N>, const N: usize> Trend<T, N> {
    /// A trend of which nothing is known.
    pub const fn new(habit: Habit) -> Self {
        Self {
            habit,
            memory: None,
        }
    }

    /// Forgets what was: the next sample begins at rest.
    pub fn forget(&mut self) {
        self.memory = None;
    }

    /// Takes the next sample; its time is later than that of the last one.
    pub fn push(&mut self, at_ns: i64, value: &T) {
        let Some(memory) = &mut self.memory else {
            self.memory = Some(Memory {
                at_ns,
                smoothed: value.clone(),
                velocity: SVector::zeros(),
            });
            return;
        };
        let elapsed_s = (at_ns - memory.at_ns).max(1) as f64 * 1.0e-9;
        let kept = (-elapsed_s / self.habit.memory_s).exp();
        let expected = memory.smoothed.moved(&(memory.velocity * elapsed_s));
        let mut error = value.change_from(&expected);
        memory.velocity += error * ((1.0 - kept) * (1.0 - kept) / elapsed_s);
        let jump = self
            .habit
            .jump_speed
            .map(|speed| speed * elapsed_s.max(JUMP_TIME_MIN_S));
        for row in 0..N {
            if error[row].abs() > jump[usize::from(row >= T::N_FIRST)] {
                memory.velocity[row] = 0.0;
            } else {
                error[row] *= 1.0 - kept * kept;
            }
        }
        memory.smoothed = expected.moved(&error);
        memory.at_ns = at_ns;
    }

    /// Where the newest sample will be after a time in seconds, at most [`LEAD_MAX_S`].
    pub fn ahead(&self, newest: &T, lead_s: f64) -> T {
        let Some(memory) = self.memory.as_ref().filter(|_| lead_s > 0.0) else {
            return newest.clone();
        };
        let lead_s = lead_s.min(LEAD_MAX_S);
        let damping_s = self.habit.damping_s;
        let damped_s = damping_s * (1.0 - (-lead_s / damping_s).exp());
        newest.moved(&(memory.velocity * damped_s))
    }
}

#[cfg(test)]
mod tests;
