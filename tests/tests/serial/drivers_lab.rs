//! A daemon with many devices, and what a client sees of each of them.

use std::future::Future;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tokio::sync::watch;
use tokio::task::JoinSet;
use tsukamu_client::connect::{Client, ConnectOptions};
use tsukamu_client::event_watch::{EventUpdate, EventWatch};
use tsukamu_client::subscribe::{FrameOptions, FrameUpdate, FrameWatch};
use tsukamu_client::view::{HandView, WorldView};
use tsukamu_proto::v1;
use tsukamu_proto::v1::event::Kind;
use tsukamu_server::daemon::{Daemon, DaemonConfig, start};

/// Longest wait for anything, far beyond what it takes on a loaded machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);
/// Frames per second that a client looks at.
const FRAME_RATE_HZ: f64 = 60.0;

/// A pause of this program, whatever the reason, that a test of rates and lost bytes cannot overlook: a terminal holds
/// what a device says in a third of a second.
const STUTTER: Duration = Duration::from_millis(150);
/// How often it is looked at.
const RULER: Duration = Duration::from_millis(5);

/// Notes when this program got no time from a machine that is busy with others.
pub(crate) struct Ruler {
    stutters: Arc<Mutex<Vec<Instant>>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Ruler {
    pub(crate) fn new() -> Self {
        let stutters = Arc::new(Mutex::new(Vec::new()));
        let stop = Arc::new(AtomicBool::new(false));
        let (noted, stopped) = (Arc::clone(&stutters), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let mut last = Instant::now();
            while !stopped.load(Ordering::Relaxed) {
                std::thread::park_timeout(RULER);
                if last.elapsed() > STUTTER {
                    lock(&noted).push(Instant::now());
                }
                last = Instant::now();
            }
        });
        Self {
            stutters,
            stop,
            thread: Some(thread),
        }
    }

    /// How often it did since then.
    pub(crate) fn n_stutters_since(&self, begun: Instant) -> usize {
        let stutters = lock(&self.stutters);
        stutters.iter().filter(|at| **at >= begun).count()
    }
}

impl Drop for Ruler {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn lock<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A daemon and a client of it that keeps its eyes open.
pub(crate) struct Lab {
    pub(crate) client: Client,
    /// When the daemon was started.
    pub(crate) started: Instant,
    /// Whether the machine lets it.
    pub(crate) ruler: Ruler,
    daemon: Mutex<Option<Daemon>>,
    rows: watch::Receiver<Vec<v1::Device>>,
    view: watch::Receiver<WorldView>,
    events: watch::Receiver<Vec<v1::Event>>,
    _eyes: JoinSet<()>,
}

impl Lab {
    pub(crate) async fn new(config: DaemonConfig) -> Self {
        let started = Instant::now();
        let daemon = start(config).await.unwrap();
        let options = ConnectOptions {
            address: format!("http://{}", daemon.local_addr()),
            ..ConnectOptions::default()
        };
        let client = Client::connect(options).await.unwrap();
        let (rows_out, rows) = watch::channel(Vec::new());
        let (view_out, view) = watch::channel(WorldView::default());
        let (events_out, events) = watch::channel(Vec::new());
        let mut eyes = JoinSet::new();
        eyes.spawn(watch_rows(client.clone(), rows_out));
        eyes.spawn(watch_frames(client.clone(), view_out));
        eyes.spawn(watch_events(client.clone(), events_out));
        Self {
            client,
            started,
            ruler: Ruler::new(),
            daemon: Mutex::new(Some(daemon)),
            rows,
            view,
            events,
            _eyes: eyes,
        }
    }

    /// Waits for a frame in which the hand of that number (its id + 1) will do, which is asked with the frame's tick.
    /// Without end: the caller knows best what to say when it does not come.
    pub(crate) async fn hand_that(
        &self,
        number: u32,
        mut will_do: impl FnMut(u64, &HandView) -> bool,
    ) {
        let will_do = |view: &WorldView| {
            let hand = view.hands.iter().find(|hand| hand.id + 1 == number);
            hand.is_some_and(|hand| will_do(view.stamp.tick, hand))
                .then_some(())
        };
        until(&self.view, will_do).await;
    }

    /// The list of devices as it is now.
    pub(crate) async fn rows(&self) -> Vec<v1::Device> {
        let request = v1::ListDevicesRequest {};
        let answer = self.client.devices().list_devices(request).await;
        answer.unwrap().into_inner().devices
    }

