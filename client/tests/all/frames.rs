use tonic::{Code, Status};
use tsukamu_client::subscribe::{FrameOptions, FrameUpdate, FrameWatch, WatchError};
use tsukamu_client::view::FrameFault;

use crate::fake::{FrameScript, Running, frame, sent, skipped, stamp};

/// The next updates, as words: frames with their tick, objects and whether the scene came anew.
async fn updates(watch: &mut FrameWatch, n: usize) -> Vec<String> {
    let mut words = Vec::new();
    for _ in 0..n {
        words.push(match watch.next().await.unwrap() {
            FrameUpdate::Frame { new_scene, .. } => {
                let view = watch.view().unwrap();
                let objects = view
                    .objects
                    .iter()
                    .map(|(id, object)| format!(" {id}@{}", object.pose.translation.x));
                let scene = if new_scene {
                    format!(" with {}", watch.scene().unwrap().name)
                } else {
                    String::new()
                };
                format!("{}:{}{scene}", view.stamp.tick, objects.collect::<String>())
            }
            FrameUpdate::Skipped(n) => format!("{n} skipped"),
            FrameUpdate::Dropped(FrameFault::MissingKeyframe { wanted }) => {
                format!("no keyframe {wanted}")
            }
            FrameUpdate::Dropped(fault) => fault.to_string(),
            FrameUpdate::Lost(_) => "lost".into(),
            FrameUpdate::Resumed => "resumed".into(),
        });
    }
    words
}

async fn watch(running: &Running, scripts: Vec<FrameScript>) -> FrameWatch {
    running.script().frames = scripts.into();
    FrameWatch::open(&running.client().await, FrameOptions { max_rate_hz: 60.0 })
        .await
        .unwrap()
}

#[tokio::test]
async fn frames_are_applied_and_the_slow_are_told() {
    let running = Running::start().await;
    let script = vec![
        sent(frame(stamp(1, 10), 10, 1, &[(1, 0.5), (2, 0.25)])),
        sent(frame(stamp(1, 11), 10, 1, &[(2, 0.75)])),
        skipped(4),
        sent(frame(stamp(1, 16), 10, 1, &[(1, 0.125)])),
        sent(frame(stamp(1, 18), 17, 1, &[(1, 0.0)])),
        sent(frame(stamp(1, 20), 20, 1, &[(1, 1.5)])),
    ];
    let mut watch = watch(&running, vec![script]).await;
    assert_eq!(
        updates(&mut watch, 6).await,
        [
            "10: 1@0.5 2@0.25 with scene 1",
            "11: 1@0.5 2@0.75",
            "4 skipped",
            "16: 1@0.125 2@0.25",
            "no keyframe 17",
            "20: 1@1.5"
        ]
    );
    let counts = watch.counts();
    assert_eq!(
        (counts.applied, counts.skipped, counts.dropped, counts.lost),
        (4, 4, 1, 0)
    );
    assert_eq!(running.script().max_rates_hz, [60.0]);
}

#[tokio::test]
async fn the_scene_is_fetched_when_it_changed() {
    let running = Running::start().await;
    let script = vec![
        sent(frame(stamp(1, 10), 10, 1, &[])),
        sent(frame(stamp(1, 11), 10, 1, &[])),
        sent(frame(stamp(1, 12), 10, 2, &[])),
        sent(frame(stamp(2, 0), 0, 2, &[])),
        sent(frame(stamp(2, 1), 0, 2, &[])),
    ];
    let mut watch = watch(&running, vec![script]).await;
    assert_eq!(updates(&mut watch, 2).await, ["10: with scene 1", "11:"]);
    running.script().scene_version = 2;
    assert_eq!(
        updates(&mut watch, 3).await,
        ["12: with scene 2", "0: with scene 2", "1:"]
    );
    assert_eq!(running.script().n_scene_calls, 3);
}

#[tokio::test]
async fn a_broken_stream_is_opened_again() {
    let running = Running::start().await;
    // The second stream is that of a daemon that was started anew: its ticks are lower.
    let first = vec![sent(frame(stamp(1, 10), 10, 1, &[(1, 0.5)]))];
    let second = vec![
        sent(frame(stamp(1, 3), 3, 1, &[(1, 0.25)])),
        Err(Status::unavailable("the daemon is going down")),
    ];
    let third = vec![sent(frame(stamp(1, 4), 4, 1, &[(1, 0.125)]))];
    let mut watch = watch(&running, vec![first, second, third]).await;
    assert_eq!(
        updates(&mut watch, 2).await,
        ["10: 1@0.5 with scene 1", "lost"]
    );
    assert_eq!(watch.view(), None);
    assert_eq!(
        updates(&mut watch, 5).await,
        [
            "resumed",
            "3: 1@0.25 with scene 1",
            "lost",
            "resumed",
            "4: 1@0.125 with scene 1"
        ]
    );
    assert_eq!(watch.counts().lost, 2);
}

#[tokio::test]
async fn a_refusal_ends_the_watch() {
    let running = Running::start().await;
    let mut watch = watch(
        &running,
        vec![vec![Err(Status::permission_denied("not you"))]],
    )
    .await;
    let error = watch.next().await.unwrap_err();
    assert!(
        matches!(
            &error,
            WatchError::Refused {
                code: Code::PermissionDenied,
                ..
            }
        ),
        "{error:?}"
    );
}

#[tokio::test]
async fn a_daemon_of_another_protocol_ends_the_watch() {
    let running = Running::start().await;
    let mut watch = watch(&running, vec![Vec::new()]).await;
    assert_eq!(updates(&mut watch, 1).await, ["lost"]);
    running.script().status.protocol_major += 1;
    assert!(matches!(watch.next().await, Err(WatchError::Connect(_))));
}
