use std::error::Error;
use std::io;
use std::time::Duration;

use thiserror::Error;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Status};
use tsukamu_proto::PROTOCOL_MAJOR;
use tsukamu_proto::v1::clock_client::ClockClient;
use tsukamu_proto::v1::control_client::ControlClient;
use tsukamu_proto::v1::devices_client::DevicesClient;
use tsukamu_proto::v1::hands_client::HandsClient;
use tsukamu_proto::v1::recordings_client::RecordingsClient;
use tsukamu_proto::v1::world_client::WorldClient;
use tsukamu_proto::v1::{GetStatusRequest, GetStatusResponse};

use crate::clock::ClientClock;

/// Where a daemon listens unless told otherwise.
pub const DEFAULT_ADDRESS: &str = "http://127.0.0.1:7447";
/// Largest message that is taken, bytes: a scene of many meshes.
const MAX_MESSAGE_BYTES: usize = 64 << 20;
/// What one stream may have under way, bytes. Small, so that a slow reader gets new frames, not a long queue of old
/// ones; a keyframe of 4000 objects still fits.
const STREAM_WINDOW_BYTES: u32 = 256 << 10;
/// What all streams of a connection may have under way, bytes.
const CONNECTION_WINDOW_BYTES: u32 = 1 << 20;
/// A silent connection is asked for a sign of life this often, and given up after as long again.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

/// Where to connect to, and how patiently.
#[derive(Clone, Debug)]
pub struct ConnectOptions {
    /// `http://host:port`; without a scheme, `http` is meant.
    pub address: String,
    /// Longest wait for one attempt, and for the answer of one status call.
    pub timeout: Duration,
    /// What to do when nobody answers.
    pub retry: RetryPolicy,
}

/// How often to try again, and how long to wait in between: each delay is twice the one before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RetryPolicy {
    /// Attempts before giving up, at least 1.
    pub attempts: u32,
    /// Before the second attempt.
    pub first_delay: Duration,
    /// The longest delay.
    pub max_delay: Duration,
}

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

/// A connection to a daemon whose protocol we speak. Cheap to clone; clones share the connection.
#[derive(Clone, Debug)]
pub struct Client {
    channel: Channel,
    options: ConnectOptions,
    clock: ClientClock,
}

impl Default for ConnectOptions {
    fn default() -> Self {
        Self {
            address: DEFAULT_ADDRESS.into(),
            timeout: Duration::from_secs(3),
            retry: RetryPolicy::default(),
        }
    }
}

impl Default for RetryPolicy {
    /// Ten attempts within about twelve seconds.
    fn default() -> Self {
        Self {
            attempts: 10,
            first_delay: Duration::from_millis(100),
            max_delay: Duration::from_secs(2),
        }
    }
}

impl RetryPolicy {
    /// One attempt.
    pub const ONCE: Self = Self {
        attempts: 1,
        first_delay: Duration::ZERO,
        max_delay: Duration::ZERO,
    };

    /// Attempts for about that long: the least number of them whose delays add up to it.
    pub fn lasting(duration: Duration) -> Self {
        let mut retry = Self {
            attempts: 1,
            ..Self::default()
        };
        let mut total = Duration::ZERO;
        while total < duration && retry.attempts < 1_000_000 {
            retry.attempts += 1;
            total += retry
                .delay_after(retry.attempts - 1)
                .unwrap_or(retry.max_delay);
        }
        retry
    }

    /// The wait after that many failed attempts, or `None` when it is time to give up.
    pub fn delay_after(&self, n_failed: u32) -> Option<Duration> {
        if n_failed >= self.attempts.max(1) {
            return None;
        }
        let doublings = n_failed.saturating_sub(1).min(31);
        Some(
            self.first_delay
                .saturating_mul(1 << doublings)
                .min(self.max_delay),
        )
    }
}

impl ConnectError {
    /// Whether trying again may help.
    pub fn is_passing(&self) -> bool {
        matches!(self, Self::Unreachable { .. } | Self::HungUp { .. })
    }
}

