//! What the running daemon hands to a recording, and how: through a bounded channel that the tick never waits on, except
//! in lockstep, where it has the time.
//!
//! The tick loop and the publisher hold a [`RecorderHandle`](crate::recorder_handle::RecorderHandle); a writer thread holds the other end of the channel.
//! When the channel is full the item is dropped and counted, and the recording has to say so itself.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use bytes::Bytes;
use tsukamu_proto::v1;

/// Items that wait for the writer, at most: at 4000 steps per second and two items per step, one second.
pub const QUEUE_CAPACITY: usize = 8192;

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
    dropped: Arc<AtomicU64>,
    options: RecordOptions,
    is_patient: bool,
}

impl RecorderHandle {
    /// A handle and the writer's end of its channel. The writer is done when every handle is gone.
    pub fn channel(options: RecordOptions) -> (Self, Receiver<Record>) {
        let (items, receiver) = sync_channel(QUEUE_CAPACITY);
        (
            Self {
                items,
                dropped: Arc::new(AtomicU64::new(0)),
                options,
                is_patient: false,
            },
            receiver,
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
        let record = Record { wall_ns, item };
        let is_taken = if self.is_patient {
            self.items.send(record).is_ok()
        } else {
            self.items.try_send(record).is_ok()
        };
        if !is_taken {
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
        assert_eq!(receiver.iter().count(), QUEUE_CAPACITY);
    }
}
