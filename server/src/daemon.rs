//! Builds the parts, starts them, waits, drains.

use std::collections::BTreeMap;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use thiserror::Error;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinError;
use tracing::{info, warn};

use crate::broadcast::inbox::Inbox;
use crate::broadcast::publisher::{Published, Publisher};
use crate::broadcast::subscriber::FrameLane;
use crate::clock::Clock;
use crate::event_log::event_log;
use crate::front;
use crate::input::serial::{PortContext, RawTap, SerialFault, SerialPorts};
use crate::input::sources::Sources;
use crate::metrics::Metrics;
use crate::recorder_handle::RecordOptions;
use crate::recording_desk::{DeskFault, RecordingDesk};
use crate::service::Backend;
use crate::settings::device::DeviceSettings;
use crate::settings::hand::HandSettings;
use crate::settings::{Mode, PublishSettings, RecordingSettings};
use crate::status::StatusBoard;
use crate::ticker::Ticker;
use crate::ticker::engine::{Engine, Outlets};
use crate::ticker::request::{Plan, TickerHandle};

/// How long connections have to end after a stop.
const GRACE: Duration = Duration::from_secs(3);

/// What a daemon is started with.
#[derive(Debug)]
pub struct DaemonConfig {
    /// Where it listens; port 0 takes a free one.
    pub listen: SocketAddr,
    /// How time passes.
    pub mode: Mode,
    /// What the first epoch begins with.
    pub plan: Plan,
    /// Keyframes and the event log.
    pub publish: PublishSettings,
    /// Recordings.
    pub recording: RecordingSettings,
    /// Gloves and trackers.
    pub devices: Vec<DeviceSettings>,
    /// Hands driven by them.
    pub hands: Vec<HandSettings>,
    /// For people: what goes into every recording beside the scene.
    pub session: BTreeMap<String, String>,
}

impl DaemonConfig {
    /// Loopback, a free port, no devices, recordings in the system's folder for temporary files.
    pub fn new(plan: Plan, mode: Mode) -> Self {
        Self {
            listen: SocketAddr::from(([127, 0, 0, 1], 0)),
            mode,
            plan,
            publish: PublishSettings {
                keyframe_interval_s: 1.0,
                event_log: 65_536,
            },
            recording: RecordingSettings {
                dir: PathBuf::from("recordings"),
                from_start: false,
                frames: false,
                raw: false,
            },
            devices: Vec::new(),
            hands: Vec::new(),
            session: BTreeMap::new(),
        }
    }
}

