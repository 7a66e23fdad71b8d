//! The wire as a table. Both units share the Fastrak's style of commands; what is not listed here is as there.

use crate::tracker::packed::packed_length;
use crate::tracker::space::METRES_PER_INCH;

/// Line rates in the order in which they are worth a try, bit/s; 8 data bits, no parity, 1 stop bit. None is certain.
pub const BAUDS: [u32; 4] = [19_200, 9_600, 38_400, 115_200];
/// Stations of one unit, numbered from 1.
pub const N_STATIONS: usize = 2;
/// Records in a second, shared by the stations that are plugged in; not verified.
pub const TOTAL_RATE_HZ: u64 = 60;

/// Bytes of a record: header, three numbers of position, four of rotation.
pub const RECORD_LENGTH: usize = 17;
/// Bytes of a record on the line.
pub const WIRE_LENGTH: usize = packed_length(RECORD_LENGTH);
/// The list that asks for it, for every station.
pub const OUTPUT_LIST: &[u8] = b"O2,11\r";
/// Third byte of a record: the button of the stylus is down.
pub const BUTTON_DOWN: u8 = b'@';
/// Third byte of a record: the button of the stylus is up.
pub const BUTTON_UP: u8 = b'*';

/// Length of the answer to [`STATUS`](crate::tracker::fastrak::protocol::STATUS).
pub const STATUS_LENGTH: usize = 21;
/// Shortest and longest line that counts as that answer; its fields are not known.
pub const STATUS_LENGTHS: std::ops::RangeInclusive<usize> = 12..=60;

/// Full scale of a rotation's numbers.
pub const QUATERNION_SCALE: f64 = 32_767.0;

/// The two units that speak this.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Model {
    /// Isotrak II.
    #[default]
    IsotrakTwo,
    /// 3SPACE Tracker, the older one.
    ThreeSpace,
}

impl Model {
    /// The family's name in messages.
    #[must_use]
    pub const fn family(self) -> &'static str {
        match self {
            Self::IsotrakTwo => "Isotrak II",
            Self::ThreeSpace => "3SPACE Tracker",
        }
    }

    /// Metres of one step of a position: full scale is 1.6632 m at 32767, or 65.48 inches at 32768.
    #[must_use]
    pub const fn metres_per_step(self) -> f64 {
        match self {
            Self::IsotrakTwo => 1.6632 / 32_767.0,
            Self::ThreeSpace => 65.48 * METRES_PER_INCH / 32_768.0,
        }
    }

    /// How far the length of a sent quaternion may be from 1; the old unit's is only loosely so.
    #[must_use]
    pub const fn quaternion_slack(self) -> f64 {
        match self {
            Self::IsotrakTwo => 0.05,
            Self::ThreeSpace => 0.2,
        }
    }
}
