//! `kind = "rokoko"`

use tsukamu_devices::driver::Driver;
use tsukamu_devices::source::rokoko::settings::RokokoSettings;

use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    let actor = keys.text(sheet, "actor");
    Some(Driver::Rokoko(RokokoSettings { actor }))
}
