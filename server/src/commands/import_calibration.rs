//! `tsukamud import` of calibration files.

use std::io::{BufRead, IsTerminal, Write, stderr, stdin};
use std::path::Path;

use anyhow::Context;
use tsukamu_devices::calibration::import::{ImportFormat, Imported, SHOWN_COUNTS, import};
use tsukamu_devices::glove::calibrate::Handedness;

use super::Failure;
use super::output::{count, say, tell};

/// What goes into a calibration beside the file's own numbers.
#[derive(Clone, Debug)]
pub(super) struct Wearing<'a> {
    /// Who wears the glove.
    pub(super) wearer: &'a str,
    /// Which hand.
    pub(super) hand: Option<Handedness>,
    /// Whether the angles need not be confirmed.
    pub(super) is_confirmed: bool,
}

/// Turns a calibration of another program into one of ours, and shows what it comes to.
pub(super) fn import_calibration(
    format: ImportFormat,
    file: &Path,
    output: &Path,
    wearing: &Wearing<'_>,
) -> Result<(), Failure> {
    let name = file.display();
    let bytes = std::fs::read(file).with_context(|| name.to_string())?;
    // Old files are Latin-1 in their comments; the numbers are ASCII.
    let text = String::from_utf8_lossy(&bytes);
    let mut imported =
        import(format, &text).map_err(|fault| Failure::Usage(format!("{name}: {fault}")))?;
    for line in lines(&imported) {
        say(&line)?;
    }
    for note in &imported.notes {
        tell(&format!("{name}: {note}"));
    }
    if format == ImportFormat::VirtualHand && !wearing.is_confirmed {
        confirm()?;
    }
    wearing.wearer.clone_into(&mut imported.calibration.wearer);
    imported.calibration.hand = wearing.hand;
    let text = toml::to_string(&imported.calibration).context("writing the calibration")?;
    let text = format!("# Imported from {}.\n{text}", one_line(&name.to_string()));
    std::fs::write(output, text).with_context(|| output.display().to_string())?;
    let n_sensors = count(imported.sensors.len() as u64, "sensor");
    say(&format!("{}: {n_sensors}", output.display()))
}

/// A table of the angles that the sensors would read.
fn lines(imported: &Imported) -> Vec<String> {
    let [low, middle, high] = SHOWN_COUNTS;
    let mut lines = vec![format!(
        "{:<24}{:>10}{:>10}{:>10}{:>8}",
        "angle in degrees at",
        format!("raw {low}"),
        format!("raw {middle}"),
        format!("raw {high}"),
        "off by"
    )];
    lines.extend(imported.sensors.iter().map(|sensor| {
        let [low, middle, high] = sensor.angles_deg;
        let off = if sensor.error_deg < 0.05 {
            "-".to_owned()
        } else {
            format!("{:.1}", sensor.error_deg)
        };
        let name = sensor.sensor.name();
        format!("{name:<24}{low:>10.1}{middle:>10.1}{high:>10.1}{off:>8}")
    }));
    lines
}

/// Asks whether the angles are those of a hand; what the format means is not verified.
fn confirm() -> Result<(), Failure> {
    let doubt = "what a .cal file means is known from one reader only";
    if !stdin().is_terminal() {
        return Err(Failure::Usage(format!(
            "{doubt}: look at the angles above, and say --yes if they are those of this hand"
        )));
    }
    let question = format!("{doubt}. Are these the angles of this hand? [y/N] ");
    stderr()
        .write_all(question.as_bytes())
        .and_then(|()| stderr().flush())?;
    let mut answer = String::new();
    stdin().lock().read_line(&mut answer)?;
    if matches!(answer.trim().to_lowercase().as_str(), "y" | "yes") {
        Ok(())
    } else {
        tell("nothing is written");
        Err(Failure::Negative)
    }
}

fn one_line(text: &str) -> String {
    text.chars()
        .map(|letter| if letter.is_control() { ' ' } else { letter })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angles_are_shown_before_anything_is_written() {
        let folder = std::env::temp_dir().join(format!("tsukamu-import-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (file, output) = (folder.join("a.yaml"), folder.join("a.toml"));
        std::fs::write(&file, "G_IndexMPJ: [[0.307087, 0], [0.586614, 90]]").unwrap();
        let wearing = Wearing {
            wearer: "alice",
            hand: Some(Handedness::Left),
            is_confirmed: false,
        };
        import_calibration(ImportFormat::Shadow, &file, &output, &wearing).unwrap();
        let written = tsukamu_server::settings::calibration::load(&output).unwrap();
        assert_eq!(
            (written.wearer.as_str(), written.hand),
            ("alice", Some(Handedness::Left))
        );
        assert_eq!(written.sensors.len(), 1);
        let fault = import_calibration(ImportFormat::TwoPoint, &file, &output, &wearing);
        let Err(Failure::Usage(text)) = fault else {
            panic!("{fault:?}");
        };
        assert!(text.ends_with("has 1 lines where 22 are needed"), "{text}");
        std::fs::remove_dir_all(&folder).unwrap();
        let imported = import(
            ImportFormat::Shadow,
            "G_ThumbAb: [[0, 0], [0.5, 60], [1, 60]]",
        );
        let table = lines(&imported.unwrap());
        assert!(
            table[1].starts_with("thumb_abduction") && table[1].ends_with("20.0"),
            "{table:?}"
        );
    }
}
