use nalgebra::{Isometry3, Point3};
use tonic::Code;
use tsukamu_client::feed::{FeedOptions, HandFeed, play};
use tsukamu_client::subscribe::WatchError;
use tsukamu_motion::track::TrackHand;
use tsukamu_proto::v1;
use tsukamu_world::hand::joint::{N_JOINTS, Side};
use tsukamu_world::hand::sample::{FingerPose, HandSample};

use crate::fake::Running;

fn options(name: &str) -> FeedOptions {
    FeedOptions {
        name: name.into(),
        side: v1::Side::Right,
        model: None,
        filter: None,
    }
}

/// A hand whose wrist moves along x, one sample per time.
fn hand(times_s: &[f64]) -> TrackHand {
    let sample = |time_s: &f64| HandSample {
        wrist: Isometry3::translation(*time_s, 0.0, 0.0),
        fingers: FingerPose::Points([Some(Point3::origin()); N_JOINTS]),
    };
    TrackHand {
        side: Side::Right,
        times_s: times_s.to_vec(),
        samples: times_s.iter().map(sample).collect(),
    }
}

#[tokio::test]
async fn samples_go_in_and_answers_come_back() {
    let running = Running::start().await;
    let client = running.client().await;
    let mut feed = HandFeed::open(&client, options("alice:right"))
        .await
        .unwrap();
    assert_eq!(feed.hand, 7);
    assert!(feed.samples.push(tsukamu_client::sample::lost(42)));
    let answer = feed.answers.next().await.unwrap().unwrap();
    assert_eq!(
        (
            answer.stamp.tick,
            answer.state.applied_source_ns,
            answer.state.holds
        ),
        (9, 42, 3)
    );
    // The lane closes with its last sender; the daemon then closes the answers.
    drop(feed.samples);
    assert_eq!(feed.answers.next().await.unwrap(), None);
    let script = running.script();
    assert_eq!(
        (script.opened[0].name.as_str(), script.opened[0].side()),
        ("alice:right", v1::Side::Right)
    );
    assert_eq!((script.samples.len(), script.n_closed_lanes), (1, 1));
}

#[tokio::test]
async fn a_track_is_played_in_order_at_its_times() {
    let running = Running::start().await;
    let client = running.client().await;
    let mut feed = HandFeed::open(&client, options("file")).await.unwrap();
    let track = hand(&[10.0, 10.02, 10.03, 10.06]);
    let mut progress = Vec::new();
    let start = std::time::Instant::now();
    let played = play(&track, false, &feed.samples, client.clock(), &mut |at| {
        progress.push(at.n_sent)
    })
    .await;
    assert!(
        start.elapsed().as_secs_f64() >= 0.06,
        "it took {:?}",
        start.elapsed()
    );
    // A loaded machine may be too late for a sample; then it is left out and counted.
    assert_eq!((played.n_rounds, played.n_sent + played.n_skipped), (1, 4));
    assert_eq!(progress, (1..=played.n_sent).collect::<Vec<_>>());
    drop(feed.samples);
    while feed.answers.next().await.unwrap().is_some() {}
    let script = running.script();
    let places: Vec<f64> = script
        .samples
        .iter()
        .map(|sample| sample.wrist.unwrap().position.unwrap().x)
        .collect();
    assert_eq!(places.len() as u64, played.n_sent);
    assert!(
        places.is_sorted() && places.iter().all(|x| track.times_s.contains(x)),
        "{places:?}"
    );
    assert!(script.samples.is_sorted_by_key(|sample| sample.source_ns));
}

#[tokio::test]
async fn a_refused_hand_is_an_error() {
    let running = Running::start().await;
    let error = HandFeed::open(&running.client().await, options("refused"))
        .await
        .unwrap_err();
    assert!(
        matches!(&error, WatchError::Refused { code: Code::ResourceExhausted, message } if message.contains("16")),
        "{error:?}"
    );
}

#[tokio::test]
async fn a_lane_that_the_daemon_closes_ends_the_playing() {
    let running = Running::start().await;
    let client = running.client().await;
    let HandFeed {
        samples,
        mut answers,
        ..
    } = HandFeed::open(&client, options("closing")).await.unwrap();
    let track = hand(&[0.0, 0.01]);
    let mut ignore = |_| {};
    let playing = play(&track, true, &samples, client.clock(), &mut ignore);
    tokio::time::timeout(std::time::Duration::from_secs(10), playing)
        .await
        .expect("playing must end");
    let error = answers.next().await.unwrap_err();
    assert!(
        matches!(
            &error,
            WatchError::Refused {
                code: Code::Aborted,
                ..
            }
        ),
        "{error:?}"
    );
}
