//! What differs from one run of a motion to the next: a small generator of numbers and the tremor of a hand.

use nalgebra::Vector3;

/// A small generator: SplitMix64 (Steele, Lea & Flood 2014). Equal seeds give equal numbers on every machine.
#[derive(Clone, Debug)]
pub(super) struct Variation {
    state: u64,
}

impl Variation {
    pub(super) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// An even spread from -1 to 1.
    pub(super) fn signed(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^= mixed >> 31;
        (mixed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// An even spread around a value.
    pub(super) fn around(&mut self, value: f64, spread: f64) -> f64 {
        value + spread * self.signed()
    }
}

/// Sines per axis.
const N_SINES: usize = 3;
/// Amplitude of each sine, metres: with three of them a hand never trembles by more than half a millimetre.
const AMPLITUDE_M: f64 = 1.0e-4;
/// Middle and half the width of the band of physiological tremor (Elble & Koller 1990), in Hz.
const BAND_HZ: (f64, f64) = (8.0, 2.5);

/// The tremor of a hand: a few sines per axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tremor {
    /// Frequency in radians per second and phase in radians.
    sines: [[(f64, f64); N_SINES]; 3],
}

impl Tremor {
    pub(super) fn new(variation: &mut Variation) -> Self {
        let turn = std::f64::consts::TAU;
        let mut sine = || {
            (
                turn * variation.around(BAND_HZ.0, BAND_HZ.1),
                turn * variation.signed(),
            )
        };
        Self {
            sines: std::array::from_fn(|_| std::array::from_fn(|_| sine())),
        }
    }

    /// Displacement at a time in seconds, in metres.
    pub(super) fn at(&self, t_s: f64) -> Vector3<f64> {
        let axis = |sines: &[(f64, f64); N_SINES]| {
            sines
                .iter()
                .map(|(frequency, phase)| AMPLITUDE_M * libm::sin(frequency * t_s + phase))
                .sum()
        };
        Vector3::from(self.sines.each_ref().map(axis))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_spread_evenly_and_repeat() {
        let mut variation = Variation::new(3);
        let numbers: Vec<f64> = (0..10_000).map(|_| variation.signed()).collect();
        assert!(numbers.iter().all(|x| (-1.0..1.0).contains(x)));
        let mean = numbers.iter().sum::<f64>() / 1e4;
        let square = numbers.iter().map(|x| x * x).sum::<f64>() / 1e4;
        assert!(
            mean.abs() < 0.02 && (square - 1.0 / 3.0).abs() < 0.02,
            "{mean} {square}"
        );
        assert_eq!(Variation::new(3).signed(), numbers[0]);
        assert_ne!(Variation::new(4).signed(), numbers[0]);
    }

    #[test]
    fn tremor_stays_below_a_millimetre() {
        let tremor = Tremor::new(&mut Variation::new(1));
        let most = (0..5000)
            .map(|i| tremor.at(f64::from(i) * 1e-3).norm())
            .fold(0.0, f64::max);
        assert!(most > 5e-5 && most < 1e-3, "{most}");
    }
}
