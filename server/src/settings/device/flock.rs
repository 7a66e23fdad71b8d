//! `kind = "flock"`

use tsukamu_devices::driver::Driver;
use tsukamu_devices::tracker::flock::decode::Output;
use tsukamu_devices::tracker::flock::protocol::N_ADDRESSES;
use tsukamu_devices::tracker::flock::settings::{FlockSettings, Hemisphere, Scale};

use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Names of the sides of a transmitter.
const HEMISPHERES: [(&str, Hemisphere); 6] = [
    ("forward", Hemisphere::Forward),
    ("rear", Hemisphere::Rear),
    ("upper", Hemisphere::Upper),
    ("lower", Hemisphere::Lower),
    ("left", Hemisphere::Left),
    ("right", Hemisphere::Right),
];

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    let mut settings = FlockSettings::default();
    let addresses = Bounds::within(1.0, N_ADDRESSES as f64, "");
    if let Some(birds) = keys.wholes(sheet, "birds", addresses, N_ADDRESSES) {
        settings.birds = birds.into_iter().map(|bird| bird as u8).collect();
    }
    // One bird is alone unless it is said to be on a bus.
    let is_alone = settings.birds == [1];
    settings.group = keys.flag(sheet, "group").unwrap_or(!is_alone);
    if !settings.group && !is_alone {
        keys.fault(
            sheet,
            "group",
            "is false, and then there is bird 1 alone; leave birds or group out",
        );
    }
    if keys.choice(sheet, "output", &["quaternion", "angles"]) == Some("angles") {
        settings.output = Output::PositionAngles;
    }
    let names = HEMISPHERES.map(|(name, _)| name);
    let chosen = keys.choice(sheet, "hemisphere", &names);
    settings.hemisphere = HEMISPHERES
        .iter()
        .find(|(name, _)| Some(*name) == chosen)
        .map(|(_, hemisphere)| *hemisphere);
    settings.scale = match keys.choice(sheet, "scale", &["36in", "72in", "144in"]) {
        Some("72in") => Scale::Inches72,
        Some("144in") => Scale::Inches144,
        _ => Scale::Inches36,
    };
    settings.invert_quaternion = keys
        .flag(sheet, "invert_quaternion")
        .unwrap_or(settings.invert_quaternion);
    settings.buttons = keys.flag(sheet, "buttons").unwrap_or(settings.buttons);
    Some(Driver::Flock(settings))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use tsukamu_devices::driver::Driver;
    use tsukamu_devices::tracker::flock::settings::{FlockSettings, Hemisphere, Scale};

    use crate::settings::overrides::Overrides;
    use crate::settings::parse;

    fn read(keys: &str) -> Result<FlockSettings, String> {
        let text = format!("[[device]]\nname = 'f'\nkind = 'flock'\nport = '/dev/f'\n{keys}");
        let settings = parse("t.toml", &text, Path::new(""), &Overrides::default())
            .map_err(|mistakes| mistakes.to_string())?;
        match &settings.devices[0].driver {
            Driver::Flock(flock) => Ok(flock.clone()),
            other => Err(format!("is {other:?}")),
        }
    }

    #[test]
    fn one_bird_is_alone_and_several_are_a_group() {
        assert_eq!(read("").unwrap(), FlockSettings::default());
        let two = read("birds = [1, 2]\nhemisphere = 'lower'\nscale = '144in'").unwrap();
        assert_eq!((two.birds, two.group), (vec![1, 2], true));
        assert_eq!(
            (two.hemisphere, two.scale),
            (Some(Hemisphere::Lower), Scale::Inches144)
        );
        assert!(read("birds = [2]").unwrap().group);
        assert!(read("group = true").unwrap().group);
    }

    #[test]
    fn mistakes_are_named() {
        let expected = "is false, and then there is bird 1 alone";
        assert!(
            read("birds = [1, 2]\ngroup = false")
                .unwrap_err()
                .contains(expected)
        );
        assert!(read("birds = [15]").unwrap_err().contains("birds"));
        assert!(
            read("hemisphere = 'up'")
                .unwrap_err()
                .contains("hemisphere")
        );
        assert!(read("scale = 36").unwrap_err().contains("scale"));
    }
}
