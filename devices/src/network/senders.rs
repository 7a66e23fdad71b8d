//! Which of several senders is heard.

use std::net::SocketAddr;

/// Senders remembered besides the one that is heard.
const MAX_OLDER: usize = 8;
/// How long the heard sender may be silent before an older one is heard again, ns.
const SILENT_NS: u64 = 1_000_000_000;
/// How long a sender that is not heard is complained about, ns.
const REMEMBERED_NS: u64 = 3_000_000_000;

/// The newest sender is heard, the others are refused and told of: two programs that send to one port would otherwise
/// be mixed into one hand that jumps. A sender that takes a new port for each datagram never comes back under an old
/// one, and is always the newest.
#[derive(Debug, Default)]
pub(super) struct Senders {
    heard: Option<(SocketAddr, u64)>,
    older: Vec<SocketAddr>,
    refused: Option<(SocketAddr, u64)>,
    /// Datagrams that were refused.
    pub(super) n_refused: u64,
}

impl Senders {
    /// Whether a datagram from there is heard.
    pub(super) fn admit(&mut self, now_ns: u64, from: SocketAddr) -> bool {
        if let Some((heard, last_ns)) = self.heard
            && heard != from
        {
            let known = self.older.iter().position(|older| *older == from);
            if known.is_some() && now_ns.saturating_sub(last_ns) <= SILENT_NS {
                self.refused = Some((from, now_ns));
                self.n_refused += 1;
                return false;
            }
            if let Some(index) = known {
                self.older.remove(index);
            }
            if self.older.len() == MAX_OLDER {
                self.older.remove(0);
            }
            self.older.push(heard);
        }
        self.heard = Some((from, now_ns));
        true
    }

    /// The one that is heard.
    pub(super) fn heard(&self) -> Option<SocketAddr> {
        self.heard.map(|(heard, _)| heard)
    }

    /// The one that was refused lately.
    pub(super) fn refused(&self, now_ns: u64) -> Option<SocketAddr> {
        self.refused
            .filter(|(_, last_ns)| now_ns.saturating_sub(*last_ns) <= REMEMBERED_NS)
            .map(|(refused, _)| refused)
    }
}

#[cfg(test)]
mod tests {
    use std::net::SocketAddr;

    use super::{MAX_OLDER, Senders};

    const MS: u64 = 1_000_000;

    fn sender(port: u16) -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], port))
    }

    #[test]
    fn the_newest_is_heard_and_the_other_is_told_of() {
        let mut senders = Senders::default();
        assert!(senders.admit(0, sender(1)));
        assert!(senders.admit(MS, sender(2)), "newer");
        assert_eq!(senders.refused(MS), None, "the first may have ended");
        assert!(!senders.admit(2 * MS, sender(1)), "it has not");
        assert!(senders.admit(3 * MS, sender(2)));
        assert_eq!(senders.refused(3 * MS), Some(sender(1)));
        assert_eq!((senders.heard(), senders.n_refused), (Some(sender(2)), 1));
        assert_eq!(senders.refused(4_000 * MS), None);
    }

    #[test]
    fn an_older_one_is_heard_again_when_the_newer_is_silent() {
        let mut senders = Senders::default();
        senders.admit(0, sender(1));
        senders.admit(MS, sender(2));
        assert!(!senders.admit(1_000 * MS, sender(1)));
        assert!(senders.admit(1_002 * MS, sender(1)));
        assert_eq!(senders.heard(), Some(sender(1)));
        assert!(!senders.admit(1_003 * MS, sender(2)));
    }

    #[test]
    fn a_port_for_each_datagram_is_one_sender_after_another() {
        let mut senders = Senders::default();
        for k in 0..1000_u16 {
            assert!(senders.admit(u64::from(k) * MS, sender(k + 1)));
        }
        assert_eq!(senders.n_refused, 0);
        assert!(senders.older.len() <= MAX_OLDER);
    }
}
