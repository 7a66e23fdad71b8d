//! What the user may choose about a 5DT glove.

/// The gloves there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Model {
    /// Five flexures and two tilt angles, over a cable: answers commands, 19200 bit/s.
    #[default]
    Five,
    /// The same without a cable: only sends, 9600 bit/s.
    FiveWireless,
    /// Fourteen sensors and two tilt angles, 12 bits: only sends, 19200 bit/s.
    Fourteen,
    /// Fourteen sensors, the thumb's opposition and the wrist, 12 bits: only sends, 19200 bit/s.
    Sixteen,
}

impl Model {
    /// Its name in settings.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Five => "5",
            Self::FiveWireless => "5w",
            Self::Fourteen => "14",
            Self::Sixteen => "16",
        }
    }
}

/// In which order a glove of five sends its flexures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FlexureOrder {
    /// From the thumb, and from the little finger where the glove says that it is a left one, as the manual has it.
    #[default]
    ByHand,
    /// From the thumb, as one open driver takes every glove.
    ThumbFirst,
    /// From the little finger.
    LittleFirst,
}

/// What the user may choose.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FiveDtSettings {
    /// Which glove it is.
    pub model: Model,
    /// The order of the flexures of a glove of five.
    pub order: FlexureOrder,
    /// Whether the ranges of sensors that the wearer's file does not name are learned while the glove is worn: the
    /// maker's practice. They are forgotten when another glove or another wearer comes.
    pub autocalibrate: bool,
}

impl Model {
    /// Line rate as delivered, bit/s.
    #[must_use]
    pub const fn baud(self) -> u32 {
        match self {
            Self::FiveWireless => 9_600,
            Self::Five | Self::Fourteen | Self::Sixteen => 19_200,
        }
    }

    /// Greatest raw value.
    #[must_use]
    pub const fn raw_max(self) -> f64 {
        match self {
            Self::Five | Self::FiveWireless => 255.0,
            Self::Fourteen | Self::Sixteen => 4095.0,
        }
    }

    /// Bend sensors.
    #[must_use]
    pub const fn n_sensors(self) -> usize {
        match self {
            Self::Five | Self::FiveWireless => 5,
            Self::Fourteen => 14,
            Self::Sixteen => 16,
        }
    }
}