impl Client {
    /// Connects, asks for the daemon's status and compares protocols; tries again as the options say.
    ///
    /// # Errors
    /// When nobody answers until the last attempt, when it is no daemon, or one with another protocol.
    pub async fn connect(options: ConnectOptions) -> Result<Self, ConnectError> {
        let endpoint = endpoint(&options)?;
        let mut n_failed = 0;
        loop {
            let error = match Self::attempt(&endpoint, &options).await {
                Ok(client) => return Ok(client),
                Err(error) if error.is_passing() => error,
                Err(error) => return Err(error),
            };
            n_failed += 1;
            let Some(delay) = options.retry.delay_after(n_failed) else {
                return Err(error);
            };
            tokio::time::sleep(delay).await;
        }
    }

    async fn attempt(endpoint: &Endpoint, options: &ConnectOptions) -> Result<Self, ConnectError> {
        let connecting = tokio::time::timeout(options.timeout, endpoint.connect());
        let channel = match connecting.await {
            Ok(Ok(channel)) => channel,
            Ok(Err(error)) => return Err(unreachable(options, root_cause(&error))),
            Err(_) => return Err(unreachable(options, silence(options))),
        };
        let client = Self {
            channel,
            options: options.clone(),
            clock: ClientClock::start(),
        };
        client.status().await?;
        Ok(client)
    }

    /// The daemon's status, with its protocol checked.
    ///
    /// # Errors
    /// As [`Client::connect`], without trying again.
    pub async fn status(&self) -> Result<GetStatusResponse, ConnectError> {
        let mut world = self.world();
        let asking =
            tokio::time::timeout(self.options.timeout, world.get_status(GetStatusRequest {}));
        let status = match asking.await {
            Ok(Ok(answer)) => answer.into_inner(),
            Ok(Err(status)) => return Err(error_of(&self.options, &status)),
            Err(_) => return Err(wrong_service(&self.options, silence(&self.options))),
        };
        if status.protocol_major != PROTOCOL_MAJOR {
            return Err(ConnectError::Version {
                address: self.options.address.clone(),
                daemon: status.version,
                daemon_major: status.protocol_major,
                client_major: PROTOCOL_MAJOR,
            });
        }
        Ok(status)
    }

    /// The address it was connected to.
    pub fn address(&self) -> &str {
        &self.options.address
    }

    /// The clock that stamps what arrives over this connection.
    pub fn clock(&self) -> ClientClock {
        self.clock
    }

    /// How this connection, and every stream of it, tries again.
    pub fn retry(&self) -> RetryPolicy {
        self.options.retry
    }

    /// The same connection, whose streams try again in another way.
    #[must_use]
    pub fn with_retry(mut self, retry: RetryPolicy) -> Self {
        self.options.retry = retry;
        self
    }

    /// The world: scene, frames, events, status.
    pub fn world(&self) -> WorldClient<Channel> {
        WorldClient::new(self.channel.clone()).max_decoding_message_size(MAX_MESSAGE_BYTES)
    }

    /// Driving hands.
    pub fn hands(&self) -> HandsClient<Channel> {
        HandsClient::new(self.channel.clone())
    }

    /// Commands.
    pub fn control(&self) -> ControlClient<Channel> {
        ControlClient::new(self.channel.clone())
    }

    /// Gloves, trackers and other sources.
    pub fn devices(&self) -> DevicesClient<Channel> {
        DevicesClient::new(self.channel.clone())
    }

    /// Recordings.
    pub fn recordings(&self) -> RecordingsClient<Channel> {
        RecordingsClient::new(self.channel.clone())
    }

    /// The daemon's clock.
    pub fn daemon_clock(&self) -> ClockClient<Channel> {
        ClockClient::new(self.channel.clone())
    }
}

