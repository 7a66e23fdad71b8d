//! What the log says of clients: however often one comes and whatever it says, the log stays short.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::Duration;

use tokio::time::Instant;
use tracing::{debug, warn};

/// A complaint of one kind about one host is written once in this time.
const ONCE: Duration = Duration::from_secs(60);
/// Complaints that are written in that time, at most: datagrams can name any host as their sender.
const COMPLAINTS_MAX: usize = 64;

/// Clients whose coming and going is written in that time, at most.
const COMINGS_MAX: usize = 120;

/// What there is to complain of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Trouble {
    /// The system has no further connection.
    NoConnection,
    /// There are too many clients.
    NoRoom,
    /// It asked to be connected back, and cannot be reached.
    Unreachable,
    /// It takes nothing.
    Stalled,
    /// It does not greet.
    Unheard,
    /// What it says is wrong.
    Wrong,
}

/// When each was written last.
#[derive(Debug, Default)]
pub(super) struct Complaints(BTreeMap<(IpAddr, Trouble), Instant>);

/// Clients whose coming was written, and since when they are counted.
#[derive(Debug, Default)]
pub(super) struct Comings(Option<(Instant, usize)>);

impl Comings {
    /// Whether the coming and going of one more client is to be written.
    pub(super) fn is_due(&mut self, now: Instant) -> bool {
        let (since, n) = self
            .0
            .filter(|(since, _)| now.saturating_duration_since(*since) < ONCE)
            .unwrap_or((now, 0));
        self.0 = Some((since, n + 1));
        n < COMINGS_MAX
    }
}

impl Complaints {
    /// Writes a complaint, unless one of the kind was written about the host not long ago, or too many about all.
    pub(super) fn write(&mut self, about: IpAddr, trouble: Trouble, text: &str) {
        if self.is_due(about, trouble, Instant::now()) {
            warn!(client = %about, complaint = text, "VRPN client");
        } else {
            debug!(client = %about, complaint = text, "VRPN client");
        }
    }

    fn is_due(&mut self, about: IpAddr, trouble: Trouble, now: Instant) -> bool {
        self.0
            .retain(|_, written| now.saturating_duration_since(*written) < ONCE);
        let is_due = self.0.len() < COMPLAINTS_MAX && !self.0.contains_key(&(about, trouble));
        if is_due {
            self.0.insert((about, trouble), now);
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    #[test]
    fn a_client_that_comes_again_and_again_is_not_always_written() {
        let mut comings = Comings::default();
        let now = Instant::now();
        let n_due = (0..10_000).filter(|_| comings.is_due(now)).count();
        assert_eq!(n_due, COMINGS_MAX);
        assert!(comings.is_due(now + ONCE));
    }

    #[test]
    fn one_host_and_many_write_little() {
        let mut complaints = Complaints::default();
        let now = Instant::now();
        let host = |number: u32| IpAddr::V4(Ipv4Addr::from(number));
        assert!(complaints.is_due(host(1), Trouble::Wrong, now));
        assert!(complaints.is_due(host(1), Trouble::Unheard, now));
        // In turns, which must not make each of them new again.
        for _ in 0..10 {
            assert!(!complaints.is_due(host(1), Trouble::Wrong, now));
            assert!(!complaints.is_due(host(1), Trouble::Unheard, now));
        }
        let n_due = (2..10_000)
            .filter(|number| complaints.is_due(host(*number), Trouble::Unreachable, now))
            .count();
        assert_eq!(n_due, COMPLAINTS_MAX - 2);
        assert!(complaints.is_due(host(1), Trouble::Wrong, now + ONCE));
    }
}
