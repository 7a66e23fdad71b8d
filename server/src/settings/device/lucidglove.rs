//! `kind = "lucidglove"`

use tsukamu_devices::driver::Driver;
use tsukamu_devices::glove::calibrate::Handedness;
use tsukamu_devices::glove::lucidglove::settings::LucidGloveSettings;

use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Numbers that the protocol can carry.
const NUMBER: Bounds = Bounds::within(1.0, 65_535.0, "");

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    let default = LucidGloveSettings::default();
    let hand = match keys.choice(sheet, "hand", &["left", "right"]) {
        Some("left") => Some(Handedness::Left),
        Some(_) => Some(Handedness::Right),
        None => None,
    };
    // The bounds keep both within 16 bits.
    let max = keys.whole(sheet, "max", NUMBER).map(|max| max as u16);
    let feedback_max = keys.whole(sheet, "feedback_max", NUMBER);
    Some(Driver::LucidGlove(LucidGloveSettings {
        max,
        feedback: keys.flag(sheet, "feedback").unwrap_or(default.feedback),
        feedback_max: feedback_max.map_or(default.feedback_max, |max| max as u16),
        haptics: keys.flag(sheet, "haptics").unwrap_or(default.haptics),
        hand,
    }))
}
