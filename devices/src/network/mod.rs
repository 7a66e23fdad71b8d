//! Devices at the other end of a network, served as [`crate::port`] serves a serial port, and one way to start either.

mod serve;
mod senders;
mod tcp;
mod udp;

use std::io;

use crate::clock::Clock;
use crate::place::Place;
use crate::port::{PortEvent, PortSettings};
use crate::port_thread::PortThread;
use crate::session::Session;
use crate::vrpn;

/// Where a device is and how it is served.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinkSettings {
    /// Where it is.
    pub place: Place,
    /// Line rates of a serial port in bit/s, tried in turn; nothing to a network.
    pub bauds: Vec<u32>,
    /// Whether [`PortEvent::Raw`] is delivered too; each datagram is one.
    pub raw: bool,
}

/// Starts a thread that serves the session wherever its device is, and opens the place again whenever it is lost.
/// `deliver` is called on that thread, as [`crate::port::run_port`] says.
///
/// # Errors
/// When the system refuses a thread.
pub fn spawn<F>(
    settings: LinkSettings,
    session: Box<dyn Session + Send>,
    clock: Clock,
    deliver: F,
) -> io::Result<PortThread>
where
    F: FnMut(PortEvent<'_>) + Send + 'static,
{
    let LinkSettings { place, bauds, raw } = settings;
    match place {
        Place::Serial(path) => {
            PortThread::spawn(PortSettings { path, bauds, raw }, session, clock, deliver)
        }
        Place::Vrpn(address) => vrpn::thread::spawn(address, session, clock, raw, deliver),
        Place::Udp(_) | Place::Tcp { .. } | Place::TcpListen(_) => {
            PortThread::start("network device", move |outside, stop| {
                let (mut session, mut deliver) = (session, deliver);
                serve::Service {
                    place: &place,
                    raw,
                    session: session.as_mut(),
                    outside,
                    stop,
                    clock,
                    deliver: &mut deliver,
                }
                .run();
            })
        }
    }
}
