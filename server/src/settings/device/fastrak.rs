//! `kind = "fastrak"`

use nalgebra::Vector3;
use tsukamu_devices::driver::Driver;
use tsukamu_devices::tracker::fastrak::decode::Encoding;
use tsukamu_devices::tracker::fastrak::settings::FastrakSettings;

use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    let mut settings = FastrakSettings::default();
    let n_stations = settings.stations.len();
    if let Some(stations) = keys.wholes(
        sheet,
        "stations",
        Bounds::within(1.0, n_stations as f64, ""),
        n_stations,
    ) {
        settings.stations = std::array::from_fn(|index| stations.contains(&(index as u32 + 1)));
    }
    if keys.choice(sheet, "encoding", &["binary", "ascii"]) == Some("ascii") {
        settings.encoding = Encoding::Ascii;
    }
    settings.hemisphere = keys.numbers::<3>(
        sheet,
        "hemisphere",
        "[x, y, z]",
        Bounds::within(-1.0, 1.0, ""),
    );
    if settings
        .hemisphere
        .is_some_and(|direction| Vector3::from(direction).norm() < 1.0e-6)
    {
        keys.fault(sheet, "hemisphere", "is no direction");
    }
    Some(Driver::Fastrak(settings))
}
