//! `kind = "delimited"`: a glove that prints lines of numbers.

use tsukamu_devices::driver::Driver;
use tsukamu_devices::glove::delimited::column::Column;
use tsukamu_devices::glove::delimited::settings::{DelimitedSettings, Scale, TimeUnit};
use tsukamu_devices::glove::sensor::GloveSensor;

use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// Most columns of a line: a number and a separator each still fit into the longest line that is read.
const COLUMNS_MAX: usize = 64;
/// Most letters of a prefix or a start-up line.
const TEXT_MAX: usize = 256;

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    let layout = keys.choice(sheet, "layout", &["homunculus"]);
    let base = match layout {
        Some(_) => DelimitedSettings::homunculus(),
        None => DelimitedSettings::new(Vec::new()),
    };
    if layout.is_none() {
        keys.require(
            sheet,
            "columns",
            "the columns from the left, such as [\"time\", \"thumb\", \"index\"]",
        );
    }
    let columns = columns(keys, sheet, "columns", COLUMNS_MAX);
    let settings = DelimitedSettings {
        separators: text(keys, sheet, "separators").unwrap_or(base.separators),
        prefix: text(keys, sheet, "prefix").unwrap_or(base.prefix),
        scale: scale(keys, sheet).unwrap_or(base.scale),
        time_unit: time_unit(keys, sheet),
        start: text(keys, sheet, "start").unwrap_or(base.start),
        autocalibrate: keys.flag(sheet, "autocalibrate").unwrap_or(false),
        columns: columns.unwrap_or(base.columns),
    };
    check_separators(keys, sheet, &settings.separators);
    if keys.has("time_unit") && !settings.columns.contains(&Column::Time) {
        keys.fault(sheet, "time_unit", "does nothing without a column \"time\"");
    }
    (!settings.columns.is_empty()).then_some(Driver::Delimited(settings))
}

/// A list of columns, in which no sensor and no time comes twice and something is of use.
pub(super) fn columns(
    keys: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    key: &'static str,
    n_max: usize,
) -> Option<Vec<Column>> {
    let texts = keys.texts(sheet, key)?;
    let mut columns: Vec<Column> = Vec::new();
    let mut seen: Vec<GloveSensor> = Vec::new();
    let n_texts = texts.len();
    for (index, (span, text)) in texts.into_iter().enumerate() {
        let fault = match Column::parse(&text) {
            Err(fault) => Some(fault),
            Ok(Column::Time) if columns.contains(&Column::Time) => {
                Some("is a second column \"time\"".to_owned())
            }
            Ok(column) => {
                let twice = column.sensors().iter().enumerate().any(|(index, sensor)| {
                    seen.contains(sensor) || column.sensors()[..index].contains(sensor)
                });
                seen.extend(column.sensors());
                columns.push(column);
                twice.then(|| format!("is {text:?}, a sensor of which another column is too"))
            }
        };
        if let Some(fault) = fault {
            sheet.fault(&span, format!("{}[{index}]", keys.path_of(key)), fault);
        }
    }
    if n_texts > n_max {
        keys.fault(
            sheet,
            key,
            format!("has {n_texts} columns; at most {n_max} are read"),
        );
    } else if seen.is_empty() && columns.len() == n_texts {
        keys.fault(sheet, key, "name no sensor");
    }
    (columns.len() == n_texts && !seen.is_empty()).then_some(columns)
}

/// A text of bounded length.
fn text(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>, key: &'static str) -> Option<String> {
    let text = keys.text(sheet, key)?;
    if text.len() > TEXT_MAX {
        keys.fault(sheet, key, format!("is longer than {TEXT_MAX} bytes"));
        return None;
    }
    Some(text)
}

