//! `kind = "vmc"`

use tsukamu_devices::driver::Driver;

use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// This kind has no keys of its own.
pub(super) fn read(_keys: &mut Keys<'_>, _sheet: &mut Sheet<'_>) -> Option<Driver> {
    Some(Driver::Vmc)
}
