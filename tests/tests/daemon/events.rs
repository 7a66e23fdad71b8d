//! The event lane.

use tonic::Code;
use tsukamu_proto::v1;
use tsukamu_proto::v1::event::Kind;
use tsukamu_server::daemon::start;
use tsukamu_server::settings::Mode;

use super::support::{config, control, cubes, daemon, next, soon, step, world};

fn from(from_sequence: u64) -> v1::WatchEventsRequest {
    v1::WatchEventsRequest { from_sequence }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn events_are_numbered_and_resume() {
    let mut scene = cubes(1, 240.0);
    scene.objects[1].pose.translation.vector.y = 0.05;
    let daemon = daemon(scene, Mode::Lockstep).await;
    let (mut control, mut world) = (control(&daemon).await, world(&daemon).await);
    step(&mut control, 240).await;
    let mut events = soon(world.watch_events(from(1)))
        .await
        .expect("a stream")
        .into_inner();
    let mut seen = Vec::new();
    loop {
        let event = next(&mut events).await;
        assert_eq!(event.sequence, seen.len() as u64 + 1, "no gaps");
        seen.push(event.clone());
        if event.object_name == "cube 0" && matches!(event.kind, Some(Kind::Rested(_))) {
            break;
        }
    }
    assert!(
        matches!(&seen[0].kind, Some(Kind::SceneLoaded(loaded)) if loaded.name == "cubes"),
        "{seen:?}"
    );
    let landed = seen
        .iter()
        .find(|event| matches!(event.kind, Some(Kind::Landed(_))))
        .expect("it fell");
    assert_eq!(
        (landed.object, landed.object_name.as_str()),
        (2, "cube 0"),
        "id + 1, and its name"
    );
    let ticks: Vec<u64> = seen
        .iter()
        .map(|event| event.stamp.expect("a stamp").tick)
        .collect();
    assert!(ticks.is_sorted(), "{ticks:?}");
    let mut again = soon(world.watch_events(from(landed.sequence)))
        .await
        .expect("a stream")
        .into_inner();
    assert_eq!(
        next(&mut again).await,
        *landed,
        "a resumed stream begins where it was asked to"
    );
    let refused = soon(world.watch_events(from(10_000)))
        .await
        .expect_err("not yet");
    assert_eq!(refused.code(), Code::OutOfRange, "{refused}");
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_falls_behind_the_log_is_told_the_oldest_event() {
    let mut config = config(cubes(0, 240.0), Mode::Lockstep);
    config.publish.event_log = 16;
    let daemon = start(config).await.expect("it starts");
    let (mut control, mut world) = (control(&daemon).await, world(&daemon).await);
    for _ in 0..40 {
        soon(control.reset(v1::ResetRequest {}))
            .await
            .expect("a command");
        step(&mut control, 1).await;
    }
    // The log is written after the step was answered: wait for the last event.
    let mut newest = soon(world.watch_events(from(0)))
        .await
        .expect("a stream")
        .into_inner();
    soon(control.reset(v1::ResetRequest {}))
        .await
        .expect("a command");
    step(&mut control, 1).await;
    let newest = next(&mut newest).await.sequence;
    let refused = soon(world.watch_events(from(1)))
        .await
        .expect_err("long gone");
    assert_eq!(refused.code(), Code::OutOfRange);
    let oldest = refused
        .message()
        .rsplit(' ')
        .next()
        .and_then(|number| number.parse::<u64>().ok());
    let oldest = oldest.unwrap_or_else(|| panic!("{refused} names no number"));
    assert!(
        oldest > 16 && oldest <= newest && newest < oldest + 64,
        "{oldest} to {newest}"
    );
    soon(world.watch_events(from(oldest + 8)))
        .await
        .expect("that one is held");
    daemon.shutdown().await.expect("a clean end");
}
