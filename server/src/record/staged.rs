//! A file to which only finished pieces go.
//!
//! The MCAP writer begins a chunk with a header that it fills in later. Were its bytes to reach the file as they come,
//! a process killed in between would leave a chunk that lies about its length. Here they wait in memory until the
//! writer flushes, which it does after finishing a chunk, and go to the file in one piece.

use std::fs::File;
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};

#[derive(Debug)]
pub(super) struct Staged {
    file: File,
    /// Bytes in the file.
    n_written: u64,
    /// Bytes that wait, and where among them the next one goes.
    waiting: Vec<u8>,
    cursor: usize,
}

impl Staged {
    pub(super) const fn new(file: File) -> Self {
        Self {
            file,
            n_written: 0,
            waiting: Vec::new(),
            cursor: 0,
        }
    }

    /// Bytes in the file and waiting.
    pub(super) const fn len(&self) -> u64 {
        self.n_written + self.waiting.len() as u64
    }
}

impl Write for Staged {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let overwritten = bytes.len().min(self.waiting.len() - self.cursor);
        self.waiting[self.cursor..self.cursor + overwritten].copy_from_slice(&bytes[..overwritten]);
        self.waiting.extend_from_slice(&bytes[overwritten..]);
        self.cursor += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.write_all(&self.waiting)?;
        self.n_written += self.waiting.len() as u64;
        self.waiting.clear();
        self.cursor = 0;
        Ok(())
    }
}

impl Seek for Staged {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let target = match to {
            SeekFrom::Start(offset) => Some(offset),
            SeekFrom::End(offset) => self.len().checked_add_signed(offset),
            SeekFrom::Current(offset) => {
                (self.n_written + self.cursor as u64).checked_add_signed(offset)
            }
        };
        let place = target.and_then(|target| target.checked_sub(self.n_written));
        let Some(place) = place.filter(|place| *place <= self.waiting.len() as u64) else {
            return Err(io::Error::new(
                ErrorKind::InvalidInput,
                "that part of the recording is in the file already",
            ));
        };
        self.cursor = place as usize;
        Ok(self.n_written + place)
    }
}
