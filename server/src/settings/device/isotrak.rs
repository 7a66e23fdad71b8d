//! `kind = "isotrak"`

use tsukamu_devices::driver::Driver;
use tsukamu_devices::tracker::isotrak::protocol::Model;
use tsukamu_devices::tracker::isotrak::settings::IsotrakSettings;

use super::polhemus;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    let mut settings = IsotrakSettings::default();
    if keys.choice(sheet, "model", &["isotrak2", "3space"]) == Some("3space") {
        settings.model = Model::ThreeSpace;
    }
    if let Some(stations) = polhemus::stations(keys, sheet) {
        settings.stations = stations;
    }
    settings.hemisphere = polhemus::hemisphere(keys, sheet);
    settings.position_filter = polhemus::filter(keys, sheet, "position_filter");
    settings.attitude_filter = polhemus::filter(keys, sheet, "attitude_filter");
    Some(Driver::Isotrak(settings))
}
