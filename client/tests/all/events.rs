use tsukamu_client::event_watch::{EventUpdate, EventWatch};
use tsukamu_proto::v1::{Event, HandFound, event::Kind};

use crate::fake::{Running, stamp};

pub(crate) fn event(sequence: u64) -> Event {
    Event {
        stamp: Some(stamp(1, sequence)),
        sequence,
        hand: 1,
        kind: Some(Kind::HandFound(HandFound {})),
        ..Event::default()
    }
}

async fn updates(watch: &mut EventWatch, n: usize) -> Vec<String> {
    let mut words = Vec::new();
    for _ in 0..n {
        words.push(match watch.next().await.unwrap() {
            EventUpdate::Event(event) => event.sequence.to_string(),
            EventUpdate::Missed(n) => format!("{n} missed"),
            EventUpdate::Lost(_) => "lost".into(),
            EventUpdate::Resumed => "resumed".into(),
            EventUpdate::Restarted => "restarted".into(),
        });
    }
    words
}

#[tokio::test]
async fn the_stream_resumes_where_it_broke() {
    let running = Running::start().await;
    running.script().events = (1..=5).map(event).collect();
    running.script().events_per_stream = [2, 0].into();
    let mut watch = EventWatch::open(&running.client().await, 1).await.unwrap();
    assert_eq!(
        updates(&mut watch, 8).await,
        ["1", "2", "lost", "resumed", "lost", "resumed", "3", "4"]
    );
    assert_eq!(watch.next_sequence(), Some(5));
    assert_eq!(running.script().asked_from, [1, 3, 3]);
}

#[tokio::test]
async fn what_the_log_no_longer_holds_is_counted() {
    let running = Running::start().await;
    running.script().events = (1..=9).map(event).collect();
    running.script().oldest_event = 4;
    running.script().events_per_stream = [2].into();
    let mut watch = EventWatch::open(&running.client().await, 1).await.unwrap();
    assert_eq!(updates(&mut watch, 4).await, ["3 missed", "4", "5", "lost"]);
    running.script().oldest_event = 8;
    assert_eq!(
        updates(&mut watch, 4).await,
        ["resumed", "2 missed", "8", "9"]
    );
}

#[tokio::test]
async fn a_daemon_that_was_started_anew_counts_from_one() {
    let running = Running::start().await;
    running.script().events = (1..=5).map(event).collect();
    running.script().events_per_stream = [5].into();
    let mut watch = EventWatch::open(&running.client().await, 4).await.unwrap();
    assert_eq!(updates(&mut watch, 3).await, ["4", "5", "lost"]);
    running.script().status.uptime_s = 0.5;
    assert_eq!(updates(&mut watch, 3).await, ["restarted", "1", "2"]);
}

#[tokio::test]
async fn a_daemon_that_has_not_come_as_far_was_started_anew() {
    let running = Running::start().await;
    running.script().events = (1..=5).map(event).collect();
    running.script().events_per_stream = [5].into();
    let mut watch = EventWatch::open(&running.client().await, 5).await.unwrap();
    assert_eq!(updates(&mut watch, 2).await, ["5", "lost"]);
    running.script().events = (1..=2).map(event).collect();
    assert_eq!(updates(&mut watch, 3).await, ["restarted", "1", "2"]);
}
