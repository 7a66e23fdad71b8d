//! Writes a recording, at once or on a thread of its own.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions, Writer};
use tracing::error;
use tsukamu_proto::v1;

use super::RecordFault;
use super::channels::{Topic, encode, schema_bytes};
use super::staged::Staged;
use crate::recorder_handle::{Record, RecordItem, Records};

/// How often what was recorded goes to the disk: what a `kill -9` can cost, with a margin to the promised second.
const SYNC_PERIOD: Duration = Duration::from_millis(500);
/// Bytes that may wait in memory before they go to the file, whatever the time.
const WAITING_MAX: usize = 4 << 20;
/// Bytes of messages in one chunk before it is compressed and finished.
const CHUNK_BYTES: u64 = 1 << 20;
/// Name of the metadata record that opens a recording: build, settings, session.
pub const METADATA_SESSION: &str = "tsukamu.session";
/// Name of the metadata record that closes one: counts of messages and of those that were dropped.
pub const METADATA_END: &str = "tsukamu.end";

/// What to do with a file that is there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// Refuse to record.
    Keep,
    /// Write over it.
    Replace,
}

/// A recording that is being written.
pub struct RecordingFile {
    writer: Writer<Staged>,
    /// A second handle of the file, to sync it: the writer keeps the first.
    on_disk: File,
    /// Channel ids by topic, in [`Topic::ALL`] order.
    channels: [u16; Topic::ALL.len()],
    n_messages: u64,
    /// Bytes of messages since the last flush.
    n_unflushed: usize,
    buffer: Vec<u8>,
}

impl fmt::Debug for RecordingFile {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("RecordingFile")
            .field("n_messages", &self.n_messages)
            .finish_non_exhaustive()
    }
}

/// What a finished recording holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Finished {
    /// Size of the file, in bytes.
    pub bytes: u64,
    /// Messages written.
    pub messages: u64,
    /// Messages that never came to the writer because it was behind; the recording says so itself.
    pub dropped: u64,
}

/// A recording that is written on a thread of its own.
#[derive(Debug)]
pub struct RecordingThread(JoinHandle<Result<Finished, RecordFault>>);