/// Why a daemon does not start, or does not end well.
#[derive(Debug, Error)]
pub enum DaemonError {
    /// Somebody listens there already.
    #[error(
        "{0} is in use: is a daemon running already? Stop it, or choose another address with --listen"
    )]
    InUse(SocketAddr),
    /// The address cannot be listened on.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// The system refuses a thread.
    #[error("no thread for {0}: {1}")]
    Thread(&'static str, io::Error),
    /// A device's hand or thread is refused.
    #[error(transparent)]
    Serial(#[from] SerialFault),
    /// The recording cannot begin or end.
    #[error(transparent)]
    Recording(#[from] DeskFault),
    /// The port broke.
    #[error("the port broke: {0}")]
    Port(io::Error),
    /// A part has panicked; the log says where.
    #[error("{0} has panicked")]
    Panicked(&'static str),
}

/// A running daemon.
#[derive(Debug)]
pub struct Daemon {
    local_addr: SocketAddr,
    stop: watch::Sender<bool>,
    backend: Backend,
    ports: Option<SerialPorts>,
    tick_thread: JoinHandle<()>,
    publisher_thread: JoinHandle<()>,
    front: tokio::task::JoinHandle<io::Result<()>>,
    tick_ended: watch::Receiver<()>,
}

/// Starts a daemon on the present tokio runtime.
///
/// # Errors
/// When the address is in use, or the system refuses a part.
pub async fn start(config: DaemonConfig) -> Result<Daemon, DaemonError> {
    // First of all: nothing is started when the port cannot be had.
    let listener = listen(config.listen).await?;
    let local_addr = listener.local_addr().map_err(DaemonError::Port)?;
    let (stop, stopping) = watch::channel(false);
    let (ticker, requests) = TickerHandle::channel();
    let outlets = Outlets {
        inbox: Arc::new(Inbox::default()),
        sources: Sources::new(),
        metrics: Arc::new(Metrics::new()),
        status: Arc::new(StatusBoard::default()),
        raw_tap: RawTap::default(),
        clock: Clock::start(),
    };
    let (events, log) = event_log(config.publish.event_log);
    let (frames, newest) = watch::channel(Published::default());
    let key_interval_ns = (config.publish.keyframe_interval_s * 1.0e9) as u64;
    let (inbox, metrics) = (Arc::clone(&outlets.inbox), Arc::clone(&outlets.metrics));
    let publisher = Publisher {
        inbox,
        frames,
        events,
        metrics,
        key_interval_ns,
    };
    let publisher_thread = spawn("publisher", move || publisher.run())?;

    let engine = Engine::new(outlets.clone(), config.plan);
    let loop_of_world = Ticker::new(engine, requests, config.mode);
    let (ended, tick_ended) = watch::channel(());
    let tick_thread = spawn("tick", move || {
        // Dropped at the end, in whatever way that comes.
        let _ended = ended;
        loop_of_world.run();
    })?;

    let recordings = Arc::new(RecordingDesk::new(
        config.recording.dir.clone(),
        config.session,
    ));
    let backend = Backend {
        ticker: ticker.clone(),
        frames: FrameLane {
            inbox: outlets.inbox,
            frames: newest,
            metrics: Arc::clone(&outlets.metrics),
        },
        events: log,
        sources: outlets.sources.clone(),
        metrics: outlets.metrics,
        status: outlets.status,
        recordings,
        clock: outlets.clock,
        stopping: stopping.clone(),
    };
    let context = PortContext {
        sources: outlets.sources,
        ticker,
        raw_tap: outlets.raw_tap,
        clock: outlets.clock,
    };
    let ports = SerialPorts::open(&config.devices, &config.hands, &context)?;
    let front = tokio::spawn(front::serve(listener, backend.clone(), until(stopping)));
    info!(address = %local_addr, "listening");
    let daemon = Daemon {
        local_addr,
        stop,
        backend,
        ports: Some(ports),
        tick_thread,
        publisher_thread,
        front,
        tick_ended,
    };
    if config.recording.from_start {
        let options = RecordOptions {
            frames: config.recording.frames,
            raw: config.recording.raw,
        };
        daemon
            .backend
            .recordings
            .start(&daemon.backend.ticker, String::new(), options)
            .await?;
    }
    Ok(daemon)
}

impl Daemon {
    /// Where it listens.
    pub const fn local_addr(&self) -> SocketAddr {
        self.local_addr
    }

    /// What its services share.
    pub const fn backend(&self) -> &Backend {
        &self.backend
    }

    /// Waits until the tick thread ends by itself, which it does only when it panics.
    pub async fn failed(&self) {
        let mut ended = self.tick_ended.clone();
        while ended.changed().await.is_ok() {}
    }

    /// Drains: the world stops, streams end, the recording is finished. Connections that do not end within the grace
    /// time are cut.
    ///
    /// # Errors
    /// When the recording could not be written, or a part has panicked.
    pub async fn shutdown(mut self) -> Result<(), DaemonError> {
        info!("stopping");
        self.stop.send_replace(true);
        let (ports, ticker) = (self.ports.take(), self.backend.ticker.clone());
        let (tick_thread, publisher_thread) = (self.tick_thread, self.publisher_thread);
        let threads = tokio::task::spawn_blocking(move || {
            ports.map(SerialPorts::close);
            ticker.stop();
            let ticked = tick_thread
                .join()
                .map_err(|_| DaemonError::Panicked("the tick thread"));
            let published = publisher_thread
                .join()
                .map_err(|_| DaemonError::Panicked("the publisher"));
            ticked.and(published)
        });
        let threads = threads
            .await
            .unwrap_or_else(|_: JoinError| Err(DaemonError::Panicked("the drain")));
        let recorded = self.backend.recordings.drain().await;
        let front = match tokio::time::timeout(GRACE, &mut self.front).await {
            Ok(Ok(served)) => served.map_err(DaemonError::Port),
            Ok(Err(_)) => Err(DaemonError::Panicked("the front")),
            Err(_) => {
                warn!("connections did not end in time and are cut");
                self.front.abort();
                Ok(())
            }
        };
        threads?;
        recorded?;
        front
    }
}

async fn listen(address: SocketAddr) -> Result<TcpListener, DaemonError> {
    TcpListener::bind(address)
        .await
        .map_err(|source| match source.kind() {
            io::ErrorKind::AddrInUse => DaemonError::InUse(address),
            _ => DaemonError::Listen { address, source },
        })
}

async fn until(mut stopping: watch::Receiver<bool>) {
    // An error says that the daemon itself is gone.
    let _ = stopping.wait_for(|stops| *stops).await;
}

fn spawn(
    name: &'static str,
    work: impl FnOnce() + Send + 'static,
) -> Result<JoinHandle<()>, DaemonError> {
    std::thread::Builder::new()
        .name(name.to_owned())
        .spawn(work)
        .map_err(|fault| DaemonError::Thread(name, fault))
}
