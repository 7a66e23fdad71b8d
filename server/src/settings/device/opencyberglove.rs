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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use tsukamu_devices::driver::Driver;
    use tsukamu_devices::glove::sensor::GloveSensor;

    use crate::settings::overrides::Overrides;
    use crate::settings::parse;

    fn order(keys: &str) -> Result<Vec<Vec<GloveSensor>>, String> {
        let text = format!("[[device]]\nname='g'\nkind='opencyberglove'\nport='/dev/a'\n{keys}");
        match parse("t.toml", &text, Path::new(""), &Overrides::default()) {
            Ok(settings) => match &settings.devices[0].driver {
                Driver::OpenCyberGlove(settings) => Ok(settings.order.clone()),
                other => Err(other.name().to_owned()),
            },
            Err(mistakes) => Err(mistakes.to_string()),
        }
    }

    #[test]
    fn the_order_of_the_values_can_be_given() {
        assert_eq!(order("").unwrap()[4], [GloveSensor::IndexMcp]);
        let skips = ", 'skip'".repeat(18);
        let given = order(&format!("order = ['wrist_flexion'{skips}]")).unwrap();
        assert_eq!(
            (given.len(), given[0].as_slice()),
            (19, [GloveSensor::WristFlexion].as_slice())
        );
        let found = order("order = ['wrist_flexion', 'skip']").unwrap_err();
        assert!(found.contains("order: must name 19 values"), "{found}");
    }
}