impl RecordingFile {
    /// Begins a recording. `session` is for people: settings and whatever tells this session from others; the
    /// build is added.
    ///
    /// # Errors
    /// When the file cannot be made or written.
    pub fn create(
        path: &Path,
        existing: Existing,
        session: &BTreeMap<String, String>,
    ) -> Result<Self, RecordFault> {
        let mut options = OpenOptions::new();
        options.write(true);
        match existing {
            Existing::Keep => options.create_new(true),
            Existing::Replace => options.create(true).truncate(true),
        };
        let refuse = |source| RecordFault::Open {
            file: path.display().to_string(),
            source,
        };
        let file = options.open(path).map_err(refuse)?;
        let on_disk = file.try_clone().map_err(refuse)?;
        let options = WriteOptions::new()
            .compression(Some(Compression::Zstd))
            .chunk_size(Some(CHUNK_BYTES))
            .profile("tsukamu")
            .library(concat!("tsukamu ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(Staged::new(file))?;
        let mut metadata = session.clone();
        // A recovered recording keeps the build that made its digests.
        metadata.entry("build".to_owned()).or_insert_with(build);
        writer.write_metadata(&Metadata {
            name: METADATA_SESSION.to_owned(),
            metadata,
        })?;
        let schema = schema_bytes();
        let mut channels = [0; Topic::ALL.len()];
        for (id, topic) in channels.iter_mut().zip(Topic::ALL) {
            let schema = writer.add_schema(topic.schema(), "protobuf", &schema)?;
            *id = writer.add_channel(schema, topic.name(), "protobuf", &BTreeMap::new())?;
        }
        Ok(Self {
            writer,
            on_disk,
            channels,
            n_messages: 0,
            n_unflushed: 0,
            buffer: Vec::new(),
        })
    }

    /// Appends one message; a scene's text is attached too.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&mut self, record: &Record) -> Result<(), RecordFault> {
        if let RecordItem::Scene(scene) = &record.item {
            self.attach_text(record.wall_ns, scene)?;
        }
        encode(&record.item, &mut self.buffer);
        let header = MessageHeader {
            channel_id: self.channels[Topic::of(&record.item) as usize],
            sequence: self.n_messages as u32,
            log_time: record.wall_ns,
            publish_time: record.wall_ns,
        };
        self.writer.write_to_known_channel(&header, &self.buffer)?;
        self.n_messages += 1;
        self.n_unflushed += self.buffer.len();
        if self.n_unflushed > WAITING_MAX {
            self.flush()?;
        }
        Ok(())
    }

    /// Brings everything so far to the disk.
    ///
    /// # Errors
    /// When the file cannot be written or synced.
    pub fn sync(&mut self) -> Result<(), RecordFault> {
        self.flush()?;
        self.on_disk.sync_data()?;
        Ok(())
    }

    /// Writes counts, index and end.
    ///
    /// # Errors
    /// When the file cannot be written or synced.
    pub fn finish(mut self, dropped: u64) -> Result<Finished, RecordFault> {
        let counts = [("messages", self.n_messages), ("dropped", dropped)];
        let metadata = counts
            .map(|(name, count)| (name.to_owned(), count.to_string()))
            .into();
        self.writer.write_metadata(&Metadata {
            name: METADATA_END.to_owned(),
            metadata,
        })?;
        self.writer.finish()?;
        let mut staged = self.writer.into_inner();
        staged.flush()?;
        self.on_disk.sync_data()?;
        Ok(Finished {
            bytes: staged.len(),
            messages: self.n_messages,
            dropped,
        })
    }

    fn attach_text(&mut self, wall_ns: u64, scene: &v1::SceneRecord) -> Result<(), RecordFault> {
        let attachment = Attachment {
            log_time: wall_ns,
            create_time: wall_ns,
            name: format!("scene-{}.toml", scene.epoch),
            media_type: "application/toml".to_owned(),
            data: scene.source_text.as_bytes().into(),
        };
        self.writer.attach(&attachment)?;
        Ok(())
    }

    /// Finishes the chunk and hands it to the system.
    fn flush(&mut self) -> Result<(), RecordFault> {
        self.writer.flush()?;
        self.n_unflushed = 0;
        Ok(())
    }
}

impl RecordingThread {
    /// Writes what comes through the channel until every sender is gone. `dropped` counts what did not come through.
    pub fn spawn(file: RecordingFile, records: Records, dropped: Arc<AtomicU64>) -> Self {
        Self(std::thread::spawn(move || {
            // Who stops the recording is told too; until then nobody would know.
            write_all(file, &records, &dropped)
                .inspect_err(|fault| error!(%fault, "the recording cannot be written on"))
        }))
    }

    /// Waits for the end of the file. Every sender must be gone, or this waits for them.
    ///
    /// # Errors
    /// When writing failed, now or earlier.
    pub fn finish(self) -> Result<Finished, RecordFault> {
        self.0.join().unwrap_or(Err(RecordFault::Panicked))
    }
}

fn write_all(
    mut file: RecordingFile,
    records: &Records,
    dropped: &AtomicU64,
) -> Result<Finished, RecordFault> {
    let mut next_sync = Instant::now() + SYNC_PERIOD;
    loop {
        match records.recv_timeout(next_sync.saturating_duration_since(Instant::now())) {
            Ok(record) => file.write(&record)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if Instant::now() >= next_sync {
            file.sync()?;
            next_sync = Instant::now() + SYNC_PERIOD;
        }
    }
    file.finish(dropped.load(Ordering::Relaxed))
}

/// What wrote a recording: digests are the same for equal builds, and only for them.
pub fn build() -> String {
    let profile = if cfg!(debug_assertions) {
        "debug"
    } else {
        "release"
    };
    format!(
        "tsukamu {} {profile} {}",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH
    )
}
