//! What the service manager is told: systemd's notify protocol (`man sd_notify`), datagrams of `NAME=value` lines.
//!
//! Without `NOTIFY_SOCKET` nothing is told. `WATCHDOG=1` is sent only when the tick thread has shown since the last one that it
//! lives ([`Heartbeat`](crate::ticker::pulse::Heartbeat)); a timer alone would vouch for a world that stands still.

use std::ffi::OsString;
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use thiserror::Error;
use tokio::net::UnixDatagram;
use tokio::time::{Instant, sleep_until, timeout};
use tracing::{error, warn};
use tsukamu_proto::v1;

use crate::daemon::Daemon;
use crate::ticker::request::Request;

/// How often the status text is looked at where no watchdog asks for more.
const STATUS_PERIOD: Duration = Duration::from_secs(5);
/// How long one message may wait for a manager that does not read.
const PATIENCE: Duration = Duration::from_secs(1);
/// A missing sign of life is looked for again after this share of the time between two `WATCHDOG=1`.
const LOOK_AGAIN: u32 = 4;
/// Devices whose state is told by name; of the others their number.
const DEVICES_NAMED: usize = 3;

/// Why nobody can be told.
#[derive(Debug, Error)]
pub enum NotifyFault {
    /// The variable holds no address that is known here.
    #[error("NOTIFY_SOCKET is {0:?}; it must be a path from / on, or @ and an abstract name")]
    Address(OsString),
    /// The address is refused.
    #[error("NOTIFY_SOCKET: {0}")]
    Socket(#[from] io::Error),
}

/// The way to the service manager.
#[derive(Debug, Default)]
pub struct ServiceManager {
    /// `None` where nobody wants to know.
    address: Option<SocketAddr>,
    /// After how long without `WATCHDOG=1` it ends this process; `None` where it does not watch.
    watchdog: Option<Duration>,
    /// Whether the last message did not reach it: that is logged once.
    is_deaf: AtomicBool,
}

impl ServiceManager {
    /// The one that the environment of process `pid` names, if any: `NOTIFY_SOCKET`, `WATCHDOG_USEC`, `WATCHDOG_PID`.
    ///
    /// # Errors
    /// When `NOTIFY_SOCKET` holds no address.
    pub fn from_variables(
        variable: impl Fn(&str) -> Option<OsString>,
        pid: u32,
    ) -> Result<Self, NotifyFault> {
        let socket = variable("NOTIFY_SOCKET").filter(|name| !name.is_empty());
        let address = socket.map(address).transpose()?;
        let number = |name| variable(name)?.to_str()?.parse::<u64>().ok();
        // The variables of a parent are not meant for its children.
        let is_meant = number("WATCHDOG_PID").is_none_or(|meant| meant == u64::from(pid));
        let watchdog = number("WATCHDOG_USEC").filter(|usec| *usec > 0 && is_meant);
        Ok(Self {
            watchdog: watchdog.map(Duration::from_micros),
            address,
            is_deaf: AtomicBool::new(false),
        })
    }

    /// The port listens and the devices' threads run.
    pub async fn ready(&self, daemon: &Daemon, devices: &[String]) {
        let status = status(daemon, devices);
        self.tell(&format!("READY=1\nSTATUS={status}")).await;
    }

    /// From now on it drains.
    pub async fn stopping(&self) {
        self.tell("STOPPING=1\nSTATUS=stopping: streams end, the recording is finished")
            .await;
    }

    /// Tells how the daemon does for as long as this is polled; it never ends. `devices` are the names of its gloves and
    /// trackers.
    pub async fn keep_informed(&self, daemon: &Daemon, devices: &[String]) {
        if self.address.is_none() {
            return std::future::pending().await;
        }
        let mut heart = daemon.heartbeat();
        let period = self.watchdog.map_or(STATUS_PERIOD, |limit| limit / 2);
        let (mut told, mut is_alive) = (String::new(), true);
        loop {
            // One that waits for requests has something to answer until then. A full queue is enough to answer.
            let _ = daemon.backend().ticker.send(Request::Pulse);
            let wait = if is_alive {
                period
            } else {
                period / LOOK_AGAIN
            };
            sleep_until(Instant::now() + wait).await;
            let was_alive = std::mem::replace(&mut is_alive, heart.has_beaten());
            if !is_alive {
                if was_alive {
                    error!(waited_s = wait.as_secs_f64(), "the world stands still");
                    self.tell("STATUS=the world stands still").await;
                    told.clear();
                }
                continue;
            }
            if self.watchdog.is_some() {
                self.tell("WATCHDOG=1").await;
            }
            let status = status(daemon, devices);
            if status != told {
                self.tell(&format!("STATUS={status}")).await;
                told = status;
            }
        }
    }