/// What the numbers mean: a range of raw values, or angles.
fn scale(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Scale> {
    let unit = keys.choice(sheet, "unit", &["raw", "deg", "rad"]);
    let bounds = Bounds::within(-1.0e9, 1.0e9, "");
    let range = keys.numbers::<2>(sheet, "raw_range", "[straight, bent]", bounds);
    let angle = match unit {
        Some("deg") => Some(Scale::Degrees),
        Some("rad") => Some(Scale::Radians),
        _ => None,
    };
    match (angle, range) {
        (Some(angle), None) => Some(angle),
        (Some(_), Some(_)) => {
            keys.fault(
                sheet,
                "raw_range",
                "is of raw values, and the unit is an angle",
            );
            None
        }
        (None, Some([straight, bent])) if straight == bent => {
            keys.fault(sheet, "raw_range", "is empty");
            None
        }
        (None, Some([straight, bent])) => Some(Scale::Range(straight, bent)),
        (None, None) => None,
    }
}

fn time_unit(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> TimeUnit {
    match keys.choice(sheet, "time_unit", &["s", "ms", "us", "ticks"]) {
        Some("s") => TimeUnit::Seconds,
        Some("us") => TimeUnit::Microseconds,
        Some("ticks") => TimeUnit::Ticks,
        _ => TimeUnit::Milliseconds,
    }
}

/// Separators that could be part of a number or of a line's end part nothing.
fn check_separators(keys: &Keys<'_>, sheet: &mut Sheet<'_>, separators: &str) {
    let is_bad = |letter: char| {
        letter.is_ascii_alphanumeric() || matches!(letter, '+' | '-' | '.' | '\n' | '\r')
    };
    if separators.is_empty() {
        keys.fault(sheet, "separators", "name no character");
    } else if let Some(letter) = separators.chars().find(|letter| is_bad(*letter)) {
        let text = format!("hold {letter:?}, which may be part of a number or end a line");
        keys.fault(sheet, "separators", text);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use tsukamu_devices::driver::Driver;
    use tsukamu_devices::glove::delimited::settings::{DelimitedSettings, Scale, TimeUnit};
    use tsukamu_devices::glove::sensor::GloveSensor;

    use crate::settings::overrides::Overrides;
    use crate::settings::parse;

    fn read(keys: &str) -> Result<DelimitedSettings, String> {
        let text = format!("[[device]]\nname='g'\nkind='delimited'\nport='/dev/a'\n{keys}");
        match parse("t.toml", &text, Path::new(""), &Overrides::default()) {
            Ok(settings) => match &settings.devices[0].driver {
                Driver::Delimited(settings) => Ok(settings.clone()),
                other => Err(other.name().to_owned()),
            },
            Err(mistakes) => Err(mistakes.to_string()),
        }
    }

    #[test]
    fn a_glove_is_described_by_keys_alone() {
        let settings = read(
            "columns = ['time', 'thumb', 'index+index_dip', 'skip']\nraw_range = [900, 100]\nseparators = ';'\n\
             prefix = 'H'\nstart = \"go\\n\"\ntime_unit = 'us'\nautocalibrate = true",
        )
        .unwrap();
        assert_eq!(settings.columns[2].sensors().len(), 3);
        assert_eq!(settings.scale, Scale::Range(900.0, 100.0));
        assert_eq!(settings.time_unit, TimeUnit::Microseconds);
        let texts = (settings.separators, settings.prefix, settings.start);
        assert_eq!(texts, (";".to_owned(), "H".to_owned(), "go\n".to_owned()));
        assert!(settings.autocalibrate);
        let least = read("columns = ['index_mcp']").unwrap();
        assert_eq!(least.columns[0].sensors(), [GloveSensor::IndexMcp]);
        assert_eq!(least.scale, Scale::Range(0.0, 1023.0));
        assert_eq!(
            read("columns = ['index_mcp']\nunit = 'deg'").unwrap().scale,
            Scale::Degrees
        );
        assert_eq!(
            read("layout = 'homunculus'"),
            Ok(DelimitedSettings::homunculus())
        );
    }

    #[test]
    fn each_mistake_is_named() {
        for (keys, expected) in [
            ("", "device[0].columns: is missing"),
            (
                "columns = ['pinky']",
                "device[0].columns[0]: \"pinky\" is neither",
            ),
            ("columns = ['skip', 'time']", "columns: name no sensor"),
            (
                "columns = ['time', 'time', 'ring']",
                "columns[1]: is a second column",
            ),
            (
                "columns = ['index', 'index_mcp']",
                "columns[1]: is \"index_mcp\", a sensor of which another column is too",
            ),
            (
                "columns = ['index+index']",
                "columns[0]: is \"index+index\", a sensor",
            ),
            (
                "columns = ['ring']\nraw_range = [5, 5]",
                "raw_range: is empty",
            ),
            (
                "columns = ['ring']\nraw_range = [0, 9]\nunit = 'deg'",
                "raw_range: is of raw values",
            ),
            ("columns = ['ring']\nseparators = ''", "separators: name no"),
            (
                "columns = ['ring']\nseparators = ',.'",
                "separators: hold '.'",
            ),
            (
                "columns = ['ring']\ntime_unit = 's'",
                "time_unit: does nothing",
            ),
            (
                "columns = ['ring']\nseperators = ','",
                "did you mean separators?",
            ),
        ] {
            let found = read(keys).unwrap_err();
            assert!(found.contains(expected), "{keys}\n{found}");
            assert_eq!(found.lines().count(), 1, "{keys}\n{found}");
        }
    }
}
