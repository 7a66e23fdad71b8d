use std::process::{Command, Output};

use serde_json::Value;
use tokio::net::TcpListener;

use crate::events::event;
use crate::fake::{Running, frame, sent, stamp};

/// Runs `tsukamu` to its end.
async fn tsukamu(address: String, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tsukamu"));
    command
        .env_remove("TSUKAMU_ADDRESS")
        .args(["--address", &address])
        .args(args);
    tokio::task::spawn_blocking(move || command.output().unwrap())
        .await
        .unwrap()
}

async fn against(running: &Running, args: &[&str]) -> Output {
    tsukamu(running.fake.address.to_string(), args).await
}

fn stdout(output: &Output) -> String {
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn values(output: &Output) -> Vec<Value> {
    stdout(output)
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// One line on standard error with these parts, nothing on standard output, exit code 1.
fn check_failure(output: &Output, parts: &[&str]) {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(
        (
            output.status.code(),
            text.lines().count(),
            output.stdout.len()
        ),
        (Some(1), 1, 0),
        "{text}"
    );
    for part in parts {
        assert!(text.contains(part), "{part} is missing in: {text}");
    }
}

#[tokio::test]
async fn failures_are_one_clear_line() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap().to_string();
    drop(listener);
    check_failure(
        &tsukamu(address.clone(), &["status"]).await,
        &["no daemon can be reached", &address, "tsukamud"],
    );
    check_failure(
        &tsukamu("no such address".into(), &["status"]).await,
        &["no address of a daemon"],
    );
    let running = Running::start().await;
    check_failure(&against(&running, &["step"]).await, &["the daemon refuses"]);
    check_failure(
        &against(&running, &["send", "no/such/file.csv"]).await,
        &["cannot read no/such/file.csv"],
    );
    running.script().status.protocol_major += 1;
    check_failure(
        &against(&running, &["watch"]).await,
        &["speaks protocol 2, this client 1", "9.8.7"],
    );
}

#[tokio::test]
async fn status_for_people_and_programs() {
    let running = Running::start().await;
    let text = stdout(&against(&running, &["status"]).await);
    for part in [
        "tsukamud 9.8.7",
        "demo (paper), 0 objects, 0 hands",
        "realtime at 240 Hz",
        "up 16 min 40 s",
    ] {
        assert!(text.contains(part), "{part} is missing in\n{text}");
    }
    let value = &values(&against(&running, &["status", "--json"]).await)[0];
    assert_eq!(
        (&value["version"], &value["tick"], &value["recording"]),
        (&"9.8.7".into(), &5.into(), &Value::Null)
    );
    let value = &values(&against(&running, &["--json", "ping", "-n", "3"]).await)[0];
    assert_eq!(value["n"], 3);
    // The fake's clock is 5 s ahead of the sending; half the way is not known.
    let (offset, error) = (
        value["offset_ns"].as_i64().unwrap(),
        value["offset_error_ns"].as_i64().unwrap(),
    );
    assert!(
        (offset - 5_000_000_000).abs() <= error + 1,
        "{offset} ± {error}"
    );
}

#[tokio::test]
async fn watch_prints_frames_for_programs_and_lines_for_people() {
    let running = Running::start().await;
    let script = || {
        vec![
            sent(frame(stamp(1, 10), 10, 1, &[(1, 0.5), (9, 0.25)])),
            sent(frame(stamp(1, 11), 10, 1, &[(1, 0.75)])),
        ]
    };
    running.script().frames = [script(), script()].into();
    let frames = values(
        &against(
            &running,
            &["watch", "--json", "--count", "2", "--rate", "0"],
        )
        .await,
    );
    assert_eq!(frames.len(), 2);
    assert_eq!(
        (&frames[1]["tick"], &frames[1]["skipped"]),
        (&11.into(), &0.into())
    );
    let object = &frames[1]["objects"][0];
    assert_eq!(
        (&object["name"], &object["state"]),
        (&"block 1".into(), &"free".into())
    );
    assert_eq!(
        (&object["position"][0], &object["rotation"][3]),
        (&0.75.into(), &1.0.into())
    );
    assert_eq!(frames[1]["objects"][1]["name"], "object 9");
    let text = stdout(&against(&running, &["watch", "--count", "2"]).await);
    assert!(
        text.contains("tick 11") && text.contains("block 1 free (0.750, 0.000, 0.000)"),
        "{text}"
    );
    assert_eq!(running.script().max_rates_hz, [0.0, 60.0]);
}

#[tokio::test]
async fn events_are_printed_from_the_log_and_on() {
    let running = Running::start().await;
    running.script().events = (1..=9).map(event).collect();
    running.script().oldest_event = 3;
    // Without --follow: what was held when the world stood at tick 5.
    let events = values(&against(&running, &["events", "--json"]).await);
    let sequences: Vec<_> = events
        .iter()
        .map(|event| event["sequence"].as_u64().unwrap())
        .collect();
    assert_eq!(sequences, [3, 4, 5]);
    assert_eq!(
        (&events[0]["kind"], &events[0]["hand"]),
        (&"hand_found".into(), &"hand 0".into())
    );
    let text = stdout(
        &against(
            &running,
            &["events", "--from", "4", "--follow", "--count", "4"],
        )
        .await,
    );
    assert_eq!(text.lines().count(), 4, "{text}");
    assert!(text.contains("#7") && text.contains("hand found"), "{text}");
}

#[tokio::test]
async fn a_file_of_motion_is_sent() {
    let running = Running::start().await;
    let header = tsukamu_motion::hand_csv::header();
    let row = |t_s: &str| format!("{t_s},left,0,0,0,0,0,0,1{}\n", ",".repeat(60));
    let path = std::env::temp_dir().join(format!("tsukamu-client-test-{}.csv", std::process::id()));
    std::fs::write(&path, format!("{header}{}{}", row("0"), row("0.02"))).unwrap();
    let output = against(
        &running,
        &["send", path.to_str().unwrap(), "--name", "wave", "--json"],
    )
    .await;
    let missing = against(
        &running,
        &["send", path.to_str().unwrap(), "--side", "right"],
    )
    .await;
    std::fs::remove_file(&path).unwrap();
    let last = values(&output).pop().unwrap();
    assert_eq!(
        (&last["side"], &last["holds"]),
        (&"left".into(), &"block 2".into())
    );
    assert_eq!(
        last["sent"].as_u64().unwrap() + last["skipped"].as_u64().unwrap(),
        2
    );
    assert_eq!(running.script().opened[0].name, "wave");
    check_failure(&missing, &["the motion has no right hand"]);
}
