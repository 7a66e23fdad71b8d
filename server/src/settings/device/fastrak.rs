//! `kind = "fastrak"`

use tsukamu_devices::driver::Driver;
use tsukamu_devices::tracker::fastrak::decode::Encoding;
use tsukamu_devices::tracker::fastrak::settings::FastrakSettings;

use super::polhemus;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    let mut settings = FastrakSettings::default();
    if let Some(stations) = polhemus::stations(keys, sheet) {
        settings.stations = stations;
    }
    if keys.choice(sheet, "encoding", &["binary", "ascii"]) == Some("ascii") {
        settings.encoding = Encoding::Ascii;
    }
    settings.hemisphere = polhemus::hemisphere(keys, sheet);
    settings.position_filter = polhemus::filter(keys, sheet, "position_filter");
    settings.attitude_filter = polhemus::filter(keys, sheet, "attitude_filter");
    Some(Driver::Fastrak(settings))
}
