//! The event lane: a bounded log of encoded events, numbered without gaps, that any number of subscribers follow.
//!
//! One [`EventWriter`](crate::event_log::EventWriter) appends; it never waits for a reader. A reader that falls behind the log is told so, with the
//! oldest number that is left.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use futures_core::Stream;
use tokio::sync::watch;
use tonic::Status;

use crate::wire_message::WireMessage;

/// Events that one look into the log takes out at most, so that a reader holds the lock for microseconds.
const BATCH: usize = 64;

/// The readers' side; cheap to clone.
#[derive(Clone, Debug)]
pub struct EventLog {
    ring: Arc<Mutex<Ring>>,
    next: watch::Receiver<u64>,
}

/// The writer's side. When it is dropped, subscribers get what is left and then end.
#[derive(Debug)]
pub struct EventWriter {
    ring: Arc<Mutex<Ring>>,
    next: watch::Sender<u64>,
}

#[derive(Debug)]
struct Ring {
    events: VecDeque<WireMessage>,
    /// Sequence number of the first event held, or of the next one when none is.
    oldest: u64,
    capacity: usize,
}

impl Ring {
    fn next(&self) -> u64 {
        self.oldest + self.events.len() as u64
    }
}

/// A log that holds at most `capacity` events, at least one.
pub fn event_log(capacity: usize) -> (EventWriter, EventLog) {
    let ring = Ring {
        events: VecDeque::new(),
        oldest: 1,
        capacity: capacity.max(1),
    };
    let ring = Arc::new(Mutex::new(ring));
    let (sender, receiver) = watch::channel(1);
    (
        EventWriter {
            ring: Arc::clone(&ring),
            next: sender,
        },
        EventLog {
            ring,
            next: receiver,
        },
    )
}

impl EventWriter {
    /// The number of the event that comes next.
    pub fn next_sequence(&self) -> u64 {
        lock(&self.ring).next()
    }

    /// Appends events that carry the numbers from [`EventWriter::next_sequence`] on, and wakes the subscribers.
    pub fn append(&self, events: impl Iterator<Item = WireMessage>) {
        let next = {
            let mut ring = lock(&self.ring);
            for event in events {
                if ring.events.len() == ring.capacity {
                    ring.events.pop_front();
                    ring.oldest += 1;
                }
                ring.events.push_back(event);
            }
            ring.next()
        };
        self.next.send_replace(next);
    }
}

impl EventLog {
    /// Events from that number on, 0 for the next that happens. It ends when the daemon stops.
    ///
    /// # Errors
    /// `OUT_OF_RANGE` at once when the log no longer holds that event, or has not come to it; in the stream when the
    /// reader falls behind the log.
    pub fn watch(
        &self,
        from_sequence: u64,
    ) -> Result<impl Stream<Item = Result<WireMessage, Status>> + Send + use<>, Status> {
        let (oldest, next) = {
            let ring = lock(&self.ring);
            (ring.oldest, ring.next())
        };
        let first = if from_sequence == 0 {
            next
        } else {
            from_sequence
        };
        if first < oldest {
            return Err(lost(first, oldest));
        }
        if first > next {
            return Err(Status::out_of_range(format!(
                "event {first} has not happened: the next one is {next}; was the daemon started anew?"
            )));
        }
        let reader = Reader {
            ring: Arc::clone(&self.ring),
            next: self.next.clone(),
            sequence: first,
            batch: VecDeque::new(),
        };
        Ok(futures_util::stream::unfold(Some(reader), |reader| async {
            reader?.next().await
        }))
    }

    /// Number of events so far.
    pub fn n_events(&self) -> u64 {
        lock(&self.ring).next() - 1
    }
}

#[derive(Debug)]
struct Reader {
    ring: Arc<Mutex<Ring>>,
    next: watch::Receiver<u64>,
    sequence: u64,
    batch: VecDeque<WireMessage>,
}

type Item = (Result<WireMessage, Status>, Option<Reader>);

impl Reader {
    async fn next(mut self) -> Option<Item> {
        loop {
            if let Some(event) = self.batch.pop_front() {
                self.sequence += 1;
                return Some((Ok(event), Some(self)));
            }
            self.next.mark_unchanged();
            if let Err(status) = self.look() {
                return Some((Err(status), None));
            }
            if self.batch.is_empty() && self.next.changed().await.is_err() {
                // The writer is gone; what it wrote last may still be there.
                if self.look().is_err() || self.batch.is_empty() {
                    return None;
                }
            }
        }
    }

    fn look(&mut self) -> Result<(), Status> {
        let ring = lock(&self.ring);
        let Some(skip) = self.sequence.checked_sub(ring.oldest) else {
            return Err(lost(self.sequence, ring.oldest));
        };
        self.batch
            .extend(ring.events.iter().skip(skip as usize).take(BATCH).cloned());
        Ok(())
    }
}

fn lost(sequence: u64, oldest: u64) -> Status {
    Status::out_of_range(format!(
        "event {sequence} is no longer held: the oldest is {oldest}"
    ))
}

/// A panic elsewhere leaves the ring whole: every change to it is one push or pop.
fn lock(ring: &Mutex<Ring>) -> MutexGuard<'_, Ring> {
    ring.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use prost::Message;
    use tokio_stream::StreamExt;

    use super::*;

    fn numbered(numbers: std::ops::Range<u64>) -> impl Iterator<Item = WireMessage> {
        numbers.map(|n| WireMessage::new(&n.to_string()))
    }

    async fn texts(stream: impl Stream<Item = Result<WireMessage, Status>>) -> Vec<String> {
        stream
            .map(|item| {
                item.map_or_else(
                    |e| e.to_string(),
                    |event| String::decode(event.message()).expect("a text"),
                )
            })
            .collect()
            .await
    }

    #[tokio::test]
    async fn events_come_in_order_and_resume() {
        let (writer, log) = event_log(100);
        let live = log.watch(0).expect("the next event");
        writer.append(numbered(1..81));
        assert_eq!(writer.next_sequence(), 81);
        let resumed = log.watch(79).expect("held");
        let at_the_end = log.watch(81).expect("the next one");
        drop(writer);
        assert_eq!(texts(live).await.len(), 80);
        assert_eq!(texts(resumed).await, ["79", "80"]);
        assert!(texts(at_the_end).await.is_empty());
    }

    #[tokio::test]
    async fn a_reader_behind_the_log_is_told_the_oldest_event() {
        let (writer, log) = event_log(10);
        let slow = log.watch(0).expect("the next event");
        writer.append(numbered(1..101));
        let refused = |from| {
            log.watch(from)
                .err()
                .map(|status| (status.code(), status.message().to_owned()))
        };
        let (code, message) = refused(1).expect("refused");
        assert_eq!(code, tonic::Code::OutOfRange);
        assert!(message.contains("oldest is 91"), "{message}");
        assert!(
            refused(102)
                .expect("refused")
                .1
                .contains("has not happened")
        );
        assert!(refused(91).is_none());
        let mut slow = std::pin::pin!(slow);
        let status = slow
            .next()
            .await
            .expect("an item")
            .expect_err("it fell behind");
        assert!(
            status.message().contains("event 1 is no longer held"),
            "{status}"
        );
        assert!(slow.next().await.is_none(), "the stream is over");
    }
}
