//! What the user may choose about a LucidGlove.

use crate::glove::calibrate::Handedness;

/// What the user may choose.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LucidGloveSettings {
    /// The glove's number for a full curl; `None` to find it out: 1023 until a greater number comes, then 4095.
    pub max: Option<u16>,
    /// Whether the fingers may be stopped.
    pub feedback: bool,
    /// The number that blocks a finger: 1000 for the firmware, 4095 for the stand-alone library.
    pub feedback_max: u16,
    /// Whether vibrations are sent. Off, for the firmware takes such a line for one that frees every finger; the limits
    /// are sent again right behind it.
    pub haptics: bool,
    /// The hand that it is made for; `None` to believe the glove, which seldom says.
    pub hand: Option<Handedness>,
}

impl Default for LucidGloveSettings {
    fn default() -> Self {
        Self {
            max: None,
            feedback: true,
            feedback_max: 1_000,
            haptics: false,
            hand: None,
        }
    }
}
