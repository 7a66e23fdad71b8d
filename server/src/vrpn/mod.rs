//! A VRPN server: existing virtual-reality software reads hands and objects as trackers, analogs and buttons.
//!
//! ```text
//! publisher thread <--asks for the scene, at the pose rate-- feeder task --watch (newest only)--> a task per client
//! ```
//!
//! The tick does not know of it: the feeder asks the publisher for the scene as any `GetScene` does, and only while
//! there is a client. What all clients share is encoded once. A client that does not take its bytes gets the newest
//! picture when it does, and is dropped after 5 s.
//!
//! # What is shown
//!
//! | sender | what | |
//! | --- | --- | --- |
//! | `Hand0`, `Hand1`, … | tracker | sensor 0 the wrist, 1 to 20 the joints as shown, in the order of `JOINT_NAMES` |
//! | `Glove0`, … | analog | the 21 joint angles as tracked, degrees, in the order of `HandSample.angles` |
//! | `Grasp0`, … | buttons | 0 holds something, 1 to 5 thumb to little finger touch something, 6 followed now |
//! | `Objects` | tracker | sensor = slot of the object's id |
//! | `World` | analog | epoch, tick, world time in seconds |
//!
//! A hand takes the lowest number that is free when it comes and keeps it until it goes. Its own name is a sender too,
//! with tracker, analog and buttons in one; each object's name is a tracker of one sensor. What VRPN cannot have in a
//! name becomes `_`: `alice:right` is `alice_right`. Messages under such a name go only to clients that opened it.
//!
//! Poses are in metres in the world's own axes, x right, y up, -z forward, or turned so that z is up. A joint's -z
//! points along the link toward the tip. A hand that is lost sends no poses. Times are those of the step, as frames carry.

/// One client's connection.
pub mod client;
/// Listening, connecting back, and the list of clients.
pub mod listen;

/// Complaints in the log.
mod complaints;
/// Ids and names of senders.
mod names;
/// What a client says.
mod peer;
/// The world as VRPN shows it.
mod picture;
/// What one client has been told.
mod telling;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use thiserror::Error;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::MissedTickBehavior;
use tracing::{info, warn};

use crate::broadcast::inbox::Inbox;
use crate::metrics::Metrics;
use crate::settings::vrpn::VrpnSettings;
use listen::{Clients, Sockets};
use picture::{Painter, Picture};

/// How long connections have to end after a stop.
const GRACE: Duration = Duration::from_secs(1);

/// The newest picture; `None` while nobody watches.
type Pictures = watch::Receiver<Option<Arc<Picture>>>;

/// Why there is no VRPN server.
#[derive(Debug, Error)]
pub enum VrpnFault {
    /// Another program listens there.
    #[error(
        "{0} is in use for VRPN: is another VRPN server running? Stop it, or choose another address with --vrpn"
    )]
    InUse(SocketAddr),
    /// The address cannot be listened on.
    #[error("cannot listen on {address} for VRPN: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
}

/// A running server.
#[derive(Debug)]
pub struct VrpnServer {
    address: SocketAddr,
    clients: JoinHandle<()>,
    feeder: JoinHandle<()>,
}

impl VrpnServer {
    /// Serves on these sockets until `stopping` says so.
    pub fn start(
        sockets: Sockets,
        settings: &VrpnSettings,
        inbox: Arc<Inbox>,
        metrics: Arc<Metrics>,
        stopping: watch::Receiver<bool>,
    ) -> Self {
        let address = sockets.address();
        let (pictures_in, pictures) = watch::channel(None);
        let (n_clients_in, n_clients) = watch::channel(0);
        let clients = Clients::new(sockets, pictures, n_clients_in, metrics);
        let feeder = Feeder {
            inbox,
            painter: Painter::new(settings.axes),
            period: Duration::from_secs_f64(1.0 / settings.rate_hz),
            pictures: pictures_in,
            n_clients,
        };
        info!(%address, rate_hz = settings.rate_hz, "VRPN server listens");
        Self {
            address,
            clients: tokio::spawn(clients.serve(stopping.clone())),
            feeder: tokio::spawn(feeder.run(stopping)),
        }
    }

    /// Where it listens, TCP and UDP.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Waits for its tasks after a stop was said; what does not end in time is cut.
    pub async fn join(self) {
        let Self {
            mut clients,
            mut feeder,
            ..
        } = self;
        for task in [&mut feeder, &mut clients] {
            if tokio::time::timeout(GRACE, &mut *task).await.is_err() {
                warn!("a part of the VRPN server did not end in time and is cut");
                task.abort();
            }
        }
    }
}

/// Waits until the daemon stops, or is gone.
async fn stopped(stopping: &mut watch::Receiver<bool>) {
    let _ = stopping.wait_for(|stops| *stops).await;
}

/// Asks for the scene at the pose rate, while there is a client.
struct Feeder {
    inbox: Arc<Inbox>,
    painter: Painter,
    period: Duration,
    pictures: watch::Sender<Option<Arc<Picture>>>,
    n_clients: watch::Receiver<usize>,
}

impl Feeder {
    async fn run(mut self, mut stopping: watch::Receiver<bool>) {
        tokio::select! {
            () = stopped(&mut stopping) => {}
            () = self.feed() => {}
        }
    }

    /// Until the list of clients is gone.
    async fn feed(&mut self) {
        let mut interval = tokio::time::interval(self.period);
        interval.set_missed_tick_behavior(MissedTickBehavior::Skip);
        loop {
            if *self.n_clients.borrow() == 0 {
                // Whoever comes next must not be shown what is old by then.
                self.pictures.send_replace(None);
                self.painter.pause();
                if self.n_clients.wait_for(|n| *n > 0).await.is_err() {
                    return;
                }
                interval.reset_immediately();
            }
            interval.tick().await;
            // There is none before the first epoch, and while too many ask at once.
            let Some(now) = self.inbox.scene().await else {
                continue;
            };
            if let Some(picture) = self.painter.paint(&now) {
                self.pictures.send_replace(Some(Arc::new(picture)));
            }
        }
    }
}
