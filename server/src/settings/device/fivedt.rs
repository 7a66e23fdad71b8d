//! `kind = "5dt"`

use tsukamu_devices::driver::Driver;
use tsukamu_devices::glove::fivedt::settings::{FiveDtSettings, FlexureOrder, Model};

use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    keys.require(sheet, "model", "\"5\", \"5w\" (wireless), \"14\" or \"16\"");
    let model = match keys.choice(sheet, "model", &["5", "5w", "14", "16"]) {
        Some("5w") => Model::FiveWireless,
        Some("14") => Model::Fourteen,
        Some("16") => Model::Sixteen,
        _ => Model::Five,
    };
    let is_short = matches!(model, Model::Five | Model::FiveWireless);
    let words = ["by_hand", "thumb_first", "little_first"];
    let order = match keys.choice(sheet, "order", &words) {
        Some("thumb_first") => FlexureOrder::ThumbFirst,
        Some("little_first") => FlexureOrder::LittleFirst,
        _ => FlexureOrder::ByHand,
    };
    if keys.has("order") && !is_short {
        keys.fault(
            sheet,
            "order",
            "is of a glove of 5; the others have one order",
        );
    }
    Some(Driver::FiveDt(FiveDtSettings {
        model,
        order,
        autocalibrate: keys.flag(sheet, "autocalibrate").unwrap_or(false),
    }))
}
