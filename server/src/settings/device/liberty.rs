//! `kind = "liberty"`: Patriot and Latus too.

use tsukamu_devices::driver::Driver;
use tsukamu_devices::tracker::liberty::settings::{Counter, LibertySettings};

use super::polhemus;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    let mut settings = LibertySettings::default();
    if let Some(stations) = polhemus::stations(keys, sheet) {
        settings.stations = stations;
    }
    if keys.choice(sheet, "counter", &["time", "frames"]) == Some("frames") {
        settings.counter = Counter::Frames;
    }
    settings.stylus = keys.flag(sheet, "stylus").unwrap_or(settings.stylus);
    settings.hemisphere = polhemus::hemisphere(keys, sheet);
    settings.position_filter = polhemus::filter(keys, sheet, "position_filter");
    settings.attitude_filter = polhemus::filter(keys, sheet, "attitude_filter");
    Some(Driver::Liberty(settings))
}
