//! What the running daemon hands to a recording, and how: through a bounded channel that the tick never waits on, except
//! in lockstep, where it has the time.
//!
//! The tick loop and the publisher hold a [`RecorderHandle`](crate::recorder_handle::RecorderHandle); a writer thread holds the other end of the channel.
//! When the channel is full the item is dropped and counted, and the recording has to say so itself.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

use bytes::Bytes;
use tsukamu_proto::v1;

/// Items that wait for the writer, at most: at 4000 steps per second and two items per step, one second.
pub const QUEUE_CAPACITY: usize = 8192;
/// Raw bytes and samples among them, at most: a device that floods must not cost the inputs, without which nothing can be
/// replayed.
const RAW_CAPACITY: usize = QUEUE_CAPACITY / 2;

/// One thing to be written, with the time it carries in the file.
#[derive(Clone, Debug)]
pub struct Record {
    /// Nanoseconds since the Unix epoch by the daemon's clock, or by world time when offline.
    pub wall_ns: u64,
    /// What it is.
    pub item: RecordItem,
}

/// What a recording holds.
#[derive(Clone, Debug)]
pub enum RecordItem {
    /// A new epoch begins.
    Scene(Box<v1::SceneRecord>),
    /// Everything that entered one step.
    Input(v1::StepInput),
    /// An encoded `Event`.
    Event(Bytes),
    /// The world's digest after a tick.
    Digest(v1::Digest),
    /// An encoded `Frame` (not `WatchFramesResponse`).
    Frame(Bytes),
    /// Bytes of a port as they came.
    Raw(v1::RawBytes),
    /// A sample of a source at its native rate.
    Sample(v1::RawSample),
}

/// What a recording holds beyond scenes, inputs, events and digests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecordOptions {
    /// Every published frame.
    pub frames: bool,
    /// The raw bytes of the serial ports, and every source's samples at their native rate.
    pub raw: bool,
}

/// The sending end: cheap to clone, never waits.
#[derive(Clone, Debug)]
pub struct RecorderHandle {
    items: SyncSender<Record>,
    /// Raw bytes and samples that wait.
    n_raw: Arc<AtomicUsize>,
    dropped: Arc<AtomicU64>,
    options: RecordOptions,
    is_patient: bool,
}

/// The writer's end of the channel.
#[derive(Debug)]
pub struct Records {
    items: Receiver<Record>,
    n_raw: Arc<AtomicUsize>,
}

impl Records {
    /// The next item, waiting for it at most so long.
    ///
    /// # Errors
    /// When none came in that time, or every handle is gone.
    pub fn recv_timeout(&self, wait: Duration) -> Result<Record, RecvTimeoutError> {
        let record = self.items.recv_timeout(wait)?;
        if record.item.is_raw() {
            self.n_raw.fetch_sub(1, Ordering::Relaxed);
        }
        Ok(record)
    }
}

impl RecordItem {
    /// Whether it is of a device and no part of the world's own history.
    const fn is_raw(&self) -> bool {
        matches!(self, Self::Raw(_) | Self::Sample(_))
    }
}

impl RecorderHandle {
    /// A handle and the writer's end of its channel. The writer is done when every handle is gone.
    pub fn channel(options: RecordOptions) -> (Self, Records) {
        let (items, receiver) = sync_channel(QUEUE_CAPACITY);
        let n_raw = Arc::new(AtomicUsize::new(0));
        let records = Records {
            items: receiver,
            n_raw: Arc::clone(&n_raw),
        };
        (
            Self {
                items,
                n_raw,
                dropped: Arc::new(AtomicU64::new(0)),
                options,
                is_patient: false,
            },
            records,
        )
    }

    /// The same, but waiting for the writer where that is behind: for worlds that no clock drives.
    pub fn patient(self) -> Self {
        Self {
            is_patient: true,
            ..self
        }
    }

    /// The same, never waiting: for the threads of devices, which have no time in any world.
    pub fn impatient(self) -> Self {
        Self {
            is_patient: false,
            ..self
        }
    }

    /// Hands over an item, or drops and counts it when the writer is behind or gone; a patient one drops it only when
    /// the writer is gone.
    pub fn offer(&self, wall_ns: u64, item: RecordItem) {
        let is_raw = item.is_raw();
        // Counted before it can be taken out; between two threads it may be one too many for a moment.
        let n_before = self.n_raw.fetch_add(usize::from(is_raw), Ordering::Relaxed);
        let record = Record { wall_ns, item };
        let is_taken = if self.is_patient {
            self.items.send(record).is_ok()
        } else {
            let has_room = !is_raw || n_before < RAW_CAPACITY;
            has_room && self.items.try_send(record).is_ok()
        };
        if !is_taken {
            self.n_raw.fetch_sub(usize::from(is_raw), Ordering::Relaxed);
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// What is asked for.
    pub const fn options(&self) -> RecordOptions {
        self.options
    }

    /// Items dropped so far; shared by all clones.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// The counter behind [`RecorderHandle::dropped`], for the writer, which outlives the handles.
    pub fn dropped_counter(&self) -> Arc<AtomicU64> {
        Arc::clone(&self.dropped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_writer_costs_items_and_no_time() {
        let (handle, receiver) = RecorderHandle::channel(RecordOptions::default());
        for tick in 0..QUEUE_CAPACITY as u64 + 3 {
            handle.offer(
                tick,
                RecordItem::Digest(v1::Digest {
                    epoch: 1,
                    tick,
                    digest: tick,
                }),
            );
        }
        assert_eq!(handle.dropped(), 3);
        let handle = handle.patient().impatient();
        handle.offer(0, RecordItem::Raw(v1::RawBytes::default()));
        assert_eq!(handle.dropped(), 4, "it did not wait");
        drop(handle);
        assert_eq!(count(&receiver), QUEUE_CAPACITY);
    }

    /// Takes out all that waits.
    fn count(records: &Records) -> usize {
        std::iter::from_fn(|| records.recv_timeout(Duration::ZERO).ok()).count()
    }

    #[test]
    fn a_device_that_floods_costs_no_input() {
        let (handle, records) = RecorderHandle::channel(RecordOptions::default());
        for round in 1..=2 {
            for _ in 0..2 * QUEUE_CAPACITY {
                handle.offer(0, RecordItem::Raw(v1::RawBytes::default()));
            }
            let n_dropped = round * (2 * QUEUE_CAPACITY - RAW_CAPACITY) as u64;
            assert_eq!(handle.dropped(), n_dropped);
            for tick in 0..1000 {
                handle.offer(tick, RecordItem::Input(v1::StepInput::default()));
            }
            assert_eq!(handle.dropped(), n_dropped, "every input is there");
            assert_eq!(count(&records), RAW_CAPACITY + 1000);
        }
    }
}
