//! The client of a VRPN server as a state machine: cookies, descriptions, pings, readings.
//!
//! ```text
//!  Closed -> Greeting (our cookie is out) -> Open (described, pinged; readings as they come)
//!     ^          | no cookie, a foreign one     | malformed bytes, 10 s without a word
//!     +----------+------------------------------+   the owner of the connection makes a new one
//! ```

mod records;

use super::body::encode_udp_address;
use super::cookie::{COOKIE, Cookie};
use super::inbound::{Inbound, Item};
use super::liveness::{Heard, Trouble};
use super::message::{Header, Message, MessageFault, Time, encode_with, system};
use super::names::{CONTROL, Names, PING, describe_sender, describe_type};
use super::readings::{Arrival, Readings};
use super::settings::VrpnSettings;
use crate::core::Core;
use crate::fault::{Fault, hex};
use crate::glove::calibrate::GloveCalibration;
use crate::session::{DeviceEvent, DeviceInfo, LinkAbout, PortRequest, Session, SessionState};

const MS: u64 = 1_000_000;
/// How long the server may take to send its cookie.
const COOKIE_NS: u64 = 3_000 * MS;
/// How often the clocks of an open connection are looked at.
const CHECK_NS: u64 = 100 * MS;
/// Names of other devices that an error message lists.
const LISTED: usize = 8;

/// Our own numbers, for what we send.
const OUR_SENDER: i32 = 0;
const OUR_PING: i32 = 0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Closed,
    Greeting { deadline_ns: u64 },
    Open,
}

/// A VRPN device as a state machine. **Joined to this project's own server and to captured bytes, not yet tried in a
/// laboratory.**
#[derive(Debug)]
pub struct VrpnSession {
    settings: VrpnSettings,
    calibration: GloveCalibration,
    core: Core,
    stage: Stage,
    inbound: Inbound,
    senders: Names,
    types: Names,
    readings: Readings,
    heard: Heard,
    check_ns: Option<u64>,
    link: LinkAbout,
}

impl VrpnSession {
    /// A session without a connection.
    #[must_use]
    pub fn new(settings: VrpnSettings, calibration: GloveCalibration) -> Self {
        Self {
            settings,
            calibration,
            core: Core::new(),
            stage: Stage::Closed,
            inbound: Inbound::default(),
            senders: Names::default(),
            types: Names::default(),
            readings: Readings::new(),
            heard: Heard::default(),
            check_ns: None,
            link: LinkAbout::default(),
        }
    }

    /// The device and its server.
    #[must_use]
    pub const fn settings(&self) -> &VrpnSettings {
        &self.settings
    }

    fn address(&self) -> String {
        self.settings.address.to_string()
    }

    fn trouble(&self, detail: impl Into<String>) -> Fault {
        Fault::Port {
            path: self.address(),
            detail: detail.into(),
        }
    }

    fn time(&self, now_ns: u64) -> Time {
        Time::from_unix_ns(self.link.unix_origin_ns.saturating_add(now_ns))
    }

    fn greeted(&mut self, now_ns: u64, cookie: Cookie) {
        if let Cookie::Foreign { text } = cookie {
            let shown: String = text.chars().take(24).collect();
            let fault = self.trouble(format!(
                "what answers there is no VRPN server of version 07; it says {shown:?}"
            ));
            return self.give_up(now_ns, fault);
        }
        self.stage = Stage::Open;
        self.heard = Heard::opened(now_ns);
        let time = self.time(now_ns);
        let mut out = Vec::new();
        if let Some((address, port)) = self.link.datagrams_at {
            let header = Header {
                time,
                sender: port.into(),
                kind: system::UDP_DESCRIPTION,
                sequence: 0,
            };
            encode_with(&header, &mut out, |out| encode_udp_address(address, out));
        }
        describe_sender(time, OUR_SENDER, &self.settings.address.device, &mut out);
        describe_type(time, OUR_PING, PING, &mut out);
        self.core.send(out);
        self.ping(now_ns);
        self.check_ns = Some(now_ns + CHECK_NS);
        // A server that closes at once again must not make news each time.
        if self.core.fault.is_none() {
            self.core.enter(now_ns, SessionState::Querying, None);
        }
    }

