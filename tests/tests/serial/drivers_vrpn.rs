//! A VRPN server as a device: a daemon that shows a standing hand, behind a line that can be pulled, spoilt and stalled.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tsukamu_devices::emulate::line_fault::Noise;
use tsukamu_server::daemon::{Daemon, start};
use tsukamu_server::emulate::kinds::named;
use tsukamu_server::emulate::{Played, Plugged};
use tsukamu_server::settings::vrpn::VrpnSettings;

use crate::drivers::worn;
use crate::drivers_kinds::{Promise, Wrist};
use crate::rig::{Folder, daemon_config};

/// Poses go as they are, in doubles, from a tracker that sends floats; 60 a second of each of a hand's 21 sensors.
pub(crate) const VRPN: Promise = Promise {
    kind: "vrpn",
    model: "",
    rate_hz: 60.0 * 21.0,
    fingers: None,
    wrist: Some(Wrist {
        metres: 2.0e-6,
        radians: 4.0e-6,
    }),
    // A server without power is a connection that is lost, and made anew.
    is_asked: false,
};
/// How often the line looks whether anything is to be carried or done.
const TURN: Duration = Duration::from_millis(5);

/// What is done to the line.
#[derive(Debug)]
struct Orders {
    stops: bool,
    is_unplugged: bool,
    /// Until when nothing is carried.
    stalled_until: Instant,
    /// Until when nobody answers.
    dead_until: Instant,
    noise: Noise,
}

/// A line to a VRPN server.
pub(crate) struct VrpnLine {
    place: PathBuf,
    orders: Arc<Mutex<Orders>>,
    thread: Option<JoinHandle<()>>,
    _server: Daemon,
    _worn: Vec<Box<dyn Plugged>>,
}

fn lock(orders: &Mutex<Orders>) -> MutexGuard<'_, Orders> {
    orders.lock().unwrap_or_else(PoisonError::into_inner)
}

impl VrpnLine {
    /// A server with a glove and a tracker that the hand of the others wears.
    pub(crate) async fn new(folder: &Folder, played: &Played) -> Self {
        let (mut text, mut worn_here) = (
            "listen = '127.0.0.1:0'\nscene = 'operations/free'\n".to_owned(),
            Vec::new(),
        );
        for (name, kind) in [("glove", "cyberglove"), ("tracker", "fastrak")] {
            let kind = named(kind).unwrap();
            let mut worn = worn(played, kind.models[0], 115_200);
            let link = folder.file(&format!("vrpn-{name}"));
            worn.plug.link = Some(link.clone());
            worn_here.push((kind.spawn)(worn).unwrap());
            let port = link.display();
            text += &format!(
                "[[device]]\nname = '{name}'\nkind = '{}'\nport = '{port}'\n",
                kind.name
            );
        }
        text += "[[hand]]\nname = 'there'\nside = 'right'\nglove = 'glove'\ntracker = 'tracker'\n";
        let mut config = daemon_config(&text);
        config.vrpn = Some(VrpnSettings::new(SocketAddr::from(([127, 0, 0, 1], 0))));
        let server = start(config).await.unwrap();
        let to = server.vrpn_addr().unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let place = format!("Hand0@tcp://{}", listener.local_addr().unwrap());
        let now = Instant::now();
        let orders = Arc::new(Mutex::new(Orders {
            stops: false,
            is_unplugged: false,
            stalled_until: now,
            dead_until: now,
            noise: Noise::new(0.0),
        }));
        let run = Run {
            listener,
            to,
            orders: Arc::clone(&orders),
            ends: None,
        };
        Self {
            place: PathBuf::from(place),
            orders,
            thread: Some(std::thread::spawn(move || run.run())),
            _server: server,
            _worn: worn_here,
        }
    }

    /// What settings say of its port.
    pub(crate) fn port(&self) -> String {
        self.place.display().to_string()
    }
}

impl Drop for VrpnLine {
    fn drop(&mut self) {
        lock(&self.orders).stops = true;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Plugged for VrpnLine {
    fn path(&self) -> &Path {
        &self.place
    }

    fn unplug(&mut self) {
        lock(&self.orders).is_unplugged = true;
    }

    fn plug(&mut self) -> std::io::Result<()> {
        lock(&self.orders).is_unplugged = false;
        Ok(())
    }

    fn spoil(&mut self, share: f64) {
        lock(&self.orders).noise = Noise::new(share);
    }

    fn stall(&mut self, time: Duration) {
        lock(&self.orders).stalled_until = Instant::now() + time;
    }

    fn cut_power(&mut self, time: Duration) {
        lock(&self.orders).dead_until = Instant::now() + time;
    }
}

struct Run {
    listener: TcpListener,
    to: SocketAddr,
    orders: Arc<Mutex<Orders>>,
    /// The client's end and the server's.
    ends: Option<[TcpStream; 2]>,
}

impl Run {
    fn run(mut self) {
        loop {
            {
                let orders = lock(&self.orders);
                if orders.stops {
                    return;
                }
                if orders.is_unplugged || Instant::now() < orders.dead_until {
                    self.ends = None;
                }
            }
            self.accept();
            if self.carry().is_err() {
                for end in self.ends.take().iter().flatten() {
                    // It may be gone already.
                    let _ = end.shutdown(Shutdown::Both);
                }
            }
            std::thread::park_timeout(TURN);
        }
    }

    /// Who calls is put through, unless the cable is out or the server has no power.
    fn accept(&mut self) {
        let Ok((client, _)) = self.listener.accept() else {
            return;
        };
        let is_dead = {
            let orders = lock(&self.orders);
            orders.is_unplugged || Instant::now() < orders.dead_until
        };
        if is_dead {
            return;
        }
        let server = TcpStream::connect(self.to).unwrap();
        for end in [&client, &server] {
            end.set_nonblocking(true).unwrap();
        }
        self.ends = Some([client, server]);
    }

    /// Carries what is there, both ways; an error when either side has gone.
    fn carry(&mut self) -> std::io::Result<()> {
        let Some([client, server]) = &mut self.ends else {
            return Ok(());
        };
        let mut orders = lock(&self.orders);
        if Instant::now() < orders.stalled_until {
            return Ok(());
        }
        let mut bytes = [0; 65_536];
        let n_bytes = read(server, &mut bytes)?;
        let said = &mut bytes[..n_bytes];
        orders.noise.spoil(said);
        write(client, said)?;
        let n_bytes = read(client, &mut bytes)?;
        write(server, &bytes[..n_bytes])
    }
}

/// What is there to be read, which may be nothing.
fn read(end: &mut TcpStream, bytes: &mut [u8]) -> std::io::Result<usize> {
    match end.read(bytes) {
        Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
        Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(0),
        other => other,
    }
}

fn write(end: &mut TcpStream, bytes: &[u8]) -> std::io::Result<()> {
    end.set_nonblocking(false)?;
    end.write_all(bytes)?;
    end.set_nonblocking(true)
}
