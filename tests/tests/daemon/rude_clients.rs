//! Clients that break rules, flood, or vanish.

use std::time::Duration;

use tokio_stream::wrappers::ReceiverStream;
use tonic::Code;
use tonic::transport::Channel;
use tsukamu_proto::v1;
use tsukamu_proto::v1::drive_response::Kind;
use tsukamu_proto::v1::hands_client::HandsClient;
use tsukamu_server::daemon::{Daemon, start};
use tsukamu_server::settings::Mode;

use super::hands::{open, sample, state_where};
use super::recordings::{folder, recordings};
use super::support::{
    config, connect, control, cubes, daemon, next, next_frame, soon, step, tick, watch, world,
};

/// Most hands at a time.
const HANDS_MAX: usize = 256;

/// A hand that stays as long as its lane: what it says, and what it hears.
#[derive(Debug)]
struct Lane {
    _requests: tokio::sync::mpsc::Sender<v1::DriveRequest>,
    answers: tonic::Streaming<v1::DriveResponse>,
}

async fn hand(hands: &mut HandsClient<Channel>, name: &str) -> Result<Lane, tonic::Status> {
    let (requests, receiver) = tokio::sync::mpsc::channel(1);
    requests.send(open(name)).await.expect("sent");
    let stream = ReceiverStream::new(receiver);
    let mut answers = soon(hands.drive(stream)).await?.into_inner();
    let opened = soon(answers.message()).await?;
    let kind = opened.and_then(|answer| answer.kind);
    assert!(matches!(kind, Some(Kind::Opened(_))), "opened comes first");
    Ok(Lane {
        _requests: requests,
        answers,
    })
}

