//! Makes a whole file, with index and end, of a recording that was cut off.

use std::path::Path;

use super::RecordFault;
use super::reader::{self, Ending};
use super::writer::{Existing, Finished, RecordingFile};

/// Copies everything that can be read into a new recording, and says how the old one ended.
///
/// # Errors
/// When the recording cannot be opened, or the new one cannot be written.
pub fn recover(from: &Path, to: &Path) -> Result<(Finished, Ending), RecordFault> {
    let mut recording = reader::open(from)?;
    let mut about = reader::session(from)?;
    about.insert("recovered_from".to_owned(), from.display().to_string());
    let mut file = RecordingFile::create(to, Existing::Keep, &about)?;
    for record in recording.by_ref() {
        file.write(&record)?;
    }
    let ending = recording.ending().cloned().unwrap_or(Ending::Complete);
    Ok((file.finish(0)?, ending))
}
