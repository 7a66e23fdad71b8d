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
use crate::calibration::desk::CalibrationDesk;
use crate::calibration::taps::Taps;
use crate::clock::Clock;
use crate::event_log::{EventLog, event_log};
use crate::front;
use crate::input::serial::{PortContext, RawTap, SerialFault, SerialPorts};
use crate::input::sources::Sources;
use crate::metrics::Metrics;
use crate::recorder_handle::RecordOptions;
use crate::recording_desk::{DeskFault, RecordingDesk};
use crate::service::Backend;
use crate::settings::device::DeviceSettings;
use crate::settings::hand::HandSettings;
use crate::settings::vrpn::VrpnSettings;
use crate::settings::{Mode, PublishSettings, RecordingSettings};
use crate::status::StatusBoard;
use crate::ticker::Ticker;
use crate::ticker::engine::{Engine, Outlets};
use crate::ticker::pulse::{Heartbeat, Pulse};
use crate::ticker::request::{Beginning, Plan, TickerHandle};
use crate::vrpn::listen::Sockets;
use crate::vrpn::{VrpnFault, VrpnServer};

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
    /// The VRPN server; `None` is off.
    pub vrpn: Option<VrpnSettings>,
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
            vrpn: None,
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
    /// The VRPN server cannot listen.
    #[error(transparent)]
    Vrpn(#[from] VrpnFault),
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
    threads: Threads,
    vrpn: Option<VrpnServer>,
    front: tokio::task::JoinHandle<io::Result<()>>,
}

/// The threads that are no tasks.
#[derive(Debug)]
struct Threads {
    tick: JoinHandle<()>,
    publisher: JoinHandle<()>,
    pulse: Arc<Pulse>,
    /// True when one of them has ended, in whatever way.
    ended: watch::Receiver<bool>,
}

/// Says that a thread has ended, also when it panics; nothing is left to wait for it in vain.
#[derive(Debug)]
struct Ends {
    ended: watch::Sender<bool>,
    inbox: Arc<Inbox>,
}

impl Drop for Ends {
    fn drop(&mut self) {
        self.inbox.post(|batch| batch.stopped = true);
        self.ended.send_replace(true);
    }
}

/// Starts a daemon on the present tokio runtime.
///
/// # Errors
/// When the address is in use, or the system refuses a part.
pub async fn start(config: DaemonConfig) -> Result<Daemon, DaemonError> {
    // First of all: nothing is started when the port cannot be had.
    let listener = listen(config.listen).await?;
    let local_addr = listener.local_addr().map_err(DaemonError::Port)?;
    let vrpn_sockets = match &config.vrpn {
        Some(settings) => Some((Sockets::bind(settings.listen).await?, *settings)),
        None => None,
    };
    let (stop, stopping) = watch::channel(false);
    let (ticker, requests) = TickerHandle::channel();
    let outlets = outlets();
    let (events_in, events) = event_log(config.publish.event_log);
    let (frames_in, frames) = watch::channel(Published::default());
    let publisher = Publisher {
        inbox: Arc::clone(&outlets.inbox),
        frames: frames_in,
        events: events_in,
        metrics: Arc::clone(&outlets.metrics),
        key_interval_ns: (config.publish.keyframe_interval_s * 1.0e9) as u64,
    };
    let engine = Engine::new(outlets.clone(), config.plan);
    let threads = Threads::spawn(publisher, Ticker::new(engine, requests, config.mode))?;

    let recordings = RecordingDesk::new(config.recording.dir, config.session);
    let lanes = (frames, events);
    let backend = backend(&outlets, ticker, lanes, recordings, stopping.clone());
    let context = port_context(outlets, &backend);
    let ports = Some(SerialPorts::open(&config.devices, &config.hands, &context)?);
    if config.recording.from_start {
        let options = RecordOptions {
            frames: config.recording.frames,
            raw: config.recording.raw,
        };
        backend
            .recordings
            .start(&backend.ticker, String::new(), options, Beginning::NewEpoch)
            .await?;
    }
    let vrpn = vrpn_sockets.map(|(sockets, settings)| {
        let (inbox, metrics) = (&backend.frames.inbox, &backend.metrics);
        let (inbox, metrics) = (Arc::clone(inbox), Arc::clone(metrics));
        VrpnServer::start(sockets, &settings, inbox, metrics, stopping.clone())
    });
    let front = tokio::spawn(front::serve(listener, backend.clone(), until(stopping)));
    info!(address = %local_addr, "listening");
    Ok(Daemon {
        local_addr,
        stop,
        backend,
        ports,
        threads,
        vrpn,
        front,
    })
}

