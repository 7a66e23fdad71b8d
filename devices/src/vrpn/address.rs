//! Where a device is, in VRPN's own form: `Tracker0@tcp://host:3883`, `Tracker0@host`.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::DEFAULT_PORT;
use super::body::MAX_NAME;

/// How a connection comes about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Transport {
    /// `tcp://`: the client connects. Passes firewalls and address translation.
    Tcp,
    /// Without a scheme: the client asks by UDP, the server connects back by TCP and sends poses by UDP.
    UdpRequest,
}

/// A device and its server.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address {
    /// The device's name at the server, such as `Tracker0`.
    pub device: String,
    /// How to reach it.
    pub transport: Transport,
    /// The server's name or address.
    pub host: String,
    /// The server's port.
    pub port: u16,
}

/// Why a text is no address.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "is {text:?}, which is no VRPN device: {reason}; it must be like Tracker0@tcp://host:3883 or Tracker0@host"
)]
pub struct AddressFault {
    text: String,
    reason: &'static str,
}

impl FromStr for Address {
    type Err = AddressFault;

    fn from_str(text: &str) -> Result<Self, AddressFault> {
        let fault = |reason| AddressFault {
            text: text.to_owned(),
            reason,
        };
        let (device, place) = text
            .split_once('@')
            .ok_or_else(|| fault("there is no @ between device and server"))?;
        if device.is_empty() || device.len() > MAX_NAME {
            return Err(fault("the device has no name, or too long a one"));
        }
        let stripped = |scheme: &str| {
            place
                .strip_prefix(scheme)
                .map(|rest| rest.strip_prefix("//").unwrap_or(rest))
        };
        let (transport, place) = if let Some(rest) = stripped("tcp:") {
            (Transport::Tcp, rest)
        } else if let Some(rest) = stripped("x-vrpn:") {
            (Transport::UdpRequest, rest)
        } else if place.contains("://") {
            return Err(fault("only tcp:// is known"));
        } else {
            (Transport::UdpRequest, place)
        };
        let (host, port) = host_and_port(place).ok_or_else(|| fault("the port is no number"))?;
        if host.is_empty() || host.contains(|c: char| c.is_whitespace() || c == '/') {
            return Err(fault("the server has no name"));
        }
        Ok(Self {
            device: device.to_owned(),
            transport,
            host: host.to_owned(),
            port,
        })
    }
}

/// Splits `host:port`, `[::1]:port`, or a host alone.
fn host_and_port(place: &str) -> Option<(&str, u16)> {
    if let Some(rest) = place.strip_prefix('[') {
        let (host, after) = rest.split_once(']')?;
        return match after.strip_prefix(':') {
            Some(port) => Some((host, port_number(port)?)),
            None => after.is_empty().then_some((host, DEFAULT_PORT)),
        };
    }
    match place.split_once(':') {
        Some((host, port)) => Some((host, port_number(port)?)),
        None => Some((place, DEFAULT_PORT)),
    }
}

fn port_number(text: &str) -> Option<u16> {
    text.parse().ok().filter(|port| *port > 0)
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            device,
            transport,
            host,
            port,
        } = self;
        let scheme = match transport {
            Transport::Tcp => "tcp://",
            Transport::UdpRequest => "",
        };
        if host.contains(':') {
            write!(f, "{device}@{scheme}[{host}]:{port}")
        } else {
            write!(f, "{device}@{scheme}{host}:{port}")
        }
    }
}
