//! The daemon's folder of recordings: begins one, ends it, lists them, opens one to be played.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{SystemTime, UNIX_EPOCH};

use thiserror::Error;
use tokio::sync::Mutex;
use tokio::task::JoinError;
use tracing::{info, warn};
use tsukamu_proto::v1;

use crate::record::RecordFault;
use crate::record::beginning::{BeginningFault, world_at};
use crate::record::reader;
use crate::record::writer::{Existing, Finished, RecordingFile, RecordingThread};
use crate::recorder_handle::{Record, RecordItem, RecordOptions, RecorderHandle};
use crate::ticker::request::{Beginning, Plan, Played, Refusal, Request, TickerHandle};

/// Recorded inputs that are read ahead of the world.
const READ_AHEAD: usize = 1024;
/// What recordings end in.
const EXTENSION: &str = "mcap";

/// Why something about recordings cannot be done.
#[derive(Debug, Error)]
pub enum DeskFault {
    /// A name with a path in it, or that is no file name.
    #[error("{0:?} is no name of a recording: give a file name without a path")]
    Name(String),
    /// There is none of that name.
    #[error("there is no recording {0:?}")]
    Absent(String),
    /// There is one of that name.
    #[error("a recording of that name is there already: {0}; choose another")]
    Taken(String),
    /// The folder cannot be used.
    #[error("{}: {source}", .folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Writing or reading failed.
    #[error(transparent)]
    Record(#[from] RecordFault),
    /// The recording does not begin with a scene.
    #[error("the recording begins without a scene")]
    NoScene,
    /// It cannot begin as it says.
    #[error("the recording cannot be played: {0}")]
    Beginning(#[from] BeginningFault),
    /// The tick thread refuses.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// Work on another thread failed.
    #[error(transparent)]
    Thread(#[from] JoinError),
}

/// The folder, and the recording under way.
#[derive(Debug)]
pub struct RecordingDesk {
    folder: PathBuf,
    session: BTreeMap<String, String>,
    open: Mutex<Option<(String, RecordingThread)>>,
}

impl RecordingDesk {
    /// Recordings of that folder; it is made when the first begins. `session` is for people and goes into each.
    pub fn new(folder: PathBuf, session: BTreeMap<String, String>) -> Self {
        Self {
            folder,
            session,
            open: Mutex::new(None),
        }
    }

    /// Begins to record, from the world as it stands or with a new epoch. An empty name takes one from the time.
    ///
    /// # Errors
    /// When one is under way, the name is no file name or taken, or the file cannot be made.
    pub async fn start(
        &self,
        ticker: &TickerHandle,
        name: String,
        options: RecordOptions,
        beginning: Beginning,
    ) -> Result<(v1::Stamp, String), DeskFault> {
        let mut open = self.open.lock().await;
        if let Some((name, _)) = open.as_ref() {
            return Err(Refusal::Recording(name.clone()).into());
        }
        let name = file_name(name)?;
        let path = self.folder.join(&name);
        let (folder, session, target) = (self.folder.clone(), self.session.clone(), path.clone());
        let taken = name.clone();
        let file = tokio::task::spawn_blocking(move || {
            std::fs::create_dir_all(&folder)
                .map_err(|source| DeskFault::Folder { folder, source })?;
            let created = RecordingFile::create(&target, Existing::Keep, &session);
            created.map_err(|fault| refused(fault, taken))
        });
        let file = file.await??;
        let (recorder, records) = RecorderHandle::channel(options);
        let thread = RecordingThread::spawn(file, records, recorder.dropped_counter());
        let asked = ticker
            .ask(|reply| Request::Record {
                recorder,
                name: name.clone(),
                beginning,
                reply,
            })
            .await;
        match asked {
            Ok(stamp) => {
                info!(file = %path.display(), "recording");
                *open = Some((name.clone(), thread));
                Ok((stamp, name))
            }
            Err(refusal) => {
                finish(thread).await?;
                // Nothing is in it.
                let _ = std::fs::remove_file(&path);
                Err(refusal.into())
            }
        }
    }

    /// Ends the recording under way and waits until it is on the disk.
    ///
    /// # Errors
    /// When there is none, or writing failed.
    pub async fn stop(
        &self,
        ticker: &TickerHandle,
    ) -> Result<(v1::Stamp, String, Finished), DeskFault> {
        let mut open = self.open.lock().await;
        if open.is_none() {
            return Err(Refusal::NotRecording.into());
        }
        // Only then: a tick thread that is too busy to stop goes on recording.
        let stamp = ticker.ask(Request::StopRecording).await?;
        let (name, thread) = open.take().ok_or(Refusal::NotRecording)?;
        let written = finish(thread).await?;
        info!(
            name,
            written.bytes, written.messages, written.dropped, "recorded"
        );
        Ok((stamp, name, written))
    }

    /// Waits until the recording under way is on the disk; the tick thread and the publisher have ended.
    ///
    /// # Errors
    /// When writing failed.
    pub async fn drain(&self) -> Result<Option<(String, Finished)>, DeskFault> {
        let open = self.open.lock().await.take();
        let Some((name, thread)) = open else {
            return Ok(None);
        };
        let written = finish(thread).await?;
        info!(
            name,
            written.bytes, written.messages, written.dropped, "recorded"
        );
        Ok(Some((name, written)))
    }

    /// The recordings of the folder, by name. Reads the disk: not for async code.
    ///
    /// # Errors
    /// When the folder cannot be read; one that is not there is empty.
    pub fn list(&self) -> Result<Vec<v1::Recording>, DeskFault> {
        let refused = |source| DeskFault::Folder {
            folder: self.folder.clone(),
            source,
        };
        let entries = match std::fs::read_dir(&self.folder) {
            Err(fault) if fault.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries.map_err(refused)?,
        };
        let mut list = Vec::new();
        for entry in entries {
            let path = entry.map_err(refused)?.path();
            // A file that has just gone is not in the list.
            if path
                .extension()
                .is_some_and(|extension| extension == EXTENSION)
            {
                list.extend(described(&path));
            }
        }
        list.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(list)
    }

    /// What an epoch begins with that plays a recording, one epoch after the other. Reads the disk: not for async code.
    ///
    /// # Errors
    /// When there is no such recording, or it does not begin with a scene that can be run.
    pub fn playback(&self, name: &str) -> Result<Plan, DeskFault> {
        let path = self.folder.join(checked(name)?);
        if !path.is_file() {
            return Err(DeskFault::Absent(name.to_owned()));
        }
        let mut records = reader::open(&path)?;
        let record = records
            .find_map(|record| match record.item {
                RecordItem::Scene(scene) => Some(scene),
                _ => None,
            })
            .ok_or(DeskFault::NoScene)?;
        let world = world_at(&record)?;
        let playback = Some(read_ahead(records).map_err(|source| DeskFault::Folder {
            folder: path,
            source,
        })?);
        Ok(Plan {
            world: Box::new(world),
            record: *record,
            hands: Vec::new(),
            repeats: false,
            playback,
        })
    }
}

async fn finish(thread: RecordingThread) -> Result<Finished, DeskFault> {
    Ok(tokio::task::spawn_blocking(move || thread.finish()).await??)
}

/// Reads on a thread of its own, which ends with the recording or with the world that takes it.
fn read_ahead(
    records: impl Iterator<Item = Record> + Send + 'static,
) -> io::Result<Receiver<Played>> {
    let (sender, receiver) = sync_channel(READ_AHEAD);
    let work = move || {
        for record in records {
            let played = match record.item {
                RecordItem::Input(input) => Played::Input(input),
                RecordItem::Scene(record) => match world_at(&record) {
                    Ok(world) => Played::Epoch(Box::new(world), record),
                    Err(fault) => {
                        warn!(epoch = record.epoch, %fault, "the recording cannot be played on");
                        return;
                    }
                },
                _ => continue,
            };
            if sender.send(played).is_err() {
                return;
            }
        }
    };
    std::thread::Builder::new()
        .name("playback".to_owned())
        .spawn(work)?;
    Ok(receiver)
}

/// Why a new recording of that name is not begun.
fn refused(fault: RecordFault, name: String) -> DeskFault {
    match fault {
        RecordFault::Open { source, .. } if source.kind() == io::ErrorKind::AlreadyExists => {
            DeskFault::Taken(name)
        }
        fault => fault.into(),
    }
}

/// A file name for a new recording.
fn file_name(name: String) -> Result<String, DeskFault> {
    if name.is_empty() {
        let since = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        return Ok(format!("tsukamu-{}.{EXTENSION}", since.as_millis()));
    }
    let name = if name.ends_with(".mcap") {
        name
    } else {
        format!("{name}.{EXTENSION}")
    };
    checked(&name)?;
    Ok(name)
}

/// A name that stays in the folder.
fn checked(name: &str) -> Result<&str, DeskFault> {
    let is_plain =
        Path::new(name).file_name().is_some_and(|file| file == name) && !name.starts_with('.');
    if is_plain && name.len() <= 200 && !name.contains(char::is_control) {
        Ok(name)
    } else {
        Err(DeskFault::Name(name.to_owned()))
    }
}

fn described(path: &Path) -> Option<v1::Recording> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    let about = std::fs::metadata(path)
        .inspect_err(|fault| warn!(name, %fault, "recording"))
        .ok()?;
    let modified = about
        .modified()
        .ok()
        .and_then(|time| time.duration_since(UNIX_EPOCH).ok())
        .unwrap_or_default();
    Some(v1::Recording {
        name,
        bytes: about.len(),
        modified_ns: modified.as_nanos() as u64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_the_folder() {
        for bad in [
            "../a.mcap",
            "/etc/passwd",
            "a/b",
            "..",
            ".hidden",
            "",
            "a\0b",
            "a\nb",
        ] {
            assert!(checked(bad).is_err(), "{bad:?}");
        }
        assert_eq!(
            file_name("run 1".to_owned()).ok().as_deref(),
            Some("run 1.mcap")
        );
        assert_eq!(
            file_name("a.mcap".to_owned()).ok().as_deref(),
            Some("a.mcap")
        );
        assert!(file_name(String::new()).is_ok_and(|name| name.starts_with("tsukamu-")));
    }
}
