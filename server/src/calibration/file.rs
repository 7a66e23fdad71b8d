//! Calibration files: written whole or not at all.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use tsukamu_devices::glove::calibrate::GloveCalibration;

use super::fault::CalibrationFault;

/// What stands above a file that the daemon writes.
const HEAD: &str = "# Written by `tsukamu calibrate`: angle = gain_deg_per_count * (raw - raw_at_zero), plus the coupling, \
                    held within min_deg and max_deg.\n";

/// One file at a time: two that are written at once would share the name of what is beside them.
static WRITING: Mutex<()> = Mutex::new(());

/// The text of a calibration file.
pub(super) fn text(calibration: &GloveCalibration) -> Result<String, CalibrationFault> {
    Ok(format!("{HEAD}{}", toml::to_string(calibration)?))
}

/// Whether a file that is there may be replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Replace {
    /// Only when it is of the same wearer, or says of none.
    SameWearer,
    /// Whoever's it is.
    Anyone,
}

/// Writes a wearer's calibration.
pub(super) fn save_calibration(
    file: &Path,
    calibration: &GloveCalibration,
    replace: Replace,
) -> Result<(), CalibrationFault> {
    let text = text(calibration)?;
    let _alone = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    if replace == Replace::SameWearer
        && let Some(wearer) = wearer_of(file)
        && wearer != calibration.wearer
    {
        let file = file.to_owned();
        return Err(CalibrationFault::OtherWearer { file, wearer });
    }
    put(file, &text)
}

/// Whose a file is; `None` where there is none, or it names nobody. One that cannot be read is of somebody.
fn wearer_of(file: &Path) -> Option<String> {
    let wearer = match fs::read_to_string(file) {
        Err(fault) if fault.kind() == io::ErrorKind::NotFound => return None,
        Err(fault) => return Some(format!("? ({fault})")),
        Ok(text) => match toml::from_str::<GloveCalibration>(&text) {
            Ok(calibration) => calibration.wearer,
            Err(_) => "? (it is no calibration)".to_owned(),
        },
    };
    (!wearer.is_empty()).then_some(wearer)
}

/// Writes a file by its side and puts it in its place, so that nobody ever finds half of it. A link stays a link.
pub(super) fn save(file: &Path, text: &str) -> Result<(), CalibrationFault> {
    let _alone = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    put(file, text)
}

/// The same for who writes alone.
fn put(file: &Path, text: &str) -> Result<(), CalibrationFault> {
    let refused = |source| CalibrationFault::File {
        file: file.to_owned(),
        source,
    };
    let target = match fs::canonicalize(file) {
        Err(fault) if fault.kind() == io::ErrorKind::NotFound => file.to_owned(),
        found => found.map_err(refused)?,
    };
    let mut beside = target.clone().into_os_string();
    beside.push(format!(".{}.new", std::process::id()));
    let written = write(Path::new(&beside), &target, text);
    if written.is_err() {
        // It may not even have been made.
        let _ = fs::remove_file(&beside);
    }
    written.map_err(refused)
}

fn write(beside: &Path, target: &Path, text: &str) -> io::Result<()> {
    let mut file = File::create(beside)?;
    file.write_all(text.as_bytes())?;
    if let Ok(about) = fs::metadata(target) {
        file.set_permissions(about.permissions())?;
    }
    file.sync_all()?;
    fs::rename(beside, target)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_written_at_once_are_whole() {
        let folder = std::env::temp_dir().join(format!("tsukamu-at-once-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let file = folder.join("room.toml");
        let texts = ["a".repeat(200_000), "b".repeat(100_000)];
        std::thread::scope(|scope| {
            for text in &texts {
                scope.spawn(|| (0..30).for_each(|_| save(&file, text).unwrap()));
            }
        });
        assert!(texts.contains(&fs::read_to_string(&file).unwrap()));
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_file_of_somebody_else_stays_unless_it_is_asked_for() {
        let folder = std::env::temp_dir().join(format!("tsukamu-wearer-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let file = folder.join("glove.toml");
        let of = |wearer: &str| GloveCalibration {
            wearer: wearer.to_owned(),
            ..GloveCalibration::default()
        };
        let save = |wearer: &str, replace| save_calibration(&file, &of(wearer), replace);
        save("", Replace::SameWearer).unwrap();
        save("alice", Replace::SameWearer).unwrap();
        save("alice", Replace::SameWearer).unwrap();
        let refused = save("bob", Replace::SameWearer).unwrap_err().to_string();
        assert!(
            refused.contains("is the calibration of \"alice\""),
            "{refused}"
        );
        assert_eq!(wearer_of(&file).as_deref(), Some("alice"));
        save("bob", Replace::Anyone).unwrap();
        fs::write(&file, "scene = 'demo'").unwrap();
        let refused = save("bob", Replace::SameWearer).unwrap_err().to_string();
        assert!(refused.contains("no calibration"), "{refused}");
        assert_eq!(
            fs::read_dir(&folder).unwrap().count(),
            1,
            "nothing is left beside it"
        );
        let nowhere = save_calibration(&folder.join("no/file"), &of("a"), Replace::SameWearer);
        assert!(matches!(nowhere, Err(CalibrationFault::File { .. })));
        fs::remove_dir_all(&folder).unwrap();
    }
}
