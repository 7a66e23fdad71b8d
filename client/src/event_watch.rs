use tonic::{Code, Status, Streaming};
use tsukamu_proto::v1::{Event, WatchEventsRequest};

use crate::connect::Client;
use crate::connect_error::ConnectError;
use crate::subscribe::{Again, WatchError, is_passing, refused};

/// A daemon whose start seems to have moved by more than this is another one, seconds. Above what a status call may
/// take, below what a restart takes to be noticed.
const SAME_START_S: f64 = 2.0;
/// The metadata that carries the oldest number held, with `OUT_OF_RANGE`.
const OLDEST_KEY: &str = "tsukamu-oldest-sequence";
/// How often to run after a log whose oldest event is gone before the next request comes.
const OLDEST_ATTEMPTS: u32 = 5;

/// What happened on the event lane.
#[derive(Clone, Debug, PartialEq)]
pub enum EventUpdate {
    /// The next event. Boxed: it is far larger than the rest.
    Event(Box<Event>),
    /// So many events are lost to this watcher: the daemon's log is bounded and holds them no longer.
    Missed(u64),
    /// The stream broke, for this reason. The next call tries to open it again where it broke.
    Lost(String),
    /// The stream is open again.
    Resumed,
    /// The stream is open again, but the daemon was started anew: events count from 1 again.
    Restarted,
}

/// Watches events and resumes by sequence number: none is lost while the daemon's log still holds it.
#[derive(Debug)]
pub struct EventWatch {
    client: Client,
    stream: Option<Streaming<Event>>,
    /// Sequence number of the next event, once one has come or was asked for.
    next_sequence: Option<u64>,
    /// When the daemon started, seconds of the client's clock; tells a restart from a broken line.
    daemon_start_s: f64,
    /// An event whose gap was reported first.
    held_back: Option<Box<Event>>,
    /// Whether the next stream is that of a daemon that was started anew.
    restarted: bool,
    again: Again,
}

impl EventWatch {
    /// Opens the stream at that sequence number; 0 begins with the next event, and what the log no longer holds is
    /// reported as [`EventUpdate::Missed`] before the first event.
    ///
    /// # Errors
    /// When the daemon refuses or is gone.
    pub async fn open(client: &Client, from_sequence: u64) -> Result<Self, WatchError> {
        let daemon_start_s = start_of_daemon(client).await?;
        let mut watch = Self {
            client: client.clone(),
            stream: None,
            next_sequence: (from_sequence > 0).then_some(from_sequence),
            daemon_start_s,
            held_back: None,
            restarted: false,
            again: Again::default(),
        };
        let stream = watch
            .open_stream()
            .await
            .map_err(|status| refused(&status))?;
        watch.stream = Some(stream);
        Ok(watch)
    }

    /// Sequence number of the next event; `None` while no event has told.
    pub fn next_sequence(&self) -> Option<u64> {
        self.next_sequence
    }

    /// Waits for what happens next. May be dropped while it waits: nothing is lost.
    ///
    /// # Errors
    /// When the stream broke and could not be opened again, or the daemon refuses it.
    pub async fn next(&mut self) -> Result<EventUpdate, WatchError> {
        if let Some(event) = self.held_back.take() {
            return Ok(EventUpdate::Event(event));
        }
        let Some(stream) = self.stream.as_mut() else {
            return self.reopen().await;
        };
        match stream.message().await {
            Ok(Some(event)) => Ok(self.take(event)),
            Ok(None) => Ok(self.lose("the daemon ended the stream".into())),
            // Too slow for the bounded log: go on with what it holds.
            Err(status) if status.code() == Code::OutOfRange => {
                Ok(self.lose(status.message().into()))
            }
            Err(status) if is_passing(&status) => Ok(self.lose(status.message().into())),
            Err(status) => Err(refused(&status)),
        }
    }

