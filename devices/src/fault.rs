//! What can be wrong with a device, each with a message that says what to do.

use std::io::ErrorKind;

use thiserror::Error;

use crate::place::Place;

/// The named last error of a device.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Fault {
    /// The path does not exist (ENOENT), or leads to a device that is gone (ENODEV, ENXIO).
    #[error(
        "{path}: no such device; plug it in, or correct the path (`ls -l /dev/serial/by-id` shows what is there)"
    )]
    Missing {
        /// Path as it was given.
        path: String,
    },
    /// The path may not be opened by this user (EACCES).
    #[error(
        "{path}: permission denied; add this user to the group that owns the device (often `dialout`) or install \
         the device rule, then log in again"
    )]
    PermissionDenied {
        /// Path as it was given.
        path: String,
    },
    /// Another program holds the port (EBUSY, or its lock).
    #[error("{path}: in use by another program; close it (`fuser {path}` names it)")]
    Busy {
        /// Path as it was given.
        path: String,
    },
    /// The path is a file, a directory or a device that is no terminal.
    #[error("{path}: not a serial port")]
    NotSerial {
        /// Path as it was given.
        path: String,
    },
    /// The port refused for another reason.
    #[error("{path}: {detail}")]
    Port {
        /// Path as it was given.
        path: String,
        /// The operating system's own words.
        detail: String,
    },
    /// The port went away while it was open.
    #[error("{path}: unplugged; waiting for it to come back")]
    Unplugged {
        /// Path as it was given.
        path: String,
    },
    /// The port is open and nothing answers.
    #[error("{device}: silent; check its power, its cable and the baud rate")]
    Silent {
        /// Device family, such as `CyberGlove`.
        device: &'static str,
    },
    /// Something answers, and not as this device does.
    #[error(
        "{device}: what answers is not a {device}, or the baud rate is wrong; first bytes: {first_bytes}"
    )]
    NotThisDevice {
        /// Device family, such as `CyberGlove`.
        device: &'static str,
        /// The first bytes that came, in hexadecimal.
        first_bytes: String,
    },
    /// The device streams, and its records do not decode.
    #[error(
        "{device}: records do not decode; asking it to start again; first bytes: {first_bytes}"
    )]
    Garbled {
        /// Device family, such as `CyberGlove`.
        device: &'static str,
        /// The first bytes of a bad record, in hexadecimal.
        first_bytes: String,
    },
    /// The box answers and says that no glove is plugged into it.
    #[error("no glove is plugged into the interface box")]
    GloveUnplugged,
    /// The device did not take a setting that the session needs.
    #[error("{device}: did not take the setting `{setting}`")]
    Refused {
        /// Device family, such as `Fastrak`.
        device: &'static str,
        /// The setting in the device's own words.
        setting: String,
    },
    /// The device reported an error of its own.
    #[error("{device}: reports error `{code}`: {meaning}")]
    Reported {
        /// Device family, such as `Fastrak`.
        device: &'static str,
        /// The device's own code.
        code: String,
        /// What the manual says about it.
        meaning: &'static str,
    },
    /// Another program has the address of the network.
    #[error(
        "{place}: in use by another program; end it (`ss -lunpt` names it), or give another port here and to the sender"
    )]
    AddressInUse {
        /// Place as it is printed everywhere.
        place: String,
    },
    /// The address of the network cannot be had for another reason.
    #[error(
        "{place}: cannot be opened: {detail}; is the address one of this machine's, and the port above 1023?"
    )]
    CannotBind {
        /// Place as it is printed everywhere.
        place: String,
        /// The operating system's own words.
        detail: String,
    },
    /// The host does not answer.
    #[error("{place}: cannot be reached: {detail}; trying again")]
    Unreachable {
        /// Place as it is printed everywhere.
        place: String,
        /// The operating system's own words.
        detail: String,
    },
    /// No device has connected yet.
    #[error("{place}: no device has connected; tell it this machine's address and port")]
    NobodyConnected {
        /// Place as it is printed everywhere.
        place: String,
    },
    /// The other side closed the connection, or it broke.
    #[error("{place}: disconnected; waiting for it to come back")]
    Disconnected {
        /// Place as it is printed everywhere.
        place: String,
    },
    /// Two programs send to one port.
    #[error("{place}: {other} sends here too and is not heard while {heard} does; end one of them")]
    SecondSender {
        /// Place as it is printed everywhere.
        place: String,
        /// The sender that is heard, the newest.
        heard: String,
        /// The sender that is not.
        other: String,
    },
    /// Nothing arrives from a program on the network.
    #[error(
        "{device}: nothing arrives; start its sender, and check the address and port there and the firewall here"
    )]
    NothingArrives {
        /// What would send, such as `VMC`.
        device: &'static str,
    },
    /// Datagrams arrive and do not decode.
    #[error("{device}: what arrives does not decode ({detail}); first bytes: {first_bytes}")]
    Undecodable {
        /// What should send, such as `VMC`.
        device: &'static str,
        /// What is wrong with the first bad one.
        detail: String,
        /// Its first bytes, in hexadecimal.
        first_bytes: String,
    },
    /// Datagrams arrive and decode, and have no hand.
    #[error("{device}: what arrives has no hand in it; turn on its fingers at the sender")]
    NoHand {
        /// What sends, such as `VMC`.
        device: &'static str,
    },
}

impl Fault {
    /// Why an address of the network could not be had.
    pub(crate) fn from_bind(place: &Place, error: &std::io::Error) -> Self {
        let place = place.to_string();
        match error.kind() {
            ErrorKind::AddrInUse => Self::AddressInUse { place },
            _ => Self::CannotBind {
                place,
                detail: error.to_string(),
            },
        }
    }
}

/// The first few of `bytes` in hexadecimal, for a message.
pub(crate) fn hex(bytes: &[u8]) -> String {
    const SHOWN: usize = 24;
    let mut text: String = bytes
        .iter()
        .take(SHOWN)
        .map(|byte| format!("{byte:02X} "))
        .collect();
    if bytes.len() > SHOWN {
        text.push('…');
    }
    text.trim_end().to_owned()
}
