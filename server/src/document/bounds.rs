//! The numbers that a key allows.

/// The numbers that a key allows.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// Whether `min` itself is left out.
    pub above_min: bool,
    /// What the number counts, as it reads after a number: `m`, `steps per second`; may be empty.
    pub unit: &'static str,
}

impl Bounds {
    /// From `min` to `max`, both allowed.
    pub const fn within(min: f64, max: f64, unit: &'static str) -> Self {
        Self {
            min,
            max,
            above_min: false,
            unit,
        }
    }

    /// Above `min`, up to `max`.
    pub const fn above(min: f64, max: f64, unit: &'static str) -> Self {
        Self {
            min,
            max,
            above_min: true,
            unit,
        }
    }

    /// What is wrong with this number, if anything.
    pub fn fault(&self, value: f64) -> Option<String> {
        let low_enough = value <= self.max;
        let high_enough = if self.above_min {
            value > self.min
        } else {
            value >= self.min
        };
        (!(low_enough && high_enough)).then(|| format!("is {value}; {}", self.allowed()))
    }

    /// What is allowed, as a sentence.
    pub fn allowed(&self) -> String {
        let Self {
            min,
            max,
            above_min,
            unit,
        } = *self;
        let gap = if unit.is_empty() || unit == "°" {
            ""
        } else {
            " "
        };
        if above_min {
            format!("it must be above {min} and at most {max}{gap}{unit}")
        } else {
            format!("it must be from {min} to {max}{gap}{unit}")
        }
    }
}
