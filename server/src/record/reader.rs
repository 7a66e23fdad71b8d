//! Reads a recording from its start, also one that was cut off.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use mcap::McapError;
use mcap::io::MessageReader;
use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::RecordFault;
use super::channels::Topic;
use super::writer::METADATA_SESSION;
use crate::recorder_handle::Record;

/// Largest record or chunk that is read, in bytes; a damaged length must not fill the memory.
const RECORD_BYTES_MAX: usize = 512 << 20;

/// How a recording ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ending {
    /// It was finished.
    Complete,
    /// It stops: its writer was killed, or the file was cut. What came before is whole.
    Cut,
    /// It cannot be read on from here.
    Damaged(String),
}

impl fmt::Display for Ending {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Complete => write!(out, "complete"),
            Self::Cut => write!(
                out,
                "cut off: what came after the last message is lost, its index too"
            ),
            Self::Damaged(fault) => write!(out, "damaged: {fault}; what comes after is lost"),
        }
    }
}

/// The records of a recording, in the order of the file. It ends at the first that cannot be read;
/// [`RecordingReader::ending`] says which kind of end that was.
pub struct RecordingReader<R> {
    messages: MessageReader<Counted<R>>,
    n_read: Arc<AtomicU64>,
    has_end: bool,
    ending: Option<Ending>,
}

impl<R> fmt::Debug for RecordingReader<R> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("RecordingReader")
            .field("ending", &self.ending)
            .finish_non_exhaustive()
    }
}

/// Opens a recording.
///
/// # Errors
/// When the file cannot be opened or looked at.
pub fn open(path: &Path) -> Result<RecordingReader<BufReader<File>>, RecordFault> {
    let refuse = |source| RecordFault::Open {
        file: path.display().to_string(),
        source,
    };
    let mut file = File::open(path).map_err(refuse)?;
    let has_end = has_end(&mut file).map_err(refuse)?;
    Ok(RecordingReader::new(BufReader::new(file), has_end))
}

/// Reads a recording in memory.
pub fn from_bytes(bytes: &[u8]) -> RecordingReader<Cursor<&[u8]>> {
    RecordingReader::new(Cursor::new(bytes), bytes.ends_with(mcap::MAGIC))
}

/// What a recording says about its session: build, settings, command. Empty where it says nothing that can be read.
///
/// # Errors
/// When the file cannot be opened or read.
pub fn session(path: &Path) -> Result<BTreeMap<String, String>, RecordFault> {
    let refuse = |source| RecordFault::Open {
        file: path.display().to_string(),
        source,
    };
    let mut file = File::open(path).map_err(refuse)?;
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_emit_chunks(true)
        .with_record_length_limit(RECORD_BYTES_MAX);
    let mut reader = LinearReader::new_with_options(options);
    // It stands before the first chunk.
    while let Some(Ok(event)) = reader.next_event() {
        match event {
            LinearReadEvent::ReadRequest(need) => {
                let n = file.read(reader.insert(need)).map_err(refuse)?;
                reader.notify_read(n);
            }
            LinearReadEvent::Record {
                opcode: op::CHUNK, ..
            } => break,
            LinearReadEvent::Record { opcode, data } => {
                if let Ok(mcap::records::Record::Metadata(found)) = mcap::parse_record(opcode, data)
                    && found.name == METADATA_SESSION
                {
                    return Ok(found.metadata);
                }
            }
        }
    }
    Ok(BTreeMap::new())
}

/// Whether a file ends as a finished recording does; it is back at its start then.
fn has_end(file: &mut File) -> std::io::Result<bool> {
    let mut end = [0; mcap::MAGIC.len()];
    let length = file.seek(SeekFrom::End(0))?;
    if length >= end.len() as u64 {
        file.seek(SeekFrom::End(-(end.len() as i64)))?;
        file.read_exact(&mut end)?;
    }
    file.seek(SeekFrom::Start(0))?;
    Ok(end == mcap::MAGIC)
}

impl<R: Read> RecordingReader<R> {
    fn new(source: R, has_end: bool) -> Self {
        // A cut recording has no end to check; a damaged chunk must be known as such before a message of it is believed.
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_record_length_limit(RECORD_BYTES_MAX);
        let n_read = Arc::new(AtomicU64::new(0));
        let source = Counted {
            source,
            n_read: Arc::clone(&n_read),
        };
        Self {
            messages: MessageReader::new_with_options(source, options),
            n_read,
            has_end,
            ending: None,
        }
    }

    /// Bytes read so far, for progress.
    pub fn n_read(&self) -> u64 {
        self.n_read.load(Ordering::Relaxed)
    }

    /// How it ended; `None` before the last record was taken.
    pub const fn ending(&self) -> Option<&Ending> {
        self.ending.as_ref()
    }

    fn end(&mut self, fault: Option<McapError>) {
        self.ending = Some(match fault {
            None if self.has_end => Ending::Complete,
            None => Ending::Cut,
            Some(McapError::UnexpectedEof) if !self.has_end => Ending::Cut,
            Some(fault) => Ending::Damaged(fault.to_string()),
        });
    }
}

impl<R: Read> Iterator for RecordingReader<R> {
    type Item = Record;

    fn next(&mut self) -> Option<Record> {
        while self.ending.is_none() {
            let message = match self.messages.next() {
                Some(Ok(message)) => message,
                Some(Err(fault)) => {
                    self.end(Some(fault));
                    break;
                }
                None => {
                    self.end(None);
                    break;
                }
            };
            // Channels that we do not know are another tool's business.
            let Some(topic) = Topic::from_name(&message.channel.topic) else {
                continue;
            };
            match topic.decode(&message.data) {
                Ok(item) => {
                    return Some(Record {
                        wall_ns: message.log_time,
                        item,
                    });
                }
                Err(fault) => {
                    self.ending = Some(Ending::Damaged(format!(
                        "a message on {}: {fault}",
                        topic.name()
                    )));
                }
            }
        }
        None
    }
}

/// Counts the bytes that are read through it.
struct Counted<R> {
    source: R,
    n_read: Arc<AtomicU64>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n = self.source.read(buffer)?;
        self.n_read.fetch_add(n as u64, Ordering::Relaxed);
        Ok(n)
    }
}
