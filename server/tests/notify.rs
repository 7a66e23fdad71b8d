//! What the service manager is told, over a socket that stands in for it.

use std::ffi::OsString;
use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use tsukamu_server::broadcast::inbox::Inbox;
use tsukamu_server::daemon::{self, Daemon, DaemonConfig};
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file::load;
use tsukamu_server::sd_notify::ServiceManager;
use tsukamu_server::settings::Mode;
use tsukamu_server::ticker::request::Request;

/// Longest that anything is waited for.
const DEADLINE: Duration = Duration::from_secs(60);
/// After how long without a sign of life a manager would end the daemon.
const WATCHDOG: Duration = Duration::from_millis(400);

/// A socket that gets what the service manager would.
struct Manager {
    socket: UnixDatagram,
    /// What `NOTIFY_SOCKET` says.
    name: OsString,
    folder: Option<PathBuf>,
}

impl Drop for Manager {
    fn drop(&mut self) {
        if let Some(folder) = &self.folder {
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}

impl Manager {
    fn at_a_path(test: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("tsukamu-{test}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("notify");
        let _ = std::fs::remove_file(&path);
        let socket = UnixDatagram::bind(&path).expect("a socket");
        Self {
            socket,
            name: path.into_os_string(),
            folder: Some(folder),
        }
    }

    #[cfg(target_os = "linux")]
    fn at_an_abstract_name(test: &str) -> Self {
        use std::os::linux::net::SocketAddrExt;
        use std::os::unix::net::SocketAddr;
        let name = format!("tsukamu-{test}-{}", std::process::id());
        let address = SocketAddr::from_abstract_name(&name).expect("a name");
        Self {
            socket: UnixDatagram::bind_addr(&address).expect("a socket"),
            name: OsString::from(format!("@{name}")),
            folder: None,
        }
    }

    /// The next message, if one comes by then.
    fn next(&self, limit: Duration) -> Option<String> {
        self.socket.set_read_timeout(Some(limit)).expect("a limit");
        let mut buffer = [0; 4096];
        let n_bytes = self.socket.recv(&mut buffer).ok()?;
        Some(String::from_utf8_lossy(&buffer[..n_bytes]).into_owned())
    }

    /// Waits for a message that has this line.
    fn wait_for(&self, line: &str) -> String {
        let since = Instant::now();
        let mut others = Vec::new();
        while since.elapsed() < DEADLINE {
            match self.next(Duration::from_secs(1)) {
                Some(message) if message.lines().any(|found| found == line) => return message,
                Some(message) => others.push(message),
                None => {}
            }
        }
        panic!("no {line} among {others:?}");
    }

    /// Messages of that time.
    fn during(&self, time: Duration) -> Vec<String> {
        let end = Instant::now() + time;
        let mut messages = Vec::new();
        loop {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return messages;
            }
            messages.extend(self.next(left));
        }
    }

    fn variable(&self, name: &str) -> Option<OsString> {
        match name {
            "NOTIFY_SOCKET" => Some(self.name.clone()),
            "WATCHDOG_USEC" => Some(WATCHDOG.as_micros().to_string().into()),
            _ => None,
        }
    }

    fn told_by_this_process(&self) -> ServiceManager {
        let variable = |name: &str| self.variable(name);
        ServiceManager::from_variables(variable, std::process::id()).expect("an address")
    }
}

/// A process that does not outlive the test.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The real binary under a manager, with further arguments.
fn tsukamud(manager: &Manager, args: &[&str]) -> Process {
    let child = Command::new(env!("CARGO_BIN_EXE_tsukamud"))
        .args(["serve", "--listen", "127.0.0.1:0", "--log", "warn"])
        .args(args)
        .env("NOTIFY_SOCKET", &manager.name)
        .env("WATCHDOG_USEC", WATCHDOG.as_micros().to_string())
        .env_remove("WATCHDOG_PID")
        .stdout(Stdio::null())
        .spawn();
    Process(child.expect("the binary starts"))
}

fn start_to_stop(manager: &Manager, args: &[&str], pace: &str) {
    let mut process = tsukamud(manager, args);
    let ready = manager.wait_for("READY=1");
    let status = ready.lines().find_map(|line| line.strip_prefix("STATUS="));
    let status = status.expect("a status");
    assert!(status.contains(pace), "{status}");
    for _ in 0..3 {
        manager.wait_for("WATCHDOG=1");
    }
    let pid = process.0.id().to_string();
    let killed = Command::new("kill").args(["-TERM", &pid]).status();
    assert!(killed.expect("kill").success());
    manager.wait_for("STOPPING=1");
    assert!(process.0.wait().expect("it ends").success());
}

#[test]
fn a_manager_hears_of_the_start_of_life_and_of_the_stop() {
    let manager = Manager::at_a_path("notify");
    let args = ["--scene", "operations/free", "--rate-hz", "100"];
    start_to_stop(&manager, &args, "operations/free: 100 steps/s");
}

#[cfg(target_os = "linux")]
#[test]
fn a_manager_at_an_abstract_name_hears_of_a_world_in_lockstep_which_lives_by_waiting() {
    let manager = Manager::at_an_abstract_name("notify-abstract");
    start_to_stop(&manager, &["--mode", "lockstep"], "in lockstep");
}

/// A daemon in this process, without hands.
async fn daemon_here(mode: Mode) -> Daemon {
    let loaded = load("operations/free").expect("a scene");
    let plan = plan(&loaded, Cast::Nobody).expect("a plan");
    let daemon = daemon::start(DaemonConfig::new(plan, mode)).await;
    daemon.expect("a daemon")
}

/// What the manager hears while the tick thread is held fast, and after it is let go. Every step posts to the inbox:
/// whoever holds it holds the tick.
fn held_and_let_go(manager: &Manager, inbox: &Arc<Inbox>) -> (Vec<String>, String) {
    manager.wait_for("WATCHDOG=1");
    let (held, is_held) = mpsc::sync_channel(1);
    let (let_go, is_let_go) = mpsc::sync_channel::<()>(1);
    let inbox = Arc::clone(inbox);
    let holder = std::thread::spawn(move || {
        inbox.post(|_batch| {
            held.send(()).expect("the test waits");
            let _ = is_let_go.recv_timeout(DEADLINE);
        });
    });
    is_held.recv_timeout(DEADLINE).expect("the tick is held");
    manager.wait_for("STATUS=the world stands still");
    let silence = manager.during(WATCHDOG * 5);
    let_go.send(()).expect("the holder waits");
    holder.join().expect("the holder ends");
    (silence, manager.wait_for("WATCHDOG=1"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_tick_that_stands_still_is_not_vouched_for() {
    let manager = Manager::at_a_path("notify-held");
    let daemon = daemon_here(Mode::Realtime).await;
    let told = manager.told_by_this_process();
    let inbox = Arc::clone(&daemon.backend().frames.inbox);
    let heard = tokio::task::spawn_blocking(move || held_and_let_go(&manager, &inbox));
    let (silence, beat) = tokio::select! {
        () = told.keep_informed(&daemon, &[]) => unreachable!("it never ends"),
        heard = heard => heard.expect("what was heard"),
    };
    assert_eq!(silence, Vec::<String>::new());
    assert_eq!(beat, "WATCHDOG=1");
    daemon.shutdown().await.expect("an orderly end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_world_that_is_paused_lives() {
    let manager = Manager::at_a_path("notify-paused");
    let daemon = daemon_here(Mode::Realtime).await;
    let paused = daemon.backend().ticker.ask(Request::Pause).await;
    let tick = paused.expect("a clock to stop").tick;
    let told = manager.told_by_this_process();
    let heard = tokio::time::timeout(WATCHDOG * 8, told.keep_informed(&daemon, &[])).await;
    assert!(heard.is_err(), "it never ends");
    let messages = manager.during(Duration::from_millis(100));
    let n_beats = messages.iter().filter(|text| *text == "WATCHDOG=1").count();
    assert!(n_beats >= 4, "{messages:?}");
    assert!(messages.iter().any(|text| text.contains("paused")));
    assert_eq!(
        daemon.backend().status.stamp().tick,
        tick,
        "and does not step"
    );
    daemon.shutdown().await.expect("an orderly end");
}
