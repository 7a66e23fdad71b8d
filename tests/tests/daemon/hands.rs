//! Driving a hand.

use futures_util::stream::StreamExt;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Streaming};
use tsukamu_proto::v1;
use tsukamu_proto::v1::drive_request::Kind as Ask;
use tsukamu_proto::v1::drive_response::Kind;
use tsukamu_proto::v1::hands_client::HandsClient;
use tsukamu_server::settings::Mode;

use super::support::{connect, control, cubes, daemon, next, next_frame, soon, step, watch, world};

pub(crate) fn ask(kind: Ask) -> v1::DriveRequest {
    v1::DriveRequest { kind: Some(kind) }
}

pub(crate) fn open(name: &str) -> v1::DriveRequest {
    ask(Ask::Open(v1::DriveOpen {
        name: name.to_owned(),
        side: v1::Side::Right.into(),
        model: None,
        filter: None,
    }))
}

/// A straight hand whose wrist is at `x`, 1 m above the floor.
pub(crate) fn sample(source_ns: u64, x: f64) -> v1::DriveRequest {
    let wrist = v1::Pose {
        position: Some(v1::Vec3 { x, y: 1.0, z: 0.0 }),
        rotation: None,
    };
    ask(Ask::Sample(v1::HandSample {
        source_ns,
        wrist: Some(wrist),
        joints: Vec::new(),
        angles: vec![0.0; 21],
        valid: true,
    }))
}

/// The first state that is as wanted.
pub(crate) async fn state_where(
    answers: &mut Streaming<v1::DriveResponse>,
    is_wanted: impl Fn(&v1::DriveState) -> bool,
) -> v1::DriveState {
    loop {
        if let Some(Kind::State(state)) = next(answers).await.kind
            && is_wanted(&state)
        {
            return state;
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_drives_a_hand_in_lockstep() {
    let daemon = daemon(cubes(0, 240.0), Mode::Lockstep).await;
    let (mut control, mut world) = (control(&daemon).await, world(&daemon).await);
    let mut frames = watch(&mut world, 0.0).await;
    next_frame(&mut frames, &mut 0).await;
    let mut hands = HandsClient::new(connect(&daemon).await);
    let (requests, receiver) = tokio::sync::mpsc::channel(8);
    let mut answers = soon(hands.drive(ReceiverStream::new(receiver)))
        .await
        .expect("a stream")
        .into_inner();
    requests.send(open("alice:right")).await.expect("sent");
    let Some(Kind::Opened(opened)) = next(&mut answers).await.kind else {
        panic!("opened comes first")
    };
    for (tick, x) in [(1, 0.25), (2, 0.5), (3, 0.75)] {
        requests.send(sample(tick * 10, x)).await.expect("sent");
        // In lockstep the daemon says when it has the sample.
        state_where(&mut answers, |state| state.received_source_ns == tick * 10).await;
        step(&mut control, 1).await;
        let frame = next_frame(&mut frames, &mut 0).await;
        let hand = frame.hands.first().expect("the hand is in the frame");
        assert_eq!(
            (hand.id, hand.tracking()),
            (opened.hand, v1::Tracking::Tracked),
            "tick {tick}"
        );
        assert_eq!(
            hand.wrist.and_then(|wrist| wrist.position).map(|at| at.x),
            Some(x)
        );
        assert!(hand.shown.len() == 60 && hand.tracked.iter().all(|part| part.is_finite()));
        let applied = state_where(&mut answers, |state| state.applied_tick == tick).await;
        assert_eq!(applied.applied_source_ns, tick * 10);
    }
    let scene = soon(world.get_scene(v1::GetSceneRequest {}))
        .await
        .expect("a scene")
        .into_inner();
    let names: Vec<String> = scene
        .scene
        .expect("a scene")
        .hands
        .into_iter()
        .map(|hand| hand.name)
        .collect();
    assert_eq!(names, ["alice:right"]);
    drop(requests);
    while soon(answers.message())
        .await
        .expect("a clean end")
        .is_some()
    {}
    drop(answers);
    // The tick thread takes the hand out with a step after the stream has gone.
    for _ in 0..10_000 {
        step(&mut control, 1).await;
        if next_frame(&mut frames, &mut 0).await.hands.is_empty() {
            daemon.shutdown().await.expect("a clean end");
            return;
        }
    }
    panic!("the hand stays");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn rude_clients_are_told() {
    let daemon = daemon(cubes(0, 240.0), Mode::Realtime).await;
    let mut hands = HandsClient::new(connect(&daemon).await);
    let one_sided = |kind: v1::DriveOpen| ask(Ask::Open(kind));
    let wrong_length = ask(Ask::Sample(v1::HandSample {
        valid: true,
        angles: vec![0.0; 3],
        ..Default::default()
    }));
    let bad_filter = v1::DriveOpen {
        side: v1::Side::Left.into(),
        filter: Some(v1::OneEuro {
            min_cutoff_hz: -1.0,
            ..Default::default()
        }),
        ..Default::default()
    };
    let cases = [
        (vec![sample(1, 0.0)], "first message must be `open`"),
        (vec![one_sided(v1::DriveOpen::default())], "side is 0"),
        (vec![one_sided(bad_filter)], "filter"),
        (vec![open("a"), wrong_length], "angles has 3 numbers"),
        (vec![open("a"), open("b")], "only samples may come"),
    ];
    for (messages, words) in cases {
        // The stream stays open: it is the message that ends it.
        let requests = futures_util::stream::iter(messages).chain(futures_util::stream::pending());
        let mut answers = soon(hands.drive(requests))
            .await
            .expect("a stream")
            .into_inner();
        let refused = loop {
            match soon(answers.message()).await {
                Ok(Some(_)) => {}
                Ok(None) => panic!("{words}: it ended well"),
                Err(status) => break status,
            }
        };
        assert_eq!(refused.code(), Code::InvalidArgument, "{refused}");
        assert!(
            refused.message().contains(words),
            "{refused} does not say {words}"
        );
    }
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn numbers_that_are_none_are_dropped_and_counted() {
    let daemon = daemon(cubes(0, 240.0), Mode::Realtime).await;
    let mut hands = HandsClient::new(connect(&daemon).await);
    let infinite = ask(Ask::Sample(v1::HandSample {
        wrist: Some(v1::Pose {
            position: Some(v1::Vec3::default()),
            rotation: None,
        }),
        angles: vec![f64::INFINITY; 21],
        valid: true,
        ..Default::default()
    }));
    let far = [f64::NAN, f64::NEG_INFINITY, 1.0e300, -20_000.0].map(|x| sample(1, x));
    let messages = [
        vec![open("a"), infinite],
        far.to_vec(),
        vec![sample(9, 0.5)],
    ]
    .concat();
    let requests = futures_util::stream::iter(messages).chain(futures_util::stream::pending());
    let mut answers = soon(hands.drive(requests))
        .await
        .expect("a stream")
        .into_inner();
    let state = state_where(&mut answers, |state| state.applied_source_ns == 9).await;
    assert_eq!((state.dropped, state.superseded), (5, 0));
    daemon.shutdown().await.expect("a clean end");
}