async fn n_devices(daemon: &Daemon) -> usize {
    let mut devices = v1::devices_client::DevicesClient::new(connect(daemon).await);
    soon(devices.list_devices(v1::ListDevicesRequest {}))
        .await
        .expect("a list")
        .into_inner()
        .devices
        .len()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn hands_that_come_and_go_while_the_world_stands_still_leave_nothing() {
    let daemon = daemon(cubes(0, 240.0), Mode::Lockstep).await;
    let mut hands = HandsClient::new(connect(&daemon).await);
    for _ in 0..2000 {
        // The daemon may hear of the farewells late: then the lane is full for a moment.
        while hand(&mut hands, "a").await.is_err() {
            tokio::task::yield_now().await;
        }
    }
    let _stays = loop {
        if let Ok(stays) = hand(&mut hands, "b").await {
            break stays;
        }
    };
    assert!(n_devices(&daemon).await <= HANDS_MAX);
    let mut control = control(&daemon).await;
    step(&mut control, 1).await;
    while n_devices(&daemon).await > 1 {
        step(&mut control, 1).await;
    }
    let mut frames = watch(&mut world(&daemon).await, 0.0).await;
    let frame = next_frame(&mut frames, &mut 0).await;
    assert_eq!(frame.hands.len(), 1, "only the one that stayed");
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn there_are_only_so_many_hands() {
    let daemon = daemon(cubes(0, 240.0), Mode::Lockstep).await;
    let mut stay = Vec::new();
    for _ in 0..4 {
        // A connection carries fewer streams than there may be hands.
        let mut hands = HandsClient::new(connect(&daemon).await);
        for _ in 0..HANDS_MAX / 4 {
            stay.push(hand(&mut hands, "a").await.expect("a place"));
        }
    }
    let mut hands = HandsClient::new(connect(&daemon).await);
    let refused = hand(&mut hands, "a").await.expect_err("no place");
    assert_eq!(refused.code(), Code::ResourceExhausted, "{refused}");
    stay.pop();
    while let Err(refused) = hand(&mut hands, "a").await {
        assert_eq!(refused.code(), Code::ResourceExhausted, "{refused}");
    }
    drop(stay);
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn of_a_flood_the_newest_sample_wins_and_the_others_are_counted() {
    let daemon = daemon(cubes(0, 240.0), Mode::Lockstep).await;
    let (mut control, mut hands) = (
        control(&daemon).await,
        HandsClient::new(connect(&daemon).await),
    );
    let (samples, receiver) = tokio::sync::mpsc::channel(64);
    let mut answers = soon(hands.drive(ReceiverStream::new(receiver)))
        .await
        .expect("a stream")
        .into_inner();
    samples.send(open("a")).await.expect("sent");
    next(&mut answers).await;
    let n = 20_000;
    // Nobody reads the answers meanwhile.
    for k in 1..=n {
        soon(samples.send(sample(k, k as f64 * 1e-5)))
            .await
            .expect("sent");
    }
    state_where(&mut answers, |state| state.received_source_ns == n).await;
    step(&mut control, 1).await;
    let state = state_where(&mut answers, |state| state.applied_tick == 1).await;
    assert_eq!(
        (state.applied_source_ns, state.superseded, state.dropped),
        (n, n - 1, 0)
    );
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn subscribers_that_vanish_are_gone() {
    let daemon = daemon(cubes(50, 240.0), Mode::Realtime).await;
    let mut streams = Vec::new();
    for k in 0..300 {
        let mut client = world(&daemon).await;
        let rate = [0.0, 1e9, f64::INFINITY, 60.0][k % 4];
        let mut frames = watch(&mut client, rate).await;
        next_frame(&mut frames, &mut 0).await;
        streams.push(frames);
    }
    let mut client = world(&daemon).await;
    let mut n_subscribers = async || {
        soon(client.get_status(v1::GetStatusRequest {}))
            .await
            .expect("a status")
            .into_inner()
            .n_frame_subscribers
    };
    assert_eq!(n_subscribers().await, 300);
    drop(streams);
    soon(async { while n_subscribers().await > 0 {} }).await;
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_too_long_to_be_said_is_cut() {
    let daemon = daemon(cubes(0, 240.0), Mode::Lockstep).await;
    let (mut control, mut client) = (control(&daemon).await, world(&daemon).await);
    let long = "ü\n".repeat(200_000);
    let model = v1::SetModelRequest {
        model: long.clone(),
    };
    let scene = v1::LoadSceneRequest {
        source: Some(v1::load_scene_request::Source::Name(long.clone())),
        with_default_hands: true,
    };
    let object = v1::AddObjectRequest {
        name: long.clone(),
        ..Default::default()
    };
    let play = v1::PlayRecordingRequest { name: long.clone() };
    let refusals = [
        (
            soon(control.set_model(model)).await.expect_err("no model"),
            Code::InvalidArgument,
        ),
        (
            soon(control.load_scene(scene)).await.expect_err("no scene"),
            Code::NotFound,
        ),
        (
            soon(control.add_object(object)).await.expect_err("no name"),
            Code::InvalidArgument,
        ),
        (
            soon(recordings(&daemon).await.play_recording(play))
                .await
                .expect_err("no name"),
            Code::InvalidArgument,
        ),
    ];
    for (refused, code) in refusals {
        assert_eq!(refused.code(), code, "{refused}");
        assert!(!refused.message().is_empty() && refused.message().len() < 5000);
    }
    let mut hands = HandsClient::new(connect(&daemon).await);
    for bad in [long.as_str(), "a\u{1b}[2Jb"] {
        let refused = hand(&mut hands, bad).await.expect_err("no name");
        assert_eq!(refused.code(), Code::InvalidArgument, "{refused}");
    }
    for from_sequence in [u64::MAX, 1 << 40] {
        let refused = soon(client.watch_events(v1::WatchEventsRequest { from_sequence }))
            .await
            .expect_err("not yet");
        assert_eq!(refused.code(), Code::OutOfRange, "{refused}");
    }
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn in_lockstep_a_recording_lacks_nothing_however_fast_the_world_goes() {
    let mut config = config(cubes(0, 240.0), Mode::Lockstep);
    config.recording.dir = folder("daemon-fast");
    let daemon = start(config).await.expect("it starts");
    let (mut control, mut desk) = (control(&daemon).await, recordings(&daemon).await);
    soon(desk.start_recording(v1::StartRecordingRequest::default()))
        .await
        .expect("it begins");
    let n = 50_000;
    step(&mut control, n).await;
    let done = soon(desk.stop_recording(v1::StopRecordingRequest {}))
        .await
        .expect("it ends")
        .into_inner();
    assert!(done.dropped == 0 && done.messages > n.into(), "{done:?}");
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recording_that_cannot_be_is_refused_by_its_own_code() {
    let mut config = config(cubes(0, 240.0), Mode::Lockstep);
    let folder = folder("daemon-refused");
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("garbage.mcap"), [7; 4096]).expect("written");
    std::fs::create_dir_all(folder.join("folder.mcap")).expect("a folder");
    config.recording.dir = folder.clone();
    let daemon = start(config).await.expect("it starts");
    let mut desk = recordings(&daemon).await;
    let mut refused = async |name: &str| {
        let request = v1::StartRecordingRequest {
            name: name.to_owned(),
            ..Default::default()
        };
        soon(desk.start_recording(request))
            .await
            .expect_err(name)
            .code()
    };
    for (name, code) in [
        ("garbage", Code::AlreadyExists),
        ("../out", Code::InvalidArgument),
        ("a/b", Code::InvalidArgument),
        ("a\0b", Code::InvalidArgument),
    ] {
        assert_eq!(refused(name).await, code, "{name:?}");
    }
    for (name, code) in [
        ("garbage.mcap", Code::DataLoss),
        ("folder.mcap", Code::NotFound),
        ("nothing.mcap", Code::NotFound),
    ] {
        let request = v1::PlayRecordingRequest {
            name: name.to_owned(),
        };
        let refused = soon(desk.play_recording(request)).await.expect_err(name);
        assert_eq!(refused.code(), code, "{refused}");
    }
    std::fs::remove_dir_all(&folder).expect("it goes");
    std::fs::write(&folder, "no folder").expect("written");
    let status = soon(desk.start_recording(v1::StartRecordingRequest::default()))
        .await
        .expect_err("no folder");
    assert_eq!(status.code(), Code::FailedPrecondition, "{status}");
    std::fs::remove_file(&folder).expect("it goes");
    // After all this the desk still works.
    soon(desk.start_recording(v1::StartRecordingRequest::default()))
        .await
        .expect("it begins");
    soon(desk.stop_recording(v1::StopRecordingRequest {}))
        .await
        .expect("it ends");
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_stops_reading_its_contacts_holds_nobody_up() {
    let daemon = daemon(cubes(0, 1000.0), Mode::Realtime).await;
    let mut hands = HandsClient::new(connect(&daemon).await);
    let mut lane = hand(&mut hands, "a").await.expect("a place");
    let mut frames = watch(&mut world(&daemon).await, 0.0).await;
    let first = tick(next_frame(&mut frames, &mut 0).await.stamp);
    while tick(next_frame(&mut frames, &mut 0).await.stamp) < first + 1000 {}
    let newest = soon(async {
        loop {
            let stamp = next(&mut lane.answers).await.stamp;
            if tick(stamp) > first + 1000 {
                return tick(stamp);
            }
        }
    });
    assert!(newest.await > first + 1000, "and goes on when it reads on");
    tokio::time::timeout(Duration::from_secs(30), daemon.shutdown())
        .await
        .expect("in time")
        .expect("a clean end");
}
