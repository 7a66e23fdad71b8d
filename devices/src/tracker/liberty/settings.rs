//! What the user may choose, and the commands that say so.

use crate::tracker::liberty::decode::FrameFormat;
use crate::tracker::liberty::protocol::{
    ASCII, BINARY, CENTIMETRES, CONTINUOUS, N_STATIONS, ZERO_COUNTERS,
};
use crate::tracker::space::METRES_PER_CENTIMETRE;

/// Which of the unit's own counters its frames carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Counter {
    /// Milliseconds since the start of the stream.
    #[default]
    Time,
    /// Frames since the start of the stream: finer, and as even as the unit's own rate.
    Frames,
}

/// What the user may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct LibertySettings {
    /// Which of the stations 1 to 16 are used. The unit sends every sensor that is plugged in.
    pub stations: [bool; N_STATIONS],
    /// Which counter is sent.
    pub counter: Counter,
    /// Whether the switch of the stylus is sent.
    pub stylus: bool,
    /// Hemisphere of every station: the direction from the source in which the sensors are, in the source's space;
    /// `None` leaves the unit's own.
    pub hemisphere: Option<[f64; 3]>,
    /// Position filter (F, low, high, factor); 0, 1, 0, 0 is none, and `None` leaves the unit's own.
    pub position_filter: Option<[f64; 4]>,
    /// Attitude filter (F, low, high, factor), likewise.
    pub attitude_filter: Option<[f64; 4]>,
}

impl Default for LibertySettings {
    /// Station 1, with the time.
    fn default() -> Self {
        let mut stations = [false; N_STATIONS];
        stations[0] = true;
        Self {
            stations,
            counter: Counter::Time,
            stylus: false,
            hemisphere: None,
            position_filter: None,
            attitude_filter: None,
        }
    }
}

impl LibertySettings {
    /// Whether that station, numbered from 1, is used.
    #[must_use]
    pub fn has_station(&self, station: u16) -> bool {
        let index = usize::from(station).wrapping_sub(1);
        self.stations.get(index).is_some_and(|used| *used)
    }

    /// What the frames look like.
    #[must_use]
    pub const fn format(&self) -> FrameFormat {
        FrameFormat {
            counter: Some(self.counter),
            stylus: self.stylus,
            metres_per_unit: METRES_PER_CENTIMETRE,
        }
    }
}

/// The settings as commands, in the order in which they are sent; the last begins the stream. Until binary output is
/// set a refused command is answered with text, which the stream passes over.
pub(super) fn commands(settings: &LibertySettings) -> Vec<Vec<u8>> {
    let numbers: String = settings
        .format()
        .items()
        .iter()
        .map(|item| format!(",{item}"))
        .collect();
    let mut list = vec![ASCII.to_vec(), CENTIMETRES.to_vec()];
    // Every station, for one that is plugged in and not used would send frames of another length.
    list.push(format!("O*{numbers}\r").into_bytes());
    if let Some([x, y, z]) = settings.hemisphere {
        list.push(format!("H*,{x:.2},{y:.2},{z:.2}\r").into_bytes());
    }
    for (letter, filter) in [
        ('X', settings.attitude_filter),
        ('Y', settings.position_filter),
    ] {
        if let Some([sensitivity, low, high, factor]) = filter {
            let text = format!("{letter}{sensitivity:.2},{low:.2},{high:.2},{factor:.2}\r");
            list.push(text.into_bytes());
        }
    }
    list.extend([BINARY, ZERO_COUNTERS, CONTINUOUS].map(<[u8]>::to_vec));
    list
}
