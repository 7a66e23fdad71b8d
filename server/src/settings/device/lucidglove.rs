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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use tsukamu_devices::driver::Driver;
    use tsukamu_devices::glove::calibrate::Handedness;
    use tsukamu_devices::glove::lucidglove::settings::LucidGloveSettings;

    use crate::document::mistake::Mistakes;
    use crate::settings::overrides::Overrides;
    use crate::settings::{Settings, parse};

    fn read(keys: &str) -> Result<Settings, Mistakes> {
        let text = format!(
            "[[device]]\nname = 'g'\nkind = 'lucidglove'\nport = 'tcp-listen:65432'\n{keys}\n\
             [[device]]\nname = 't'\nkind = 'fastrak'\nport = '/dev/t'\n\
             [[hand]]\nname = 'h'\nside = 'left'\nglove = 'g'\ntracker = 't'\n"
        );
        parse("t.toml", &text, Path::new(""), &Overrides::default())
    }

    #[test]
    fn keys_are_read_and_have_defaults() {
        let settings = read("").unwrap();
        assert_eq!(
            settings.devices[0].driver,
            Driver::LucidGlove(LucidGloveSettings::default())
        );
        assert_eq!(settings.hands[0].feedback_strength, 1.0);
        let keys =
            "max = 1023\nhand = 'left'\nfeedback = false\nfeedback_max = 4095\nhaptics = true";
        let expected = LucidGloveSettings {
            max: Some(1023),
            feedback: false,
            feedback_max: 4095,
            haptics: true,
            hand: Some(Handedness::Left),
        };
        assert_eq!(
            read(keys).unwrap().devices[0].driver,
            Driver::LucidGlove(expected)
        );
    }

    #[test]
    fn mistakes_are_told() {
        for (keys, part) in [
            ("max = 0", "max"),
            ("max = 70000", "max"),
            ("feedback_max = 10.5", "whole number"),
            ("hand = 'both'", "left"),
            ("haptic = true", "haptic"),
        ] {
            let text = read(keys).unwrap_err().to_string();
            assert!(text.contains(part), "{keys}: {text}");
        }
    }
}
