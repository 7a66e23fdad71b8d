//! What can be wrong with a device, each with a message that says what to do.

use thiserror::Error;

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
