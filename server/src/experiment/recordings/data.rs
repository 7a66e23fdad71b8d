//! Where the recordings are: they are no part of the project.

use std::path::{Path, PathBuf};

use tsukamu_motion::import::adroit::{self, AdroitOptions, AdroitPoints};
use tsukamu_motion::import::adroit_body::{AdroitBody, BodyRow, body_path};
use tsukamu_motion::mistake::ImportError;
use tsukamu_motion::track::HandTrack;

use super::SetName;

/// The folder of all sets, looked for beside and above the working directory.
const DATA: &str = "shared/data";

/// Why recordings cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum DataFault {
    /// There is no folder of sets.
    #[error(
        "the recordings are not here: looked for {looked_for}. They are no part of the project; name their folder with --data DIR"
    )]
    Absent {
        /// Where it was looked for.
        looked_for: String,
    },
    /// The folder has not this set.
    #[error("{folder}: there is no such folder; the set {set} is read from it")]
    NoSet {
        /// The folder.
        folder: String,
        /// The set.
        set: &'static str,
    },
    /// A file cannot be read.
    #[error("{file}: {source}")]
    Unreadable {
        /// The file.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file is not what it should be.
    #[error("{}", .mistakes.to_string().lines().map(|line| format!("{file}: {line}")).collect::<Vec<_>>().join("\n"))]
    Mistakes {
        /// The file.
        file: String,
        /// What is wrong in it.
        mistakes: ImportError,
    },
}

/// The folder of all sets: the given one, or `shared/data` in the working directory or the nearest folder above it.
///
/// # Errors
/// When there is none.
pub fn find(given: Option<&Path>) -> Result<PathBuf, DataFault> {
    if let Some(given) = given {
        let absent = || DataFault::Absent {
            looked_for: given.display().to_string(),
        };
        return given.is_dir().then(|| given.to_owned()).ok_or_else(absent);
    }
    let here = std::env::current_dir().unwrap_or_default();
    let found = here
        .ancestors()
        .map(|folder| folder.join(DATA))
        .find(|folder| folder.is_dir());
    let absent = || {
        let looked_for = format!("{DATA} in {} and every folder above it", here.display());
        DataFault::Absent { looked_for }
    };
    found.ok_or_else(absent)
}

/// The folder of one set.
///
/// # Errors
/// When it is not there.
pub fn set_folder(data: &Path, set: SetName) -> Result<PathBuf, DataFault> {
    let folder = data.join(set.folder());
    if folder.is_dir() {
        return Ok(folder);
    }
    Err(DataFault::NoSet {
        folder: folder.display().to_string(),
        set: set.name(),
    })
}

/// The text of a file, or none where there is no such file.
pub(super) fn text_of(folder: &Path, file: &str) -> Result<Option<String>, DataFault> {
    let path = folder.join(file);
    match std::fs::read_to_string(&path) {
        Ok(text) => Ok(Some(text)),
        Err(fault) if fault.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(DataFault::Unreadable {
            file: path.display().to_string(),
            source,
        }),
    }
}

/// The set's table of results.
pub(super) fn reference_text(folder: &Path) -> Result<String, DataFault> {
    let file = "reference.csv";
    let absent = || DataFault::Absent {
        looked_for: folder.join(file).display().to_string(),
    };
    text_of(folder, file)?.ok_or_else(absent)
}

/// What an importer made of a file, with the file's name in its mistakes.
pub(super) fn read<T>(
    folder: &Path,
    file: &str,
    read: Result<T, ImportError>,
) -> Result<T, DataFault> {
    read.map_err(|mistakes| DataFault::Mistakes {
        file: folder.join(file).display().to_string(),
        mistakes,
    })
}

/// The hand of one Adroit recording and the path of a body in it; `None` where its file is not in the folder.
///
/// # Errors
/// When the file cannot be read or is not what it should be.
pub fn adroit_run(
    folder: &Path,
    demo: &str,
    points: AdroitPoints,
    body: AdroitBody,
) -> Result<Option<(HandTrack, Vec<BodyRow>)>, DataFault> {
    let file = format!("{demo}.csv");
    let Some(text) = text_of(folder, &file)? else {
        return Ok(None);
    };
    let track = read(
        folder,
        &file,
        adroit::import(&text, &AdroitOptions { points }),
    )?;
    let path = read(folder, &file, body_path(&text, body))?;
    Ok(Some((track, path)))
}
