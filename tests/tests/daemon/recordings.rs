//! Recordings over the wire.

use std::path::PathBuf;

use tonic::Code;
use tonic::transport::Channel;
use tsukamu_proto::v1;
use tsukamu_proto::v1::recordings_client::RecordingsClient;
use tsukamu_server::daemon::{Daemon, start};
use tsukamu_server::settings::Mode;

use super::support::{config, connect, control, cubes, soon, step, tick};

/// A folder of its own, empty.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

pub(crate) async fn recordings(daemon: &Daemon) -> RecordingsClient<Channel> {
    RecordingsClient::new(connect(daemon).await)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_session_is_recorded_and_played_again() {
    let mut config = config(cubes(3, 240.0), Mode::Lockstep);
    config.recording.dir = folder("daemon-recordings");
    let daemon = start(config).await.expect("it starts");
    let (mut control, mut desk) = (control(&daemon).await, recordings(&daemon).await);
    step(&mut control, 10).await;
    let request = v1::StartRecordingRequest {
        name: "run".to_owned(),
        frames: true,
        raw: true,
    };
    let begun = soon(desk.start_recording(request.clone()))
        .await
        .expect("it begins")
        .into_inner();
    assert_eq!(
        (begun.name.as_str(), tick(begun.stamp)),
        ("run.mcap", 10),
        "the world goes on"
    );
    step(&mut control, 100).await;
    soon(control.remove_object(v1::RemoveObjectRequest { id: 2 }))
        .await
        .expect("it is there");
    let end = step(&mut control, 400).await;
    let done = soon(desk.stop_recording(v1::StopRecordingRequest {}))
        .await
        .expect("it ends")
        .into_inner();
    assert_eq!((done.name.as_str(), done.dropped), ("run.mcap", 0));
    assert!(done.messages > 500 && done.bytes > 0, "{done:?}");
    let play = |name: &str| v1::PlayRecordingRequest {
        name: name.to_owned(),
    };
    let played = soon(desk.play_recording(play("run.mcap")))
        .await
        .expect("it plays")
        .into_inner();
    assert_eq!(tick(played.stamp), 10);
    let refused = soon(control.reset(v1::ResetRequest {}))
        .await
        .expect_err("a playback is not disturbed");
    assert_eq!(refused.code(), Code::FailedPrecondition);
    let again = step(&mut control, 500).await;
    assert_eq!(
        (tick(again.stamp), again.digest),
        (tick(end.stamp), end.digest),
        "the same to the last bit"
    );
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn recordings_are_listed_and_mistakes_told() {
    let mut config = config(cubes(1, 240.0), Mode::Lockstep);
    config.recording.dir = folder("daemon-list");
    let daemon = start(config).await.expect("it starts");
    let mut desk = recordings(&daemon).await;
    let list = v1::ListRecordingsRequest {};
    let empty = soon(desk.list_recordings(list))
        .await
        .expect("no folder yet")
        .into_inner();
    assert!(empty.recordings.is_empty());
    let idle = soon(desk.stop_recording(v1::StopRecordingRequest {}))
        .await
        .expect_err("nothing to stop");
    assert_eq!(idle.code(), Code::FailedPrecondition);
    let request = v1::StartRecordingRequest {
        name: "run".to_owned(),
        frames: false,
        raw: false,
    };
    soon(desk.start_recording(request.clone()))
        .await
        .expect("it begins");
    let second = soon(desk.start_recording(request.clone()))
        .await
        .expect_err("one at a time");
    assert_eq!(second.code(), Code::FailedPrecondition);
    let done = soon(desk.stop_recording(v1::StopRecordingRequest {}))
        .await
        .expect("it ends")
        .into_inner();
    let listed = soon(desk.list_recordings(list))
        .await
        .expect("a list")
        .into_inner()
        .recordings;
    let listed: Vec<(&str, u64)> = listed.iter().map(|r| (r.name.as_str(), r.bytes)).collect();
    assert_eq!(listed, [("run.mcap", done.bytes)]);
    let taken = soon(desk.start_recording(request))
        .await
        .expect_err("the name is taken");
    let expected = "a recording of that name is there already: run.mcap; choose another";
    assert_eq!(
        (taken.code(), taken.message()),
        (Code::AlreadyExists, expected)
    );
    for (name, code) in [
        ("none.mcap", Code::NotFound),
        ("../run.mcap", Code::InvalidArgument),
    ] {
        let request = v1::PlayRecordingRequest {
            name: name.to_owned(),
        };
        let refused = soon(desk.play_recording(request)).await.expect_err(name);
        assert_eq!(refused.code(), code, "{refused}");
    }
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recording_is_finished_when_the_daemon_stops() {
    let mut config = config(cubes(3, 240.0), Mode::Realtime);
    let dir = folder("daemon-drain");
    config.recording.dir = dir.clone();
    config.recording.from_start = true;
    let daemon = start(config).await.expect("it starts");
    let mut world = super::support::world(&daemon).await;
    let mut frames = super::support::watch(&mut world, 0.0).await;
    while tick(super::support::next_frame(&mut frames, &mut 0).await.stamp) < 30 {}
    soon(daemon.shutdown()).await.expect("a clean end");
    let file = std::fs::read_dir(dir)
        .expect("a folder")
        .next()
        .expect("a recording")
        .expect("a file")
        .path();
    let mut records = tsukamu_server::record::reader::open(&file).expect("it opens");
    let n_records = records.by_ref().count();
    assert!(n_records > 30, "{n_records} records");
    assert_eq!(
        records.ending(),
        Some(&tsukamu_server::record::reader::Ending::Complete)
    );
}
