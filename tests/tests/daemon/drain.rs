//! The daemon ends, whatever its clients and its world are doing.

use std::time::{Duration, Instant};

use tokio::net::TcpStream;
use tokio_stream::wrappers::ReceiverStream;
use tsukamu_proto::v1;
use tsukamu_proto::v1::hands_client::HandsClient;
use tsukamu_server::daemon::start;
use tsukamu_server::settings::Mode;

use super::hands::{open, sample};
use super::recordings::{folder, recordings};
use super::support::{
    config, connect, control, cubes, daemon, next, next_frame, soon, step, tick, watch, world,
};

/// What connections have before they are cut.
const GRACE: Duration = Duration::from_secs(3);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn clients_that_say_nothing_do_not_hold_up_the_end() {
    let mut config = config(cubes(3, 240.0), Mode::Realtime);
    config.recording.dir = folder("daemon-drain");
    let file = config.recording.dir.join("load.mcap");
    let daemon = start(config).await.expect("it starts");
    let (channel, mut client) = (connect(&daemon).await, world(&daemon).await);
    let mut desk = recordings(&daemon).await;
    let request = v1::StartRecordingRequest {
        name: "load".to_owned(),
        frames: true,
        raw: true,
    };
    soon(desk.start_recording(request))
        .await
        .expect("it begins");
    // A lane that is never opened, one that is driven, a list that is watched, and a socket without a word.
    let (_silent, receiver) = tokio::sync::mpsc::channel::<v1::DriveRequest>(1);
    let mut hands = HandsClient::new(channel.clone());
    let mut unopened = soon(hands.drive(ReceiverStream::new(receiver)))
        .await
        .expect("a stream")
        .into_inner();
    let (samples, receiver) = tokio::sync::mpsc::channel(8);
    let mut driver = HandsClient::new(connect(&daemon).await);
    let mut driven = soon(driver.drive(ReceiverStream::new(receiver)))
        .await
        .expect("a stream")
        .into_inner();
    samples.send(open("a")).await.expect("sent");
    next(&mut driven).await;
    let flood = tokio::spawn(async move {
        let mut n = 0;
        while samples.send(sample(n, 0.5)).await.is_ok() {
            n += 1;
        }
    });
    let mut devices = v1::devices_client::DevicesClient::new(channel);
    let mut list = soon(devices.watch_devices(v1::WatchDevicesRequest {}))
        .await
        .expect("a stream")
        .into_inner();
    next(&mut list).await;
    let _wordless = TcpStream::connect(daemon.local_addr())
        .await
        .expect("it listens");
    let mut frames = watch(&mut client, 0.0).await;
    next_frame(&mut frames, &mut 0).await;
    let begin = Instant::now();
    soon(daemon.shutdown()).await.expect("a clean end");
    assert!(begin.elapsed() < GRACE, "nobody had to be cut");
    let said = soon(unopened.message()).await.expect_err("told why");
    assert_eq!(said.code(), tonic::Code::Unavailable, "{said}");
    // Of one that keeps sending, the system may throw away the last words with the samples that nobody reads any more.
    while let Ok(Some(_)) = soon(driven.message()).await {}
    while soon(list.message()).await.expect("no error").is_some() {}
    while soon(frames.message()).await.expect("no error").is_some() {}
    soon(flood).await.expect("it ends");
    let mut records = tsukamu_server::record::reader::open(&file).expect("it is there");
    assert!(records.by_ref().count() > 3);
    assert_eq!(
        records.ending(),
        Some(&tsukamu_server::record::reader::Ending::Complete)
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_world_too_slow_for_its_clock_still_listens() {
    // Falling cubes at 4000 steps per second: far more than a debug build can do.
    let daemon = daemon(cubes(3000, 4000.0), Mode::Realtime).await;
    let (mut control, mut world) = (control(&daemon).await, world(&daemon).await);
    let first = soon(control.reset(v1::ResetRequest {}))
        .await
        .expect("a command")
        .into_inner();
    let second = soon(control.reset(v1::ResetRequest {}))
        .await
        .expect("a command")
        .into_inner();
    assert!(tick(second.stamp) > tick(first.stamp));
    let status = soon(world.get_status(v1::GetStatusRequest {}))
        .await
        .expect("a status")
        .into_inner();
    assert!(status.overruns > 0, "it is too slow: {status:?}");
    soon(control.pause(v1::PauseRequest {}))
        .await
        .expect("it pauses");
    soon(control.resume(v1::ResumeRequest {}))
        .await
        .expect("it goes on");
    soon(daemon.shutdown()).await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn steps_whose_asker_has_gone_end() {
    let daemon = daemon(cubes(1000, 240.0), Mode::Lockstep).await;
    let mut control = control(&daemon).await;
    for _ in 0..20 {
        let request = v1::StepRequest { n: 1_000_000 };
        let gone = tokio::time::timeout(Duration::from_millis(20), control.step(request)).await;
        assert!(gone.is_err(), "a million steps take longer");
    }
    // Minutes of steps, if they were done.
    let first = tick(step(&mut control, 1).await.stamp);
    let second = tick(step(&mut control, 1).await.stamp);
    assert_eq!(second, first + 1, "nobody steps any more");
    soon(daemon.shutdown()).await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn recordings_that_are_begun_and_forgotten_leave_the_desk_whole() {
    let mut config = config(cubes(1, 240.0), Mode::Realtime);
    config.recording.dir = folder("daemon-forgotten");
    let daemon = start(config).await.expect("it starts");
    let mut desk = recordings(&daemon).await;
    for k in 0..40_u64 {
        let request = v1::StartRecordingRequest::default();
        // Whoever asks goes away sooner or later.
        let patience = Duration::from_micros(100 * k);
        let begun = tokio::time::timeout(patience, desk.start_recording(request)).await;
        let n_tries = if begun.is_ok() { 1 } else { 2 };
        for _ in 0..n_tries {
            let stopped = soon(desk.stop_recording(v1::StopRecordingRequest {})).await;
            match stopped.map_err(|status| status.code()) {
                Ok(_) => break,
                Err(code) => assert_eq!(code, tonic::Code::FailedPrecondition),
            }
        }
    }
    // One that was forgotten may have begun just now.
    let _ = soon(desk.stop_recording(v1::StopRecordingRequest {})).await;
    soon(desk.start_recording(v1::StartRecordingRequest {
        name: "last".to_owned(),
        ..Default::default()
    }))
    .await
    .expect("the desk is free");
    soon(daemon.shutdown()).await.expect("a clean end");
}