fn port_context(outlets: Outlets, backend: &Backend) -> PortContext {
    PortContext {
        sources: outlets.sources,
        ticker: backend.ticker.clone(),
        raw_tap: outlets.raw_tap,
        inbox: outlets.inbox,
        status: outlets.status,
        clock: outlets.clock,
        taps: backend.calibration.taps().clone(),
    }
}

fn backend(
    outlets: &Outlets,
    ticker: TickerHandle,
    (frames, events): (watch::Receiver<Published>, EventLog),
    recordings: RecordingDesk,
    stopping: watch::Receiver<bool>,
) -> Backend {
    let (inbox, metrics) = (Arc::clone(&outlets.inbox), Arc::clone(&outlets.metrics));
    Backend {
        ticker,
        frames: FrameLane {
            inbox,
            frames,
            metrics: Arc::clone(&outlets.metrics),
        },
        events,
        sources: outlets.sources.clone(),
        metrics,
        status: Arc::clone(&outlets.status),
        recordings: Arc::new(recordings),
        calibration: Arc::new(CalibrationDesk::new(Taps::default())),
        clock: outlets.clock,
        stopping,
    }
}

fn outlets() -> Outlets {
    Outlets {
        inbox: Arc::new(Inbox::default()),
        sources: Sources::new(),
        metrics: Arc::new(Metrics::new()),
        status: Arc::new(StatusBoard::default()),
        raw_tap: RawTap::default(),
        clock: Clock::start(),
    }
}

impl Threads {
    fn spawn(publisher: Publisher, ticker: Ticker) -> Result<Self, DaemonError> {
        let (sender, ended) = watch::channel(false);
        let inbox = Arc::clone(&publisher.inbox);
        let ends = || Ends {
            ended: sender.clone(),
            inbox: Arc::clone(&inbox),
        };
        let (ends_of_publisher, ends_of_tick) = (ends(), ends());
        let pulse = ticker.pulse();
        let publisher = spawn("publisher", move || {
            let _ends = ends_of_publisher;
            publisher.run();
        })?;
        let tick = spawn("tick", move || {
            let _ends = ends_of_tick;
            ticker.run();
        })?;
        Ok(Self {
            tick,
            publisher,
            pulse,
            ended,
        })
    }

    /// Waits for both.
    fn join(self) -> Result<(), DaemonError> {
        // What a panic carries has been printed by the thread itself.
        let panicked = |part| move |_panic| DaemonError::Panicked(part);
        let ticked = self.tick.join().map_err(panicked("the tick thread"));
        let published = self.publisher.join().map_err(panicked("the publisher"));
        ticked.and(published)
    }
}

impl Daemon {
    /// Where it listens.
    pub const fn local_addr(&self) -> SocketAddr {
        self.local_addr
    }

    /// Where its VRPN server listens, if it has one.
    pub fn vrpn_addr(&self) -> Option<SocketAddr> {
        self.vrpn.as_ref().map(VrpnServer::address)
    }

    /// What its services share.
    pub const fn backend(&self) -> &Backend {
        &self.backend
    }

    /// Looks at the tick thread's own signs of life from now on.
    pub fn heartbeat(&self) -> Heartbeat {
        Heartbeat::new(Arc::clone(&self.threads.pulse))
    }

    /// Waits until a part ends by itself, which happens only when it panics.
    pub async fn failed(&self) {
        // An error says that all are gone.
        let _ = self.threads.ended.clone().wait_for(|ended| *ended).await;
    }

    /// Drains: the world stops, streams end, the recording is finished. Connections that do not end within the grace
    /// time are cut.
    ///
    /// # Errors
    /// When the recording could not be written, or a part has panicked.
    pub async fn shutdown(mut self) -> Result<(), DaemonError> {
        info!("stopping");
        self.stop.send_replace(true);
        let (ports, ticker, threads) =
            (self.ports.take(), self.backend.ticker.clone(), self.threads);
        let threads = tokio::task::spawn_blocking(move || {
            if let Some(ports) = ports {
                ports.close();
            }
            ticker.stop();
            threads.join()
        });
        let threads = threads
            .await
            .unwrap_or_else(|_: JoinError| Err(DaemonError::Panicked("the drain")));
        let recorded = self.backend.recordings.drain().await;
        if let Some(vrpn) = self.vrpn.take() {
            vrpn.join().await;
        }
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
