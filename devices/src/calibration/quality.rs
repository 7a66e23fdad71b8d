//! How good a sensor is for this wearer.

use crate::glove::sensor::GloveSensor;

/// Error of an angle at which a score is a half, degrees.
const HALF_SCORE_DEG: f64 = 5.0;
/// Least score of a good sensor: an error of some 4°.
const GOOD_SCORE: f64 = 0.6;

/// A sensor in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Its angle is good to a few degrees.
    Good,
    /// It moves, but little against its noise or its steps.
    Weak,
    /// It does not move: it is taken for absent.
    Dead,
    /// It ran into the end of its converter's range: beyond it, the joint bends unseen.
    Saturated,
    /// The routine asks nothing of it, as of the wrist's sensors.
    NotAsked,
}

impl Verdict {
    /// The word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Weak => "weak",
            Self::Dead => "dead",
            Self::Saturated => "saturated",
            Self::NotAsked => "not_asked",
        }
    }
}

/// What the routine found out about one sensor; raw units are those of the glove.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorQuality {
    /// The sensor.
    pub sensor: GloveSensor,
    /// From the least to the greatest value of all poses, raw units.
    pub travel: f64,
    /// Standard deviation while a pose was held, raw units.
    pub noise: f64,
    /// Between the two poses that its line goes through, raw units.
    pub separation: f64,
    /// What noise and steps make of the angle, degrees; infinite where there is no line.
    pub error_deg: f64,
    /// 0 to 1: a half at an error of 5°, nearly 1 at 1°; half of that when saturated.
    pub score: f64,
    /// The same in a word.
    pub verdict: Verdict,
}

impl SensorQuality {
    /// A sensor with a line: judged by the error of its angle.
    #[must_use]
    pub(crate) fn of_line(mut self, error_deg: f64, is_saturated: bool) -> Self {
        self.error_deg = error_deg;
        self.score = 1.0 / (1.0 + (error_deg / HALF_SCORE_DEG).powi(2));
        self.verdict = match is_saturated {
            true => Verdict::Saturated,
            false if self.score >= GOOD_SCORE => Verdict::Good,
            false => Verdict::Weak,
        };
        if is_saturated {
            self.score *= 0.5;
        }
        self
    }
}
