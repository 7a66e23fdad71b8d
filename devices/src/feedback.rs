//! What a glove can give back to the hand in it.

/// Forces and vibration for one glove. Fingers are thumb, index, middle, ring, little.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feedback {
    /// How strongly each finger is kept from bending further: 0 is free, 1 is blocked.
    pub resistance: [f64; 5],
    /// A vibration of the whole hand, when one begins.
    pub vibration: Option<Vibration>,
}

/// A vibration that ends by itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vibration {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Strength, 0 to 1.
    pub amplitude: f64,
}

impl Feedback {
    /// No force, no vibration: what a glove is told when nobody asks for anything any more.
    pub const FREE: Self = Self {
        resistance: [0.0; 5],
        vibration: None,
    };
}
