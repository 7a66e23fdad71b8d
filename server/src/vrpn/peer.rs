//! What a client says, as a state machine: bytes in, meanings out. Bounded, whatever comes.

use std::collections::BTreeMap;

use thiserror::Error;
use tsukamu_devices::vrpn::body::{decode_name, decode_udp_address};
use tsukamu_devices::vrpn::cookie::Cookie;
use tsukamu_devices::vrpn::inbound::{Inbound, Item};
use tsukamu_devices::vrpn::message::{Message, MessageFault, system};
use tsukamu_devices::vrpn::names::PING;

use super::names::ALIASES_MAX;

/// What a client wants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Said {
    /// It speaks our version; this is its own.
    Greeted(String),
    /// It opened a device.
    Opened(String),
    /// It asks whether a device is there.
    Ping(String),
    /// It takes poses as datagrams at this port.
    Datagrams(u16),
}

/// Why a client is not listened to any more.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub(super) enum PeerFault {
    /// It speaks another version, or something else.
    #[error("it is no VRPN client of version 07; it says {0:?}")]
    Foreign(String),
    /// What it sends is no message.
    #[error(transparent)]
    Malformed(#[from] MessageFault),
}

/// One client's side of the connection.
#[derive(Debug, Default)]
pub(super) struct Peer {
    inbound: Inbound,
    /// Its own numbers of the devices that it opened.
    senders: BTreeMap<i32, String>,
    /// Its own number of a ping.
    ping: Option<i32>,
}

impl Peer {
    /// Whether its cookie has come.
    pub(super) const fn is_greeted(&self) -> bool {
        self.inbound.is_greeted()
    }

    /// Takes bytes, at most [`Inbound::MAX_PUSH`]; appends what they mean, the same thing once.
    pub(super) fn push(&mut self, bytes: &[u8], said: &mut Vec<Said>) -> Result<(), PeerFault> {
        let mut inbound = std::mem::take(&mut self.inbound);
        inbound.push(bytes);
        let result = self.take_all(&mut inbound, said);
        self.inbound = inbound;
        result
    }

    fn take_all(&mut self, inbound: &mut Inbound, said: &mut Vec<Said>) -> Result<(), PeerFault> {
        while let Some(item) = inbound.next_item()? {
            let news = match item {
                Item::Cookie(Cookie::Fits { version }) => Some(Said::Greeted(version)),
                Item::Cookie(Cookie::Foreign { text }) => return Err(PeerFault::Foreign(text)),
                Item::Message(message) => self.take(&message),
            };
            said.extend(news.filter(|news| !said.contains(news)));
        }
        Ok(())
    }

    fn take(&mut self, message: &Message<'_>) -> Option<Said> {
        let id = message.header.sender;
        match message.header.kind {
            system::SENDER_DESCRIPTION => {
                let name = decode_name(message.body)?;
                if self.senders.len() >= ALIASES_MAX && !self.senders.contains_key(&id) {
                    return None;
                }
                self.senders.insert(id, name.clone());
                Some(Said::Opened(name))
            }
            system::TYPE_DESCRIPTION => {
                if decode_name(message.body)? == PING {
                    self.ping = Some(id);
                }
                None
            }
            system::UDP_DESCRIPTION => {
                // The address is checked to be one, and not used: datagrams go where the connection comes from.
                decode_udp_address(message.body)?;
                let port = u16::try_from(id).ok().filter(|port| *port > 0)?;
                Some(Said::Datagrams(port))
            }
            kind if Some(kind) == self.ping => self.senders.get(&id).cloned().map(Said::Ping),
            // Requests to devices, logs: nothing here obeys them.
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::{any, prop_assert, proptest};
    use tsukamu_devices::vrpn::cookie::COOKIE;
    use tsukamu_devices::vrpn::message::{Header, Time, encode_with};
    use tsukamu_devices::vrpn::names::{describe_sender, describe_type};

    use super::*;

    #[test]
    fn a_client_is_understood() {
        let mut bytes = COOKIE.to_vec();
        describe_sender(Time::default(), 3, "Hand0", &mut bytes);
        describe_type(Time::default(), 9, PING, &mut bytes);
        let ping = Header {
            sender: 3,
            kind: 9,
            ..Header::default()
        };
        let udp = Header {
            sender: 44_776,
            kind: system::UDP_DESCRIPTION,
            ..Header::default()
        };
        for _ in 0..3 {
            encode_with(&ping, &mut bytes, |_| {});
        }
        encode_with(&udp, &mut bytes, |out| out.extend(b"127.0.0.1\0"));
        let (mut peer, mut said) = (Peer::default(), Vec::new());
        // One byte at a time.
        for byte in bytes {
            peer.push(&[byte], &mut said).expect("good bytes");
        }
        let expected = [
            Said::Greeted("vrpn: ver. 07.38".to_owned()),
            Said::Opened("Hand0".to_owned()),
            Said::Ping("Hand0".to_owned()),
            Said::Datagrams(44_776),
        ];
        assert_eq!(said, expected);
    }

    #[test]
    fn other_versions_and_malformed_messages_end_it() {
        let push = |bytes: &[u8]| Peer::default().push(bytes, &mut Vec::new());
        assert!(matches!(
            push(b"vrpn: ver. 08.00  0\0\0\0\0\0"),
            Err(PeerFault::Foreign(text)) if text.starts_with("vrpn: ver. 08.00")
        ));
        for bad in [&[0, 0, 0, 23][..], &[0, 1, 0, 1], &[0xFF; 4]] {
            let bytes = [&COOKIE[..], bad].concat();
            assert!(
                matches!(push(&bytes), Err(PeerFault::Malformed(_))),
                "{bad:?}"
            );
        }
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_do_no_harm(parts in vec(vec(any::<u8>(), 0..300), 0..40), greeted in any::<bool>()) {
            let (mut peer, mut said) = (Peer::default(), Vec::new());
            if greeted {
                peer.push(&COOKIE, &mut said).expect("a good cookie");
            }
            for part in parts {
                if peer.push(&part, &mut said).is_err() {
                    break;
                }
            }
            prop_assert!(said.len() <= 2000);
        }
    }
}
