//! The keys that Polhemus trackers share.

use nalgebra::Vector3;

use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// `stations`: which of `N` are used.
pub(super) fn stations<const N: usize>(
    keys: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
) -> Option<[bool; N]> {
    let stations = keys.wholes(sheet, "stations", Bounds::within(1.0, N as f64, ""), N)?;
    Some(std::array::from_fn(|index| {
        stations.contains(&(index as u32 + 1))
    }))
}

/// `hemisphere`: a direction from the transmitter, in its own axes.
pub(super) fn hemisphere(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<[f64; 3]> {
    let direction = keys.numbers::<3>(
        sheet,
        "hemisphere",
        "[x, y, z]",
        Bounds::within(-1.0, 1.0, ""),
    )?;
    if Vector3::from(direction).norm() < 1.0e-6 {
        keys.fault(sheet, "hemisphere", "is no direction");
    }
    Some(direction)
}

/// A filter of the unit's own: sensitivity, lowest and highest weight, and how fast the weight changes.
pub(super) fn filter(
    keys: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    key: &'static str,
) -> Option<[f64; 4]> {
    keys.numbers::<4>(
        sheet,
        key,
        "[sensitivity, low, high, factor]",
        Bounds::within(0.0, 1.0, ""),
    )
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use tsukamu_devices::driver::Driver;
    use tsukamu_devices::tracker::isotrak::protocol::Model;
    use tsukamu_devices::tracker::liberty::settings::Counter;

    use crate::settings::overrides::Overrides;
    use crate::settings::parse;

    fn read(kind: &str, keys: &str) -> Result<Driver, String> {
        let text = format!("[[device]]\nname = 't'\nkind = {kind:?}\nport = '/dev/t'\n{keys}");
        parse("t.toml", &text, Path::new(""), &Overrides::default())
            .map(|settings| settings.devices[0].driver.clone())
            .map_err(|mistakes| mistakes.to_string())
    }

    #[test]
    fn every_kind_reads_the_keys_that_all_share() {
        let keys = "stations = [2]\nhemisphere = [0, 0, 1]\nposition_filter = [0.2, 0.2, 0.8, 0.8]";
        for kind in ["fastrak", "isotrak", "liberty"] {
            let driver = read(kind, keys).unwrap();
            assert_eq!(
                (driver.has_station(1), driver.has_station(2)),
                (false, true)
            );
            let (hemisphere, filter) = match driver {
                Driver::Fastrak(fastrak) => (fastrak.hemisphere, fastrak.position_filter),
                Driver::Isotrak(isotrak) => (isotrak.hemisphere, isotrak.position_filter),
                Driver::Liberty(liberty) => (liberty.hemisphere, liberty.position_filter),
                other => panic!("{kind} is {other:?}"),
            };
            assert_eq!(hemisphere, Some([0.0, 0.0, 1.0]));
            assert_eq!(filter, Some([0.2, 0.2, 0.8, 0.8]));
            let mistake = read(kind, "hemisphere = [0, 0, 0]").unwrap_err();
            assert!(mistake.contains("is no direction"), "{mistake}");
        }
        assert!(read("isotrak", "stations = [3]").is_err());
        assert!(read("liberty", "stations = [16]").unwrap().has_station(16));
    }

    #[test]
    fn each_has_keys_of_its_own() {
        let Driver::Isotrak(isotrak) = read("isotrak", "model = '3space'").unwrap() else {
            panic!("another kind");
        };
        assert_eq!(isotrak.model, Model::ThreeSpace);
        let keys = "counter = 'frames'\nstylus = true";
        let Driver::Liberty(liberty) = read("liberty", keys).unwrap() else {
            panic!("another kind");
        };
        assert_eq!((liberty.counter, liberty.stylus), (Counter::Frames, true));
    }
}