    /// Sends one message. A manager that cannot be told is no reason to stop.
    async fn tell(&self, message: &str) {
        let Some(address) = &self.address else { return };
        let late = io::Error::from(io::ErrorKind::TimedOut);
        let sent = timeout(PATIENCE, send(address, message)).await;
        let sent = sent.unwrap_or(Err(late));
        let was_deaf = self.is_deaf.swap(sent.is_err(), Ordering::Relaxed);
        if let Err(fault) = sent
            && !was_deaf
        {
            warn!(%fault, "the service manager cannot be told");
        }
    }
}

/// A socket for each message, as they are few: a manager that has come back is found again.
async fn send(address: &SocketAddr, message: &str) -> io::Result<()> {
    let socket = std::os::unix::net::UnixDatagram::unbound()?;
    socket.connect_addr(address)?;
    socket.set_nonblocking(true)?;
    UnixDatagram::from_std(socket)?
        .send(message.as_bytes())
        .await?;
    Ok(())
}

fn address(name: OsString) -> Result<SocketAddr, NotifyFault> {
    match name.as_bytes() {
        [b'/', ..] => Ok(SocketAddr::from_pathname(&name)?),
        #[cfg(target_os = "linux")]
        [b'@', rest @ ..] => {
            use std::os::linux::net::SocketAddrExt;
            Ok(SocketAddr::from_abstract_name(rest)?)
        }
        _ => Err(NotifyFault::Address(name)),
    }
}

/// One line for `systemctl status`.
fn status(daemon: &Daemon, devices: &[String]) -> String {
    let backend = daemon.backend();
    let now = backend.status.now();
    let pace = match (now.mode, now.is_paused) {
        ("lockstep", _) => "in lockstep".to_owned(),
        (_, true) => "paused".to_owned(),
        _ => format!("{} steps/s", now.rate_hz),
    };
    let hands = match now.n_hands {
        1 => "1 hand".to_owned(),
        n => format!("{n} hands"),
    };
    let mut text = format!("{}: {pace}, {hands}", now.scene);
    let sources = backend.sources.devices(backend.clock.monotonic_ns());
    let mine = |source: &&v1::Device| devices.contains(&source.name);
    text.push_str(&device_states(sources.iter().filter(mine)));
    if !now.recording.is_empty() {
        text.push_str(&format!("; recording {}", now.recording));
    }
    // One line is one value.
    text.replace(char::is_control, " ")
}

/// How many devices run, and the first of those that do not.
fn device_states<'a>(devices: impl Iterator<Item = &'a v1::Device>) -> String {
    let (running, others): (Vec<_>, Vec<_>) = devices.partition(|device| device.state == "running");
    let n_all = running.len() + others.len();
    if n_all == 0 {
        return String::new();
    }
    let mut text = format!("; {} of {n_all} devices run", running.len());
    let named: Vec<String> = others
        .iter()
        .take(DEVICES_NAMED)
        .map(|device| format!("{} is {}", device.name, device.state))
        .collect();
    if !named.is_empty() {
        text.push_str(&format!(" ({}", named.join(", ")));
        if others.len() > DEVICES_NAMED {
            text.push_str(&format!(" and {} more", others.len() - DEVICES_NAMED));
        }
        text.push(')');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manager(variables: &[(&str, &str)]) -> Result<ServiceManager, NotifyFault> {
        let look_up = |name: &str| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| OsString::from(value))
        };
        ServiceManager::from_variables(look_up, 7)
    }

    #[test]
    fn variables_say_whom_to_tell_and_how_often() {
        let none = manager(&[]).unwrap();
        assert!(none.address.is_none() && none.watchdog.is_none());
        let path = manager(&[("NOTIFY_SOCKET", "/run/n"), ("WATCHDOG_USEC", "30000000")]).unwrap();
        let address = path.address.expect("a path");
        assert_eq!(address.as_pathname(), Some("/run/n".as_ref()));
        assert_eq!(path.watchdog, Some(Duration::from_secs(30)));
        for (pid, expected) in [("7", Some(Duration::from_secs(2))), ("8", None)] {
            let variables = [("WATCHDOG_USEC", "2000000"), ("WATCHDOG_PID", pid)];
            assert_eq!(manager(&variables).unwrap().watchdog, expected, "{pid}");
        }
        for spoilt in ["0", "-1", "soon", ""] {
            assert_eq!(
                manager(&[("WATCHDOG_USEC", spoilt)]).unwrap().watchdog,
                None
            );
        }
        for unknown in ["run/n", "vsock:2:1234"] {
            let fault = manager(&[("NOTIFY_SOCKET", unknown)]).unwrap_err();
            assert!(fault.to_string().contains(unknown), "{fault}");
        }
        assert!(manager(&[("NOTIFY_SOCKET", "")]).unwrap().address.is_none());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn an_abstract_name_is_an_address() {
        use std::os::linux::net::SocketAddrExt;
        let address = manager(&[("NOTIFY_SOCKET", "@tsukamu/1")]).unwrap().address;
        let address = address.expect("an abstract name");
        assert_eq!(address.as_abstract_name(), Some(b"tsukamu/1".as_slice()));
    }

    #[test]
    fn devices_that_do_not_run_are_named() {
        let device = |name: &str, state: &str| v1::Device {
            name: name.to_owned(),
            state: state.to_owned(),
            ..v1::Device::default()
        };
        let text = |devices: &[v1::Device]| device_states(devices.iter());
        assert_eq!(text(&[]), "");
        let glove = device("glove", "running");
        assert_eq!(text(std::slice::from_ref(&glove)), "; 1 of 1 devices run");
        let tracker = device("tracker", "absent");
        assert_eq!(
            text(&[glove, tracker]),
            "; 1 of 2 devices run (tracker is absent)"
        );
        let lost = ["a", "b", "c", "d", "e"].map(|name| device(name, "stalled"));
        assert_eq!(
            text(&lost),
            "; 0 of 5 devices run (a is stalled, b is stalled, c is stalled and 2 more)"
        );
    }
}