    fn ping(&mut self, now_ns: u64) {
        let header = Header {
            time: self.time(now_ns),
            sender: OUR_SENDER,
            kind: OUR_PING,
            sequence: 0,
        };
        let mut out = Vec::new();
        encode_with(&header, &mut out, |_| {});
        self.core.send(out);
        self.heard.ping_ns = now_ns;
    }

    fn take(&mut self, stamp_ns: u64, message: &Message<'_>, is_datagram: bool) {
        self.heard.server_ns = stamp_ns;
        match message.header.kind {
            system::SENDER_DESCRIPTION => {
                self.senders.learn(message);
            }
            system::TYPE_DESCRIPTION => {
                self.types.learn(message);
            }
            // Where to send datagrams is of no use: a client has nothing urgent to say. Logs are not kept.
            kind if kind < 0 => {}
            kind => {
                if self.senders.get(message.header.sender)
                    == Some(self.settings.address.device.as_str())
                {
                    let name = self.types.get(kind).unwrap_or_default().to_owned();
                    self.take_from_device(stamp_ns, message, &name, is_datagram);
                }
            }
        }
    }

    /// The device has said something.
    fn answered(&mut self, stamp_ns: u64) {
        self.heard.device_ns = stamp_ns;
        if std::mem::replace(&mut self.heard.is_answered, true) {
            return;
        }
        self.core.emit(DeviceEvent::Identified(DeviceInfo {
            family: "VRPN",
            firmware: String::new(),
            identity: self.settings.address.device.clone(),
            n_sensors: self.settings.channels.iter().flatten().count(),
            hand: None,
            tick_ns: Some(1000.0),
            rate_hz: None,
        }));
        self.core.enter(stamp_ns, SessionState::Querying, None);
    }

    /// Looks at all clocks of the open connection.
    fn check(&mut self, now_ns: u64) {
        if self.heard.is_ping_due(now_ns) {
            self.ping(now_ns);
        }
        self.check_ns = Some(now_ns + CHECK_NS);
        let detail = match self.heard.trouble(now_ns) {
            Some(Trouble::Dead) => {
                let fault = self.trouble("no response from the server; connecting again");
                return self.give_up(now_ns, fault);
            }
            Some(Trouble::Silent) => self.why_silent(),
            Some(Trouble::Mute) => "the server answers, but this device sends nothing".to_owned(),
            None => {
                if self.heard.has_record && self.core.state == SessionState::Stalled {
                    self.core.enter(now_ns, SessionState::Running, None);
                }
                if self.heard.is_repeat_due(now_ns) {
                    self.repeat(now_ns);
                }
                return;
            }
        };
        let fault = self.trouble(detail);
        self.core.enter(now_ns, SessionState::Stalled, Some(fault));
    }

    /// Says the glove's last reading again: what an analog does not send has not changed.
    fn repeat(&mut self, now_ns: u64) {
        let at = Arrival {
            stamp_ns: now_ns,
            unix_us: None,
            is_datagram: false,
        };
        let reading = self.readings.glove(&self.settings, &self.calibration, at);
        self.heard.glove_ns = Some(now_ns);
        if let Some(reading) = reading {
            self.core.emit(DeviceEvent::Glove(reading));
        }
    }

    /// In words, for a device that does not answer: often its name is wrong.
    fn why_silent(&self) -> String {
        let device = &self.settings.address.device;
        if self.senders.iter().any(|name| name == device) {
            return "the device does not answer".to_owned();
        }
        let others: Vec<&str> = self
            .senders
            .iter()
            .filter(|name| *name != CONTROL)
            .take(LISTED)
            .collect();
        if others.is_empty() {
            format!("the server does not answer for {device:?}, and names no device at all")
        } else {
            format!(
                "the server has no device {device:?}; it names {}",
                others.join(", ")
            )
        }
    }

    /// Asks for a new connection.
    fn give_up(&mut self, now_ns: u64, fault: Fault) {
        self.core.stats.restarts += 1;
        self.core.enter(now_ns, SessionState::Stalled, Some(fault));
        self.close();
        self.core.request(PortRequest::Reopen);
    }

