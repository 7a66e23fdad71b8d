//! `kind = "opencyberglove"`

use tsukamu_devices::driver::Driver;
use tsukamu_devices::glove::delimited::column::Column;
use tsukamu_devices::glove::opencyberglove::format::OpenCyberGloveSettings;
use tsukamu_devices::glove::opencyberglove::packet::N_VALUES;

use super::delimited::columns;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    let mut settings = OpenCyberGloveSettings {
        autocalibrate: keys.flag(sheet, "autocalibrate").unwrap_or(false),
        ..OpenCyberGloveSettings::default()
    };
    if let Some(columns) = columns(keys, sheet, "order", N_VALUES) {
        if columns.len() == N_VALUES && !columns.contains(&Column::Time) {
            let sensors = columns.iter().map(|column| column.sensors().to_vec());
            settings.order = sensors.collect();
        } else {
            let text = format!("must name {N_VALUES} values, each a sensor or \"skip\"");
            keys.fault(sheet, "order", text);
        }
    }
    Some(Driver::OpenCyberGlove(settings))
}