    /// Hands out the event, or first the number of those that are missing before it.
    fn take(&mut self, event: Event) -> EventUpdate {
        let n_missing = self
            .next_sequence
            .map_or(0, |expected| event.sequence.saturating_sub(expected));
        self.next_sequence = Some(event.sequence.saturating_add(1));
        let event = Box::new(event);
        if n_missing == 0 {
            return EventUpdate::Event(event);
        }
        self.held_back = Some(event);
        EventUpdate::Missed(n_missing)
    }

    fn lose(&mut self, reason: String) -> EventUpdate {
        self.stream = None;
        EventUpdate::Lost(reason)
    }

    /// Attempts to open the stream again, with the waits of the retry policy in between.
    async fn reopen(&mut self) -> Result<EventUpdate, WatchError> {
        loop {
            self.again.wait().await;
            let start_s = match start_of_daemon(&self.client).await {
                Ok(start_s) => start_s,
                Err(error) if error.is_passing() && self.again.fail(self.client.retry()) => {
                    continue;
                }
                Err(error) => return Err(error.into()),
            };
            let restarted = (start_s - self.daemon_start_s).abs() > SAME_START_S;
            self.restarted |= restarted;
            if self.restarted {
                self.daemon_start_s = start_s;
                self.next_sequence = Some(1);
            }
            match self.open_stream().await {
                Ok(stream) => {
                    self.stream = Some(stream);
                    self.again = Again::default();
                    let restarted = std::mem::take(&mut self.restarted);
                    return Ok(if restarted {
                        EventUpdate::Restarted
                    } else {
                        EventUpdate::Resumed
                    });
                }
                // It has not come as far as we have: it was started anew, too soon for its uptime to show.
                Err(status) if status.code() == Code::OutOfRange && !self.restarted => {
                    self.restarted = true
                }
                Err(status) if is_passing(&status) && self.again.fail(self.client.retry()) => {}
                Err(status) => return Err(refused(&status)),
            }
        }
    }

    /// Opens at the next event; where the log holds that no longer, at the oldest one it holds.
    async fn open_stream(&self) -> Result<Streaming<Event>, Status> {
        let mut from_sequence = self.next_sequence.unwrap_or(0);
        for _ in 0..OLDEST_ATTEMPTS {
            match self
                .client
                .world()
                .watch_events(WatchEventsRequest { from_sequence })
                .await
            {
                Ok(answer) => return Ok(answer.into_inner()),
                Err(status) if status.code() == Code::OutOfRange => match oldest_held(&status) {
                    Some(oldest) if oldest > from_sequence => from_sequence = oldest,
                    _ => return Err(status),
                },
                Err(status) => return Err(status),
            }
        }
        Err(Status::out_of_range(
            "the daemon's log of events runs away from this client",
        ))
    }
}

/// The oldest number held, from the answer to a request for an older one: the only number in it that is larger than
/// what was asked for is the last one in its text.
fn oldest_held(status: &Status) -> Option<u64> {
    let from_metadata = status
        .metadata()
        .get(OLDEST_KEY)
        .and_then(|value| value.to_str().ok()?.parse().ok());
    from_metadata.or_else(|| {
        let numbers = status
            .message()
            .split(|letter: char| !letter.is_ascii_digit());
        numbers.filter_map(|number| number.parse().ok()).next_back()
    })
}

async fn start_of_daemon(client: &Client) -> Result<f64, ConnectError> {
    let status = client.status().await?;
    Ok(client.clock().elapsed_s() - status.uptime_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_number_is_found() {
        let check = |message: &str, expected: Option<u64>| {
            assert_eq!(oldest_held(&Status::out_of_range(message)), expected);
        };
        check("event 3 is no longer held; the oldest held is 17", Some(17));
        check("the oldest event held is number 17.", Some(17));
        check("too late", None);
        let mut status = Status::out_of_range("event 3 is gone since 4 o'clock");
        status
            .metadata_mut()
            .insert(OLDEST_KEY, "17".parse().unwrap());
        assert_eq!(oldest_held(&status), Some(17));
    }
}
