//! What the clocks of an open connection say.

const MS: u64 = 1_000_000;
/// Time between pings while the device does not answer, and silence after which it is pinged.
const PING_NS: u64 = 1_000 * MS;
/// Silence after which the device counts as silent.
const SILENT_NS: u64 = 3_000 * MS;
/// Silence of the whole server after which a new connection is made.
const GIVE_UP_NS: u64 = 10_000 * MS;
/// An analog is sent when it changes; in between the last one stands, and is repeated as often as this.
const REPEAT_NS: u64 = 100 * MS;

/// Who was heard when, monotonic ns.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Heard {
    /// When the cookies were exchanged.
    pub(super) opened_ns: u64,
    /// The last word of the server, whatever it was.
    pub(super) server_ns: u64,
    /// The last word of the device: a record or a pong.
    pub(super) device_ns: u64,
    /// Whether it said anything on this connection.
    pub(super) is_answered: bool,
    /// Whether it sent a record on this connection.
    pub(super) has_record: bool,
    /// The last pose, if it sent one.
    pub(super) pose_ns: Option<u64>,
    /// The last reading of the glove, repeated or not.
    pub(super) glove_ns: Option<u64>,
    /// Our last ping.
    pub(super) ping_ns: u64,
}

/// What is wrong with an open connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Trouble {
    /// Nothing came for so long that a new connection is due.
    Dead,
    /// The device does not answer.
    Silent,
    /// The device answers and sends nothing.
    Mute,
}

impl Heard {
    /// A connection that has just been opened.
    pub(super) fn opened(now_ns: u64) -> Self {
        Self {
            opened_ns: now_ns,
            server_ns: now_ns,
            device_ns: now_ns,
            ..Self::default()
        }
    }

    /// Whether the device is to be pinged.
    pub(super) const fn is_ping_due(&self, now_ns: u64) -> bool {
        let is_asking = !self.is_answered || since(self.device_ns, now_ns) >= PING_NS;
        is_asking && since(self.ping_ns, now_ns) >= PING_NS
    }

    /// Whether the last reading of the glove is to be said again: an analog that does not change is not sent.
    pub(super) fn is_repeat_due(&self, now_ns: u64) -> bool {
        self.glove_ns
            .is_some_and(|glove_ns| since(glove_ns, now_ns) >= REPEAT_NS)
    }

    /// What is wrong, if anything is.
    pub(super) fn trouble(&self, now_ns: u64) -> Option<Trouble> {
        // Only a tracker has to go on by itself; analogs and buttons speak when something changes.
        let last_due_ns = match (self.has_record, self.glove_ns) {
            (false, _) => Some(self.opened_ns),
            (true, None) => self.pose_ns,
            (true, Some(_)) => None,
        };
        if since(self.server_ns, now_ns) >= GIVE_UP_NS {
            Some(Trouble::Dead)
        } else if since(self.device_ns, now_ns) >= SILENT_NS {
            Some(Trouble::Silent)
        } else if last_due_ns.is_some_and(|due_ns| since(due_ns, now_ns) >= SILENT_NS) {
            Some(Trouble::Mute)
        } else {
            None
        }
    }
}

const fn since(then_ns: u64, now_ns: u64) -> u64 {
    now_ns.saturating_sub(then_ns)
}
