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
//! What is added to is the newest sample itself: the smoothed value would be quieter, but further off on recorded hands at
//! every lead. Memory and damping were chosen by the error on recorded hands (`tests` of this module).

use nalgebra::SVector;

use super::moving::Moving;

/// Longest prediction, in seconds.
pub const LEAD_MAX_S: f64 = 0.1;
/// Memory `M` of the trend, in seconds: a shorter one is too restless for a glove of 8 bits, a longer one too slow for a throw.
const MEMORY_S: f64 = 0.01;
/// Damping time `T` of a wrist's velocity, in seconds.
pub const WRIST_DAMPING_S: f64 = 0.2;
/// Damping time `T` of the fingers' velocity, in seconds: fingers start and stop within a few hundredths of a second.
pub const FINGERS_DAMPING_S: f64 = 0.05;

/// The trend of one stream.
#[derive(Clone, Debug)]
pub struct Trend<T, const N: usize> {
    damping_s: f64,
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
    /// A trend of which nothing is known, with that damping time.
    pub const fn new(damping_s: f64) -> Self {
        Self {
            damping_s,
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
        let kept = (-elapsed_s / MEMORY_S).exp();
        let expected = memory.smoothed.moved(&(memory.velocity * elapsed_s));
        let error = value.change_from(&expected);
        memory.smoothed = expected.moved(&(error * (1.0 - kept * kept)));
        memory.velocity += error * ((1.0 - kept) * (1.0 - kept) / elapsed_s);
        memory.at_ns = at_ns;
    }

    /// Where the newest sample will be after a time in seconds, at most [`LEAD_MAX_S`].
    pub fn ahead(&self, newest: &T, lead_s: f64) -> T {
        let Some(memory) = self.memory.as_ref().filter(|_| lead_s > 0.0) else {
            return newest.clone();
        };
        let lead_s = lead_s.min(LEAD_MAX_S);
        let damped_s = self.damping_s * (1.0 - (-lead_s / self.damping_s).exp());
        newest.moved(&(memory.velocity * damped_s))
    }
}
