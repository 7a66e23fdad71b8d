//! What a glove that prints lines of numbers is like.

use crate::glove::delimited::column::Column;

/// What the numbers mean before anything is calibrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Raw values: the first stands for the least usual angle of the joint, the second for the greatest. The first is
    /// the greater one where values fall as the joint bends.
    Range(f64, f64),
    /// Angles in degrees.
    Degrees,
    /// Angles in radians.
    Radians,
}

/// Unit of the time column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TimeUnit {
    /// Seconds, usually with decimals.
    Seconds,
    /// Milliseconds, as `millis()` of an Arduino gives them; they may wrap at 32 bits.
    #[default]
    Milliseconds,
    /// Microseconds, as `micros()` gives them; they may wrap at 32 bits.
    Microseconds,
    /// A counter whose unit nobody knows; it may wrap at 32 bits.
    Ticks,
}

/// A glove that prints lines of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct DelimitedSettings {
    /// Characters that part the columns. Blanks and tabs next to another separator, or in a row, count once.
    pub separators: String,
    /// What a line of numbers begins with, and other lines do not; may be empty.
    pub prefix: String,
    /// What each column is, from the left; a line has exactly so many.
    pub columns: Vec<Column>,
    /// What the numbers mean.
    pub scale: Scale,
    /// Unit of the time column.
    pub time_unit: TimeUnit,
    /// Sent when the port is opened and when the glove has fallen silent, as it stands; may be empty.
    pub start: String,
    /// Whether the ranges of sensors that the wearer's file does not name are learned while the glove is worn.
    pub autocalibrate: bool,
}

impl DelimitedSettings {
    /// Separators of most sketches.
    pub const SEPARATORS: &'static str = ",; \t";

    /// A glove with these columns, 10-bit values, and nothing special.
    #[must_use]
    pub fn new(columns: Vec<Column>) -> Self {
        Self {
            separators: Self::SEPARATORS.to_owned(),
            prefix: String::new(),
            columns,
            scale: Scale::Range(0.0, 1023.0),
            time_unit: TimeUnit::default(),
            start: String::new(),
            autocalibrate: false,
        }
    }

    /// A LeRobot Homunculus hand exoskeleton: 16 whole numbers of 12 bits parted by blanks. The order is that of LeRobot's
    /// own program (one source): four joints of the thumb from the palm, then abduction, MCP and the joints beyond of each
    /// finger. The middle finger's abduction is left out, for the others are counted from it. Some joints fall as they
    /// bend, which a calibration finds.
    #[must_use]
    pub fn homunculus() -> Self {
        let names = [
            "thumb_rotation",
            "thumb_abduction",
            "thumb_mcp",
            "thumb_ip",
            "middle_index_abduction",
            "index_mcp",
            "index_pip",
            "skip",
            "middle_mcp",
            "middle_pip",
            "ring_middle_abduction",
            "ring_mcp",
            "ring_pip",
            "little_ring_abduction",
            "little_mcp",
            "little_pip",
        ];
        let columns = names
            .into_iter()
            .filter_map(|name| Column::parse(name).ok())
            .collect();
        Self {
            separators: " ".to_owned(),
            scale: Scale::Range(0.0, 4095.0),
            ..Self::new(columns)
        }
    }
}
