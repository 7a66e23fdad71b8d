//! What the user may choose, and the commands that say so.

use crate::tracker::flock::decode::{Output, RecordFormat};
use crate::tracker::flock::protocol::{
    BUTTON_MODE, HEMISPHERE, POSITION_ANGLES, POSITION_QUATERNION, TO_BIRD,
};
use crate::tracker::space::METRES_PER_INCH;

/// On which side of the transmitter the sensors are. Only the operands of [`Hemisphere::Forward`] have been checked
/// against another driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hemisphere {
    /// x is positive.
    Forward,
    /// x is negative.
    Rear,
    /// z is negative, for z points down.
    Upper,
    /// z is positive.
    Lower,
    /// y is negative.
    Left,
    /// y is positive.
    Right,
}

impl Hemisphere {
    /// Axis and sign as the command has them.
    #[must_use]
    pub const fn operands(self) -> [u8; 2] {
        match self {
            Self::Forward => [0x00, 0x00],
            Self::Rear => [0x00, 0x01],
            Self::Upper => [0x0C, 0x01],
            Self::Lower => [0x0C, 0x00],
            Self::Left => [0x06, 0x01],
            Self::Right => [0x06, 0x00],
        }
    }
}

/// Position at full range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// 36 inches: the standard.
    #[default]
    Inches36,
    /// 72 inches: a unit that is switched to long scale; not verified.
    Inches72,
    /// 144 inches: the extended-range transmitter; not verified.
    Inches144,
}

impl Scale {
    /// Position at full range, m.
    #[must_use]
    pub const fn metres(self) -> f64 {
        METRES_PER_INCH
            * match self {
                Self::Inches36 => 36.0,
                Self::Inches72 => 72.0,
                Self::Inches144 => 144.0,
            }
    }
}

/// What the user may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct FlockSettings {
    /// Addresses on the bus, 1 to 14, of the birds that are used. An extended-range controller takes an address too, so
    /// the first sensor may have address 2.
    pub birds: Vec<u8>,
    /// Whether the units are a group on a bus (switches set to addresses), and not one unit alone (address 0).
    pub group: bool,
    /// What is sent.
    pub output: Output,
    /// On which side of the transmitter the sensors are; `None` leaves the units' own.
    pub hemisphere: Option<Hemisphere>,
    /// Position at full range: how the units are switched, for the session does not switch it.
    pub scale: Scale,
    /// Turns every rotation round: pairs of firmware and driver have disagreed about its direction.
    pub invert_quaternion: bool,
    /// Whether each record carries the buttons.
    pub buttons: bool,
}

impl Default for FlockSettings {
    /// One bird alone.
    fn default() -> Self {
        Self {
            birds: vec![1],
            group: false,
            output: Output::PositionQuaternion,
            hemisphere: None,
            scale: Scale::Inches36,
            invert_quaternion: false,
            buttons: false,
        }
    }
}

impl FlockSettings {
    /// Whether that bird is used.
    #[must_use]
    pub fn has_station(&self, station: u16) -> bool {
        self.birds.iter().any(|bird| u16::from(*bird) == station)
    }

    /// The highest address in use, which is how many units the bus has at least.
    #[must_use]
    pub fn n_units(&self) -> u8 {
        self.birds.iter().copied().max().unwrap_or(1)
    }

    /// What the records look like.
    #[must_use]
    pub fn format(&self) -> RecordFormat {
        RecordFormat {
            output: self.output,
            buttons: self.buttons,
            n_units: self.group.then(|| self.n_units()),
            range_m: self.scale.metres(),
        }
    }
}

/// The commands to one bird; `address` is `None` where there is one alone. A mode that is not asked for is switched off
/// only if `thorough`, for old units have been seen to mind.
pub(super) fn commands(settings: &FlockSettings, address: Option<u8>, thorough: bool) -> Vec<u8> {
    let format = match settings.output {
        Output::PositionQuaternion => POSITION_QUATERNION,
        Output::PositionAngles => POSITION_ANGLES,
    };
    let mut commands = vec![vec![format]];
    if let Some(hemisphere) = settings.hemisphere {
        let [axis, sign] = hemisphere.operands();
        commands.push(vec![HEMISPHERE, axis, sign]);
    }
    if settings.buttons || thorough {
        commands.push(vec![BUTTON_MODE, settings.buttons.into()]);
    }
    let prefix = address.map(|address| TO_BIRD + address);
    commands
        .into_iter()
        .flat_map(|command| prefix.into_iter().chain(command))
        .collect()
}
