//! What the user may choose, and the commands that say so.

use crate::tracker::fastrak::protocol::{BINARY, CENTIMETRES};
use crate::tracker::isotrak::protocol::{Model, N_STATIONS, OUTPUT_LIST};

/// What the user may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct IsotrakSettings {
    /// Which unit it is: scale and start-up differ.
    pub model: Model,
    /// Which of the stations 1 and 2 are used. The unit sends every receiver that is plugged in, and shares its rate
    /// among them.
    pub stations: [bool; N_STATIONS],
    /// Hemisphere of every station: the direction from the transmitter in which the receivers are, in transmitter
    /// space; `None` leaves the unit's own, which is forward (1, 0, 0) from the factory.
    pub hemisphere: Option<[f64; 3]>,
    /// Position filter (F, low, high, factor); `None` leaves the unit's own. A 3SPACE Tracker is not sent it.
    pub position_filter: Option<[f64; 4]>,
    /// Attitude filter (F, low, high, factor), likewise.
    pub attitude_filter: Option<[f64; 4]>,
}

impl Default for IsotrakSettings {
    /// An Isotrak II with station 1.
    fn default() -> Self {
        Self {
            model: Model::IsotrakTwo,
            stations: [true, false],
            hemisphere: None,
            position_filter: None,
            attitude_filter: None,
        }
    }
}

/// The settings as commands, in the order in which they are sent.
pub(super) fn commands(settings: &IsotrakSettings) -> Vec<Vec<u8>> {
    let mut list = vec![OUTPUT_LIST.to_vec()];
    let mut text = |command: String| list.push(command.into_bytes());
    let used = (1..)
        .zip(settings.stations)
        .filter_map(|(station, used)| used.then_some(station));
    if settings.model == Model::IsotrakTwo {
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
        // The alignment and the boresight of an earlier user would turn everything.
        for station in used.clone() {
            text(format!("R{station}\r"));
            text(format!("b{station}\r"));
        }
    }
    if let Some([x, y, z]) = settings.hemisphere {
        used.for_each(|station: u32| text(format!("H{station},{x:.2},{y:.2},{z:.2}\r")));
    }
    if settings.model == Model::IsotrakTwo {
        list.push(vec![CENTIMETRES]);
    }
    list.push(vec![BINARY]);
    list
}
