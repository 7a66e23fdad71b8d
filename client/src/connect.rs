use std::time::Duration;

use tonic::transport::{Channel, Endpoint};
use tsukamu_proto::PROTOCOL_MAJOR;
use tsukamu_proto::v1::calibration_client::CalibrationClient;
use tsukamu_proto::v1::clock_client::ClockClient;
use tsukamu_proto::v1::control_client::ControlClient;
use tsukamu_proto::v1::devices_client::DevicesClient;
use tsukamu_proto::v1::hands_client::HandsClient;
use tsukamu_proto::v1::recordings_client::RecordingsClient;
use tsukamu_proto::v1::world_client::WorldClient;
use tsukamu_proto::v1::{GetStatusRequest, GetStatusResponse};

use crate::clock::ClientClock;
use crate::connect_error::{
    ConnectError, error_of, root_cause, silence, unreachable, wrong_service,
};
use crate::retry::RetryPolicy;

/// Where a daemon listens unless told otherwise.
pub const DEFAULT_ADDRESS: &str = "http://127.0.0.1:7447";
/// Port of a daemon that was given no other.
pub const DEFAULT_PORT: u16 = 7447;
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
    /// `http://host:port`; without a scheme, `http` is meant, and without that and a port, [`DEFAULT_PORT`].
    pub address: String,
    /// Longest wait for one attempt, and for the answer of one status call.
    pub timeout: Duration,
    /// What to do when nobody answers.
    pub retry: RetryPolicy,
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

    /// Calibration of gloves and trackers.
    pub fn calibration(&self) -> CalibrationClient<Channel> {
        CalibrationClient::new(self.channel.clone())
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
    let parse =
        |address: String| Endpoint::from_shared(address).map_err(|error| bad(&root_cause(&error)));
    let mut endpoint = parse(address)?;
    if !given.contains("://") && endpoint.uri().port().is_none() {
        let host = given.trim_end_matches(['/', ':']);
        endpoint = parse(format!("http://{host}:{DEFAULT_PORT}"))?;
    }
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

#[cfg(test)]
mod tests {
    use super::*;

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
        check("127.0.0.1", Ok("http://127.0.0.1:7447/"));
        check("studio/", Ok("http://studio:7447/"));
        check("http://studio", Ok("http://studio/"));
        check(":", Err("host"));
        check(" studio:80 ", Ok("http://studio:80/"));
        check("[::1]:7447", Ok("http://[::1]:7447/"));
        check("", Err("empty"));
        check("https://studio", Err("plain http"));
        check("ftp://studio", Err("scheme"));
        check("not an address", Err("invalid"));
    }
}
