use std::error::Error;
use std::io;

use thiserror::Error;
use tonic::{Code, Status};

use crate::connect::ConnectOptions;

/// Why there is no connection.
#[derive(Clone, Debug, Error)]
pub enum ConnectError {
    /// The address is none.
    #[error("`{address}` is no address of a daemon ({reason}); write it as http://host:port")]
    Address {
        /// What was given.
        address: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Nobody answers.
    #[error(
        "no daemon can be reached at {address} ({reason}); start one with `tsukamud`, or name its address with \
         --address or TSUKAMU_ADDRESS"
    )]
    Unreachable {
        /// Where.
        address: String,
        /// What the system says.
        reason: String,
    },
    /// Somebody answers, but it is no Tsukamu daemon.
    #[error(
        "what answers at {address} is no Tsukamu daemon ({reason}); name the daemon's address with --address or TSUKAMU_ADDRESS"
    )]
    WrongService {
        /// Where.
        address: String,
        /// How that shows.
        reason: String,
    },
    /// Somebody took the connection and closed it again.
    #[error(
        "what answers at {address} closed the connection ({reason}): it is no Tsukamu daemon, or one that is stopping"
    )]
    HungUp {
        /// Where.
        address: String,
        /// What the system says.
        reason: String,
    },
    /// The daemon speaks another protocol.
    #[error(
        "the daemon at {address} (version {daemon}) speaks protocol {daemon_major}, this client {client_major}; \
         update the older of the two"
    )]
    Version {
        /// Where.
        address: String,
        /// The daemon's own version.
        daemon: String,
        /// Major number of its protocol.
        daemon_major: u32,
        /// Major number of ours.
        client_major: u32,
    },
    /// The daemon refuses.
    #[error("the daemon at {address} refuses: {status}")]
    Refused {
        /// Where.
        address: String,
        /// Its answer.
        status: String,
    },
}

impl ConnectError {
    /// Whether trying again may help.
    pub fn is_passing(&self) -> bool {
        matches!(self, Self::Unreachable { .. } | Self::HungUp { .. })
    }
}

/// What the status of the first call tells about who answers.
pub(crate) fn error_of(options: &ConnectOptions, status: &Status) -> ConnectError {
    match status.code() {
        Code::Unimplemented => wrong_service(options, "it does not know our service".into()),
        _ if status.source().is_some() => transport_error(options, status),
        Code::Unavailable | Code::Cancelled => unreachable(options, status.message().into()),
        Code::Unknown | Code::Internal => wrong_service(
            options,
            format!("its answer is no gRPC: {}", first_line(status.message())),
        ),
        code => ConnectError::Refused {
            address: options.address.clone(),
            status: format!("{}: {}", code.description(), first_line(status.message())),
        },
    }
}

/// What a failure below gRPC tells: nobody is there, somebody who speaks something else, or somebody who went away.
fn transport_error(options: &ConnectOptions, status: &Status) -> ConnectError {
    let reason = status.source().map(root_cause).unwrap_or_default();
    let mut cause = status.source();
    while let Some(error) = cause {
        let text = error.to_string();
        if text.contains("http2 error")
            || text.contains("h2 protocol error")
            || text.contains("invalid size")
        {
            return wrong_service(options, format!("it does not speak gRPC: {reason}"));
        }
        if text.contains("connect error")
            || error.downcast_ref::<io::Error>().is_some_and(is_absence)
        {
            return unreachable(options, reason);
        }
        cause = error.source();
    }
    ConnectError::HungUp {
        address: options.address.clone(),
        reason,
    }
}

fn is_absence(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::ConnectionRefused
            | io::ErrorKind::HostUnreachable
            | io::ErrorKind::NetworkUnreachable
            | io::ErrorKind::AddrNotAvailable
            | io::ErrorKind::TimedOut
    )
}

pub(crate) fn unreachable(options: &ConnectOptions, reason: String) -> ConnectError {
    ConnectError::Unreachable {
        address: options.address.clone(),
        reason,
    }
}

pub(crate) fn wrong_service(options: &ConnectOptions, reason: String) -> ConnectError {
    ConnectError::WrongService {
        address: options.address.clone(),
        reason,
    }
}

pub(crate) fn silence(options: &ConnectOptions) -> String {
    format!(
        "it gave no answer within {:.1} s",
        options.timeout.as_secs_f64()
    )
}

/// The innermost error of a chain: what the system said, on one line.
pub(crate) fn root_cause(error: &(dyn Error + 'static)) -> String {
    let mut innermost = error;
    while let Some(source) = innermost.source() {
        innermost = source;
    }
    first_line(&innermost.to_string())
}

fn first_line(text: &str) -> String {
    text.lines()
        .next()
        .unwrap_or_default()
        .chars()
        .take(200)
        .collect()
}