fn endpoint(options: &ConnectOptions) -> Result<Endpoint, ConnectError> {
    let given = options.address.trim();
    let bad = |reason: &str| ConnectError::Address {
        address: given.into(),
        reason: reason.into(),
    };
    if given.is_empty() {
        return Err(bad("it is empty"));
    }
    let address = if given.contains("://") {
        given.to_owned()
    } else {
        format!("http://{given}")
    };
    if address.starts_with("https://") {
        return Err(bad("this client speaks plain http only"));
    }
    let endpoint = Endpoint::from_shared(address).map_err(|error| bad(&root_cause(&error)))?;
    if endpoint.uri().scheme_str() != Some("http")
        || endpoint.uri().host().is_none_or(str::is_empty)
    {
        return Err(bad("it has no host, or a scheme other than http"));
    }
    Ok(endpoint
        .connect_timeout(options.timeout)
        .tcp_nodelay(true)
        .initial_stream_window_size(STREAM_WINDOW_BYTES)
        .initial_connection_window_size(CONNECTION_WINDOW_BYTES)
        .http2_keep_alive_interval(KEEP_ALIVE)
        .keep_alive_timeout(KEEP_ALIVE)
        .keep_alive_while_idle(true)
        .user_agent(concat!("tsukamu/", env!("CARGO_PKG_VERSION")))
        .expect("a version is a valid header"))
}

/// What the status of the first call tells about who answers.
fn error_of(options: &ConnectOptions, status: &Status) -> ConnectError {
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

fn unreachable(options: &ConnectOptions, reason: String) -> ConnectError {
    ConnectError::Unreachable {
        address: options.address.clone(),
        reason,
    }
}

fn wrong_service(options: &ConnectOptions, reason: String) -> ConnectError {
    ConnectError::WrongService {
        address: options.address.clone(),
        reason,
    }
}

fn silence(options: &ConnectOptions) -> String {
    format!(
        "it gave no answer within {:.1} s",
        options.timeout.as_secs_f64()
    )
}

/// The innermost error of a chain: what the system said, on one line.
fn root_cause(error: &(dyn Error + 'static)) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_double_up_to_a_bound() {
        let retry = RetryPolicy {
            attempts: 5,
            first_delay: Duration::from_millis(100),
            max_delay: Duration::from_millis(350),
        };
        let delays: Vec<_> = (1..=5)
            .map(|n| retry.delay_after(n).map(|delay| delay.as_millis()))
            .collect();
        assert_eq!(delays, [Some(100), Some(200), Some(350), Some(350), None]);
        assert_eq!(RetryPolicy::ONCE.delay_after(1), None);
        assert_eq!(RetryPolicy::lasting(Duration::ZERO).attempts, 1);
        // 0.1 + 0.2 + 0.4 + 0.8 + 1.6 = 3.1 s is the first sum past 3 s.
        assert_eq!(RetryPolicy::lasting(Duration::from_secs(3)).attempts, 6);
        assert_eq!(
            RetryPolicy {
                attempts: u32::MAX,
                ..retry
            }
            .delay_after(4_000_000),
            Some(retry.max_delay)
        );
    }

    #[test]
    fn addresses() {
        let check = |address: &str, expected: Result<&str, &str>| {
            let options = ConnectOptions {
                address: address.into(),
                ..ConnectOptions::default()
            };
            match (endpoint(&options), expected) {
                (Ok(endpoint), Ok(uri)) => assert_eq!(endpoint.uri().to_string(), uri),
                (Err(ConnectError::Address { reason, .. }), Err(part)) => {
                    assert!(reason.contains(part), "{address}: {reason}");
                }
                (found, expected) => panic!("{address}: {found:?}, not {expected:?}"),
            }
        };
        check("http://127.0.0.1:7447", Ok("http://127.0.0.1:7447/"));
        check("127.0.0.1:7447", Ok("http://127.0.0.1:7447/"));
        check(" studio:80 ", Ok("http://studio:80/"));
        check("[::1]:7447", Ok("http://[::1]:7447/"));
        check("", Err("empty"));
        check("https://studio", Err("plain http"));
        check("ftp://studio", Err("scheme"));
        check("not an address", Err("invalid"));
    }
}