    /// The row of a device as it is now.
    pub(crate) async fn row(&self, name: &str) -> v1::Device {
        let mut rows = self.rows().await.into_iter();
        rows.find(|row| row.name == name).unwrap()
    }

    /// Waits for a row that will do.
    pub(crate) async fn row_that(
        &self,
        name: &str,
        what: &str,
        will_do: impl Fn(&v1::Device) -> bool,
    ) -> v1::Device {
        let find = until(&self.rows, |rows| {
            let row = rows.iter().find(|row| row.name == name);
            row.filter(|row| will_do(row)).cloned()
        });
        match tokio::time::timeout(PATIENCE, find).await {
            Ok(row) => row,
            Err(_) => panic!(
                "{what}: not within {PATIENCE:?}: {:?}",
                self.row(name).await
            ),
        }
    }

    /// Waits for a view that will do.
    pub(crate) async fn view_that(&self, what: &str, will_do: impl Fn(&WorldView) -> bool) {
        soon(what, until(&self.view, |view| will_do(view).then_some(()))).await;
    }

    /// How many events there have been so far.
    pub(crate) fn n_events(&self) -> usize {
        self.events.borrow().len()
    }

    /// The events so far from one on.
    pub(crate) fn events_from(&self, first: usize) -> Vec<v1::Event> {
        self.events.borrow()[first..].to_vec()
    }

    /// Waits for an event that will do, at that number or behind it; its number.
    pub(crate) async fn event_from(
        &self,
        first: usize,
        what: &str,
        will_do: impl Fn(&v1::Event, &Kind) -> bool,
    ) -> usize {
        let find = until(&self.events, |events| {
            let suits =
                |event: &v1::Event| event.kind.as_ref().is_some_and(|kind| will_do(event, kind));
            let index = events[first..].iter().position(suits)?;
            Some(first + index)
        });
        soon(what, find).await
    }

    /// Losses (true) and returns (false) of a device so far.
    pub(crate) fn comings_and_goings(&self, name: &str) -> Vec<bool> {
        let events = self.events.borrow();
        let of_device = events.iter().filter_map(|event| match &event.kind {
            Some(Kind::DeviceLost(lost)) if lost.device == name => Some(true),
            Some(Kind::DeviceReturned(back)) if back.device == name => Some(false),
            _ => None,
        });
        of_device.collect()
    }

    /// Drains the daemon.
    pub(crate) async fn end(&self) {
        let daemon = lock(&self.daemon).take();
        daemon.unwrap().shutdown().await.unwrap();
    }
}

/// Waits until the question finds an answer in what the watch shows.
async fn until<S, T>(seen: &watch::Receiver<S>, mut ask: impl FnMut(&S) -> Option<T>) -> T {
    let mut seen = seen.clone();
    loop {
        if let Some(answer) = ask(&seen.borrow_and_update()) {
            return answer;
        }
        seen.changed().await.unwrap();
    }
}

/// The value of a future that comes in time.
pub(crate) async fn soon<T>(what: &str, future: impl Future<Output = T>) -> T {
    match tokio::time::timeout(PATIENCE, future).await {
        Ok(value) => value,
        Err(_) => panic!("{what}: not within {PATIENCE:?}"),
    }
}

async fn watch_rows(client: Client, out: watch::Sender<Vec<v1::Device>>) {
    let request = v1::WatchDevicesRequest {};
    let stream = client.devices().watch_devices(request).await;
    let mut stream = stream.unwrap().into_inner();
    while let Ok(Some(list)) = stream.message().await {
        out.send_replace(list.devices);
    }
}

async fn watch_frames(client: Client, out: watch::Sender<WorldView>) {
    let options = FrameOptions {
        max_rate_hz: FRAME_RATE_HZ,
    };
    let mut frames = FrameWatch::open(&client, options).await.unwrap();
    while let Ok(FrameUpdate::Frame { .. } | FrameUpdate::Skipped(_)) = frames.next().await {
        if let Some(view) = frames.view() {
            out.send_replace(view.clone());
        }
    }
}

async fn watch_events(client: Client, out: watch::Sender<Vec<v1::Event>>) {
    let mut events = EventWatch::open(&client, 1).await.unwrap();
    while let Ok(EventUpdate::Event(event)) = events.next().await {
        out.send_modify(|all| all.push(*event));
    }
}
