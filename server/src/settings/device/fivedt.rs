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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use tsukamu_devices::driver::Driver;
    use tsukamu_devices::glove::fivedt::settings::{FiveDtSettings, FlexureOrder, Model};

    use crate::settings::overrides::Overrides;
    use crate::settings::parse;

    fn read(keys: &str) -> Result<(FiveDtSettings, Vec<u32>), String> {
        let text = format!("[[device]]\nname='g'\nkind='5dt'\nport='/dev/a'\n{keys}");
        match parse("t.toml", &text, Path::new(""), &Overrides::default()) {
            Ok(settings) => match &settings.devices[0].driver {
                Driver::FiveDt(glove) => Ok((glove.clone(), settings.devices[0].bauds.clone())),
                other => Err(other.name().to_owned()),
            },
            Err(mistakes) => Err(mistakes.to_string()),
        }
    }

    #[test]
    fn the_model_chooses_the_line_rate() {
        for (name, model, baud) in [
            ("5", Model::Five, 19_200),
            ("5w", Model::FiveWireless, 9_600),
            ("14", Model::Fourteen, 19_200),
            ("16", Model::Sixteen, 19_200),
        ] {
            let (settings, bauds) = read(&format!("model = '{name}'")).unwrap();
            assert_eq!((settings.model, bauds), (model, vec![baud]));
            assert_eq!(
                (settings.order, settings.autocalibrate),
                (FlexureOrder::ByHand, false)
            );
        }
        let (settings, _) =
            read("model = '5'\norder = 'thumb_first'\nautocalibrate = true").unwrap();
        assert_eq!(
            (settings.order, settings.autocalibrate),
            (FlexureOrder::ThumbFirst, true)
        );
    }

    #[test]
    fn each_mistake_is_named() {
        for (keys, expected) in [
            ("", "model: is missing"),
            ("model = '15'", "model: is \"15\"; it must be one of"),
            (
                "model = 5",
                "model: is a integer; it must be text in quotes",
            ),
            (
                "model = '14'\norder = 'by_hand'",
                "order: is of a glove of 5",
            ),
        ] {
            let found = read(keys).unwrap_err();
            assert!(found.contains(expected), "{keys}\n{found}");
        }
    }
}
