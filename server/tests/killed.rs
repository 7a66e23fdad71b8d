//! A daemon that is killed with SIGKILL while it records: everything but the last second can be read and verifies.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use tsukamu_proto::v1;
use tsukamu_proto::v1::watch_frames_response::Kind;
use tsukamu_proto::v1::world_client::WorldClient;
use tsukamu_server::record::reader::{self, Ending};
use tsukamu_server::record::verify::{Verification, verify};

/// Longest that anything is waited for.
const DEADLINE: Duration = Duration::from_secs(60);
/// Steps per second, also those that a kill may cost.
const RATE_HZ: u64 = 240;
/// Ticks after which the daemon is killed.
const TICKS: u64 = 4 * RATE_HZ;

/// A folder of this test's own, gone with it.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A child process that does not outlive the test.
struct Daemon(Child);

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Daemon {
    /// The real binary with a synthetic hand, recording from the start.
    fn start(folder: &Path) -> Self {
        let child = Command::new(env!("CARGO_BIN_EXE_tsukamud"))
            .args([
                "serve",
                "--listen",
                "127.0.0.1:0",
                "--scene",
                "operations/free",
                "--record",
            ])
            .arg("--recording-dir")
            .arg(folder)
            .args(["--rate-hz", &RATE_HZ.to_string(), "--log", "warn"])
            .stdout(Stdio::piped())
            .spawn();
        Self(child.expect("the binary starts"))
    }

    /// Where it listens, from what it says in the terminal.
    fn address(&mut self) -> String {
        let stdout = self.0.stdout.take().expect("it is piped");
        let mut lines = BufReader::new(stdout)
            .lines()
            .map(|line| line.expect("text"));
        let line = lines
            .find(|line| line.contains("http://"))
            .expect("it says where it listens");
        let address = line
            .split_whitespace()
            .find(|word| word.starts_with("http://"));
        address.expect("an address").to_owned()
    }
}

/// Watches until the world is at that tick; returns the tick that was seen.
async fn watch_until(address: String, tick: u64) -> u64 {
    let mut world = WorldClient::connect(address).await.expect("it listens");
    let request = v1::WatchFramesRequest { max_rate_hz: 0.0 };
    let mut frames = world
        .watch_frames(request)
        .await
        .expect("a stream")
        .into_inner();
    loop {
        let message = frames
            .message()
            .await
            .expect("no error")
            .expect("the stream goes on");
        if let Some(Kind::Frame(frame)) = message.kind {
            let seen = frame.stamp.expect("a stamp").tick;
            if seen >= tick {
                return seen;
            }
        }
    }
}

fn check(path: &Path) -> Verification {
    verify(reader::open(path).expect("it opens"), |_| {})
}

#[tokio::test]
async fn a_killed_recording_verifies_but_for_its_last_second() {
    let name = format!("tsukamu-killed-{}", std::process::id());
    let folder = Folder(std::env::temp_dir().join(name));
    std::fs::create_dir_all(&folder.0).expect("a folder");
    let mut daemon = Daemon::start(&folder.0);
    let address = daemon.address();
    let seen = tokio::time::timeout(DEADLINE, watch_until(address, TICKS)).await;
    let seen = seen.expect("the world steps");
    // SIGKILL.
    daemon.0.kill().expect("it runs");
    let status = daemon.0.wait().expect("it ends");
    assert!(!status.success(), "{status}");

    let mut files = std::fs::read_dir(&folder.0).expect("the folder");
    let path = files.next().expect("a recording").expect("an entry").path();
    let found = check(&path);
    assert_eq!(
        (&found.fault, &found.ending),
        (&None, &Some(Ending::Cut)),
        "{found:?}"
    );
    assert!(
        found.ticks + RATE_HZ >= seen,
        "{} of {seen} ticks are readable",
        found.ticks
    );
    assert!(found.digests >= TICKS / RATE_HZ - 1, "{found:?}");

    let command = |args: &[&Path]| {
        let binary = Command::new(env!("CARGO_BIN_EXE_tsukamud"))
            .args(args)
            .output();
        binary.expect("the binary starts")
    };
    let verified = command(&[Path::new("verify"), &path]);
    assert!(verified.status.success(), "{verified:?}");
}
