//! Where a device is: a serial port's path, or an address of the network. One text for it everywhere.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::str::FromStr;

use thiserror::Error;

use crate::vrpn::address::{Address, AddressFault};

/// Where a device is. It is parsed from the text that it prints as:
///
/// | text | meaning |
/// | --- | --- |
/// | `/dev/serial/by-id/…` | a serial port |
/// | `udp:39539`, `udp:0.0.0.0:39539` | datagrams that arrive there; without an address only from this machine |
/// | `tcp:glove.local:4001` | a connection to there, as to a serial-to-Ethernet server |
/// | `tcp-listen:65432`, `tcp-listen:0.0.0.0:65432` | a connection that the device makes to here |
/// | `Tracker0@tcp://lab:3883`, `Tracker0@lab` | a device of a VRPN server, as VRPN names it |
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Place {
    /// Path of a serial port, or of a link to it.
    Serial(String),
    /// Datagrams sent to this address.
    Udp(SocketAddr),
    /// A connection to this host and port; an IPv6 address stands in brackets.
    Tcp {
        /// Name or address.
        host: String,
        /// Port.
        port: u16,
    },
    /// A connection that the device makes to this address.
    TcpListen(SocketAddr),
    /// A device of a VRPN server.
    Vrpn(Address),
}

/// Why a text names no place.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum NoPlace {
    /// There is no text.
    #[error(
        "is empty; it must be a path in /dev/serial/by-id, or udp:, tcp: or tcp-listen: with a port"
    )]
    Empty,
    /// What follows the scheme is no address.
    #[error("is {text:?}; after `{scheme}:` must come {wanted}, the port from 1 to 65535")]
    Address {
        /// The text as it was given.
        text: String,
        /// Its scheme.
        scheme: &'static str,
        /// What has to follow.
        wanted: &'static str,
    },
    /// The scheme is not known.
    #[error(
        "is {text:?}; `{scheme}:` is none of udp:, tcp: and tcp-listen:, and a path would begin with /"
    )]
    Scheme {
        /// The text as it was given.
        text: String,
        /// What stands before the colon.
        scheme: String,
    },
    /// It has an `@` as VRPN's names have, and is none.
    #[error(transparent)]
    Vrpn(#[from] AddressFault),
}

impl Place {
    /// The path of a serial port; `None` on the network.
    #[must_use]
    pub fn serial_path(&self) -> Option<&str> {
        match self {
            Self::Serial(path) => Some(path),
            Self::Udp(_) | Self::Tcp { .. } | Self::TcpListen(_) | Self::Vrpn(_) => None,
        }
    }

    /// Whether what arrives keeps the bounds of what was sent.
    #[must_use]
    pub const fn is_datagram(&self) -> bool {
        matches!(self, Self::Udp(_))
    }
}

impl FromStr for Place {
    type Err = NoPlace;

    fn from_str(text: &str) -> Result<Self, NoPlace> {
        const LISTEN: &str = "PORT or ADDRESS:PORT";
        let fault = |scheme, wanted| NoPlace::Address {
            text: text.to_owned(),
            scheme,
            wanted,
        };
        if text.is_empty() {
            return Err(NoPlace::Empty);
        }
        if text.contains('@') && !text.starts_with('/') {
            return Ok(Self::Vrpn(text.parse()?));
        }
        match text.split_once(':') {
            Some(("udp", rest)) => own_address(rest)
                .map(Self::Udp)
                .ok_or_else(|| fault("udp", LISTEN)),
            Some(("tcp-listen", rest)) => own_address(rest)
                .map(Self::TcpListen)
                .ok_or_else(|| fault("tcp-listen", LISTEN)),
            Some(("tcp", rest)) => {
                host_and_port(rest).ok_or_else(|| fault("tcp", "HOST:PORT, an IPv6 address in []"))
            }
            Some((scheme, _)) if is_scheme(scheme) => Err(NoPlace::Scheme {
                text: text.to_owned(),
                scheme: scheme.to_owned(),
            }),
            _ => Ok(Self::Serial(text.to_owned())),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(path) => out.write_str(path),
            Self::Udp(address) => write!(out, "udp:{address}"),
            Self::Tcp { host, port } => write!(out, "tcp:{host}:{port}"),
            Self::TcpListen(address) => write!(out, "tcp-listen:{address}"),
            Self::Vrpn(address) => write!(out, "{address}"),
        }
    }
}

/// Paths have slashes, and links made by udev have colons behind them.
fn is_scheme(text: &str) -> bool {
    !text.is_empty()
        && text
            .chars()
            .all(|letter| letter.is_ascii_alphanumeric() || letter == '-')
}

/// `PORT`, which is this machine's own alone, or `ADDRESS:PORT`.
fn own_address(text: &str) -> Option<SocketAddr> {
    let loopback = IpAddr::V4(Ipv4Addr::LOCALHOST);
    let address = text.parse::<u16>().map_or_else(
        |_| text.parse::<SocketAddr>().ok(),
        |port| Some(SocketAddr::new(loopback, port)),
    );
    address.filter(|address| address.port() != 0)
}

fn host_and_port(text: &str) -> Option<Place> {
    let (host, port) = text.rsplit_once(':')?;
    let port = port.parse().ok().filter(|port| *port != 0)?;
    let bracketed = host.starts_with('[') && host.ends_with(']');
    let bare = !host.is_empty() && !host.contains([':', '/', ' ']);
    (bracketed || bare).then(|| Place::Tcp {
        host: host.to_owned(),
        port,
    })
}

#[cfg(test)]
mod tests {
    use super::{NoPlace, Place};

    #[test]
    fn each_text_is_a_place_and_prints_as_one() {
        let cases = [
            ("/dev/ttyUSB0", "/dev/ttyUSB0"),
            (
                "/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0",
                "/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0",
            ),
            ("glove", "glove"),
            ("udp:39539", "udp:127.0.0.1:39539"),
            ("udp:0.0.0.0:14043", "udp:0.0.0.0:14043"),
            ("udp:[::1]:9400", "udp:[::1]:9400"),
            ("tcp:glove.local:4001", "tcp:glove.local:4001"),
            ("tcp:[fe80::1]:4001", "tcp:[fe80::1]:4001"),
            ("tcp-listen:65432", "tcp-listen:127.0.0.1:65432"),
            ("tcp-listen:0.0.0.0:65432", "tcp-listen:0.0.0.0:65432"),
            ("Tracker0@lab", "Tracker0@lab:3883"),
            ("Tracker0@tcp://lab", "Tracker0@tcp://lab:3883"),
            ("/dev/odd@name", "/dev/odd@name"),
        ];
        for (text, printed) in cases {
            let place: Place = text.parse().unwrap();
            assert_eq!(place.to_string(), printed);
            assert_eq!(printed.parse(), Ok(place));
        }
    }

    #[test]
    fn a_text_that_is_no_place_says_why() {
        for text in [
            "udp:",
            "udp:0",
            "udp:70000",
            "udp:host:1",
            "tcp:4001",
            "tcp::1",
            "tcp:a:b",
            "tcp:::1:80",
            "tcp-listen:x",
            "tcp-listen:1.2.3.4",
        ] {
            let fault = text.parse::<Place>();
            assert!(
                matches!(fault, Err(NoPlace::Address { .. })),
                "{text}: {fault:?}"
            );
        }
        let fault = "upd:39539".parse::<Place>();
        assert!(matches!(fault, Err(NoPlace::Scheme { .. })), "{fault:?}");
        assert_eq!("".parse::<Place>(), Err(NoPlace::Empty));
    }
}
