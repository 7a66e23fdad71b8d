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
