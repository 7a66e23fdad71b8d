//! The calibration file of one wearer.

use std::path::Path;

use tsukamu_devices::glove::calibrate::{GloveCalibration, MountOffset};

use crate::document::mistake::{Mistake, Mistakes, Sheet};

/// The calibration in this file.
///
/// # Errors
/// When it cannot be read, or every mistake in it.
pub fn load(file: &Path) -> Result<GloveCalibration, Mistakes> {
    let origin = file.display().to_string();
    let text = std::fs::read_to_string(file)
        .map_err(|fault| Mistakes::one(&origin, unreadable(&fault)))?;
    parse(&origin, &text)
}

fn unreadable(fault: &std::io::Error) -> String {
    let hint = match fault.kind() {
        std::io::ErrorKind::NotFound => {
            "; leave it out, and `tsukamu calibrate DEVICE -o FILE` makes one while the daemon runs"
        }
        _ => "",
    };
    format!("cannot be read: {fault}{hint}")
}

/// The calibration in this text.
///
/// # Errors
/// The first mistake of syntax or type with its place, or else every value that is out of bounds.
pub fn parse(origin: &str, text: &str) -> Result<GloveCalibration, Mistakes> {
    let mut sheet = Sheet::new(origin, text);
    match toml::from_str::<GloveCalibration>(text) {
        Ok(calibration) => {
            for problem in calibration.problems() {
                let (origin, message) = (origin.to_owned(), problem.to_string());
                sheet.fault_elsewhere(Mistake {
                    origin,
                    place: None,
                    key: String::new(),
                    message,
                });
            }
            sheet.into_mistakes().or_value(calibration)
        }
        Err(fault) => {
            sheet.fault(&fault.span().unwrap_or(0..0), "", fault.message().trim());
            Err(sheet.into_mistakes())
        }
    }
}

/// A mount as the table of a calibration file.
pub fn mount_text(mount: &MountOffset) -> String {
    let numbers = |values: &[f64]| {
        let rounded = values.iter().map(|value| (value * 1e6).round() / 1e6 + 0.0);
        let texts: Vec<String> = rounded.map(|value| format!("{value:?}")).collect();
        texts.join(", ")
    };
    format!(
        "[mount]\nposition_m = [{}]\nrotation_xyzw = [{}]\n",
        numbers(&mount.position_m),
        numbers(&mount.rotation_xyzw)
    )
}