    fn malformed(&mut self, now_ns: u64, fault: MessageFault) {
        self.core.stats.resyncs += 1;
        self.core.stats.dropped_records += 1;
        let bytes = hex(self.inbound.rest());
        let fault = self.trouble(format!("{fault}; connecting again; first bytes: {bytes}"));
        self.give_up(now_ns, fault);
    }

    fn close(&mut self) {
        self.core.forget_port();
        self.stage = Stage::Closed;
        self.check_ns = None;
        self.inbound = Inbound::default();
        self.senders.clear();
        self.types.clear();
        self.readings.forget();
    }

    /// Takes everything that is whole.
    fn take_inbound(&mut self, stamp_ns: u64) {
        // Taken out, so that messages can be lent from it while the rest of the session changes.
        let mut inbound = std::mem::take(&mut self.inbound);
        loop {
            match inbound.next_item() {
                Ok(Some(Item::Cookie(cookie))) => self.greeted(stamp_ns, cookie),
                Ok(Some(Item::Message(message))) => self.take(stamp_ns, &message, false),
                Ok(None) => {
                    self.inbound = inbound;
                    return;
                }
                Err(fault) => {
                    self.inbound = inbound;
                    return self.malformed(stamp_ns, fault);
                }
            }
            if self.stage == Stage::Closed {
                return;
            }
        }
    }
}

impl Session for VrpnSession {
    fn core(&self) -> &Core {
        &self.core
    }

    fn core_mut(&mut self) -> &mut Core {
        &mut self.core
    }

    fn port_opened(&mut self, now_ns: u64) {
        self.close();
        self.stage = Stage::Greeting {
            deadline_ns: now_ns + COOKIE_NS,
        };
        self.core.send(COOKIE);
        if self.core.fault.is_none() {
            self.core.enter(now_ns, SessionState::Resetting, None);
        }
    }

    fn port_lost(&mut self, now_ns: u64, fault: Fault) {
        self.close();
        self.core.enter(now_ns, SessionState::Absent, Some(fault));
    }

    fn push(&mut self, stamp_ns: u64, bytes: &[u8]) {
        self.core.stats.bytes += bytes.len() as u64;
        for part in bytes.chunks(Inbound::MAX_PUSH) {
            if self.stage == Stage::Closed {
                return;
            }
            self.inbound.push(part);
            self.take_inbound(stamp_ns);
        }
    }

    // Takes a datagram that was read at `stamp_ns`. One that is malformed is dropped and counted: the next is whole
    // again.
    fn push_datagram(&mut self, stamp_ns: u64, datagram: &[u8]) {
        self.core.stats.bytes += datagram.len() as u64;
        if self.stage != Stage::Open {
            return;
        }
        let mut rest = datagram;
        while !rest.is_empty() {
            match Message::decode(rest, true) {
                Ok(Some((message, n_taken))) => {
                    // Names come in order and for certain, by TCP; a stranger's datagram must not change them.
                    if message.header.kind >= 0 {
                        self.take(stamp_ns, &message, true);
                    }
                    rest = &rest[n_taken..];
                }
                Ok(None) | Err(_) => {
                    self.core.stats.resyncs += 1;
                    self.core.stats.dropped_records += 1;
                    return;
                }
            }
        }
    }

    fn link_opening(&mut self, link: LinkAbout) {
        self.link = link;
    }

    fn deadline(&self) -> Option<u64> {
        match self.stage {
            Stage::Closed => None,
            Stage::Greeting { deadline_ns } => Some(deadline_ns),
            Stage::Open => self.check_ns,
        }
    }

    fn handle_timeout(&mut self, now_ns: u64) {
        if self
            .deadline()
            .is_none_or(|deadline_ns| now_ns < deadline_ns)
        {
            return;
        }
        if self.stage == Stage::Open {
            return self.check(now_ns);
        }
        let fault = self.trouble("takes the connection, but does not greet as a VRPN server does");
        self.give_up(now_ns, fault);
    }

    fn set_calibration(&mut self, calibration: GloveCalibration) {
        self.calibration = calibration;
    }
}
