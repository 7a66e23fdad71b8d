//! What the user may choose about a Fastrak, and the commands that say so.

use crate::tracker::fastrak::decode::{Encoding, Item, LengthUnit, RecordFormat};
use crate::tracker::fastrak::protocol::{ASCII, BINARY, CENTIMETRES, N_STATIONS};

/// What the user may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct FastrakSettings {
    /// Which of the stations 1 to 4 are used; the others are switched off, for the rate is shared.
    pub stations: [bool; N_STATIONS],
    /// How numbers are sent.
    pub encoding: Encoding,
    /// Hemisphere of every station: the direction from the transmitter in which the receivers are, in transmitter
    /// space; `None` leaves the unit's own, which is forward (1, 0, 0) from the factory.
    pub hemisphere: Option<[f64; 3]>,
    /// Position filter (F, low, high, factor); `None` leaves the unit's own.
    pub position_filter: Option<[f64; 4]>,
    /// Attitude filter (F, low, high, factor); `None` leaves the unit's own.
    pub attitude_filter: Option<[f64; 4]>,
}

impl Default for FastrakSettings {
    /// Station 1, binary.
    fn default() -> Self {
        Self {
            stations: [true, false, false, false],
            encoding: Encoding::Binary,
            hemisphere: None,
            position_filter: None,
            attitude_filter: None,
        }
    }
}

impl FastrakSettings {
    /// Whether that station, numbered from 1, is used.
    #[must_use]
    pub fn has_station(&self, station: u16) -> bool {
        let index = usize::from(station).wrapping_sub(1);
        self.stations.get(index).is_some_and(|used| *used)
    }

    /// What the records look like that are asked for.
    pub(super) fn format(&self) -> RecordFormat {
        let trailer = match self.encoding {
            Encoding::Ascii => Item::CrLf,
            Encoding::Binary => Item::Space,
        };
        RecordFormat {
            items: vec![Item::Position, Item::Quaternion, trailer],
            encoding: self.encoding,
            unit: LengthUnit::Centimetres,
        }
    }
}

/// The settings as commands, in the order in which they are sent.
pub(super) fn commands(settings: &FastrakSettings) -> Vec<Vec<u8>> {
    let numbers: String = settings
        .format()
        .items
        .iter()
        .map(|item| format!(",{}", item.number()))
        .collect();
    let mut list = vec![vec![CENTIMETRES]];
    let mut text = |command: String| list.push(command.into_bytes());
    for (station, used) in (1..).zip(settings.stations) {
        text(format!("l{station},{}\r", u8::from(used)));
        if used {
            text(format!("O{station}{numbers}\r"));
        }
        if let Some([x, y, z]) = settings.hemisphere.filter(|_| used) {
            text(format!("H{station},{x:.2},{y:.2},{z:.2}\r"));
        }
    }
    for (letter, filter) in [
        ('x', settings.position_filter),
        ('v', settings.attitude_filter),
    ] {
        if let Some([sensitivity, low, high, factor]) = filter {
            text(format!(
                "{letter}{sensitivity:.2},{low:.2},{high:.2},{factor:.2}\r"
            ));
        }
    }
    list.push(vec![match settings.encoding {
        Encoding::Ascii => ASCII,
        Encoding::Binary => BINARY,
    }]);
    list
}
