//! The One-Euro filter (Casiez, Roussel and Vogel 2012, "1€ Filter", CHI '12) on anything that moves.
//!
//! A first-order low-pass whose cut-off rises with speed: `f_c = f_min + β |ẋ|`, `α = 1 / (1 + τ/Tₑ)`,
//! `τ = 1 / (2π f_c)`. Each quantity is filtered as a vector, so that its direction is kept; a pose's place and rotation
//! are two quantities.

use std::f64::consts::TAU;

use nalgebra::SVector;

use super::moving::{Moving, scaled, sizes};

/// A filter's settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneEuro {
    /// Cut-off at rest, Hz, above 0.
    pub min_cutoff_hz: f64,
    /// How fast the cut-off rises with speed, per metre or per radian; 0 or more.
    pub beta: f64,
    /// Cut-off of the speed estimate, Hz, above 0.
    pub derivative_cutoff_hz: f64,
}

/// Cut-off of the speed estimate where none is given, Hz: the paper's.
pub const DERIVATIVE_CUTOFF_HZ: f64 = 1.0;
/// Time between samples after which the filter begins anew, in seconds: what was before says nothing.
const FORGET_S: f64 = 0.5;
/// The shortest time that a clock can tell, in seconds: several samples at one time.
const SHORTEST_S: f64 = 1.0e-9;

impl OneEuro {
    /// Whether every number is in its bounds.
    pub fn is_valid(&self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        positive(self.min_cutoff_hz)
            && positive(self.derivative_cutoff_hz)
            && self.beta >= 0.0
            && self.beta.is_finite()
    }
}

/// A filter of one thing that moves.
#[derive(Clone, Debug)]
pub struct Filter<T, const N: usize> {
    settings: OneEuro,
    memory: Option<Memory<T, N>>,
}

#[derive(Clone, Debug)]
struct Memory<T, const N: usize> {
    at_ns: u64,
    value: T,
    speed: SVector<f64, N>,
    /// Time constants used last, of a change's two kinds, seconds.
    tau_s: [f64; 2],
}

impl<T: Moving<N>, const N: usize> Filter<T, N> {
    /// A filter that has seen nothing.
    pub const fn new(settings: OneEuro) -> Self {
        Self {
            settings,
            memory: None,
        }
    }

    /// The filtered value of one that was taken at a monotonic time in nanoseconds. Stamps that do not rise give the newer
    /// value the filter's place without moving it in time.
    pub fn filtered(&mut self, now: &T, at_ns: u64) -> T {
        let settings = self.settings;
        let fresh = Memory {
            at_ns,
            value: now.clone(),
            speed: SVector::zeros(),
            tau_s: [0.0; 2],
        };
        let memory = self.memory.get_or_insert_with(|| fresh.clone());
        let elapsed_s = at_ns.saturating_sub(memory.at_ns) as f64 * 1.0e-9;
        if elapsed_s > FORGET_S {
            *memory = fresh;
        }
        let elapsed_s = elapsed_s.max(SHORTEST_S);
        // The paper takes the speed from the filtered value.
        let change = now.change_from(&memory.value);
        let speed = change / elapsed_s;
        memory.speed = memory
            .speed
            .lerp(&speed, alpha(settings.derivative_cutoff_hz, elapsed_s));
        let cutoffs =
            sizes::<T, N>(&memory.speed).map(|v| settings.min_cutoff_hz + settings.beta * v);
        memory.tau_s = cutoffs.map(|cutoff| 1.0 / (TAU * cutoff));
        let share = cutoffs.map(|cutoff| alpha(cutoff, elapsed_s));
        memory.value = memory.value.moved(&scaled::<T, N>(&change, share));
        memory.at_ns = at_ns;
        memory.value.clone()
    }

    /// How far the filter runs behind a steady motion at present, in seconds: the larger of its time constants.
    pub fn lag_s(&self) -> f64 {
        let [first, second] = self.memory.as_ref().map_or([0.0; 2], |memory| memory.tau_s);
        if T::N_FIRST < N {
            first.max(second)
        } else {
            first
        }
    }
}

fn alpha(cutoff_hz: f64, elapsed_s: f64) -> f64 {
    1.0 / (1.0 + 1.0 / (TAU * cutoff_hz * elapsed_s))
}
