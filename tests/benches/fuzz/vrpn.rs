//! VRPN, both ways: a server for our client, and what our server reads of its clients.

use std::collections::VecDeque;

use allocation_counter::measure;
use tsukamu_devices::vrpn::body::{
    PosQuat, Text, decode_button_states, decode_channels, decode_name, decode_request,
    decode_udp_address, encode_channels, encode_request, encode_udp_address,
};
use tsukamu_devices::vrpn::cookie::COOKIE;
use tsukamu_devices::vrpn::inbound::{Inbound, Item};
use tsukamu_devices::vrpn::message::{Header, Message, Time, encode_with, system};
use tsukamu_devices::vrpn::names::{
    ANALOG_CHANNEL, PING, PONG, POS_QUAT, describe_sender, describe_type,
};
use tsukamu_devices::vrpn::settings::VrpnSettings;

use crate::garble::{Chance, Transcripts, piece};
use crate::subjects::Line;

/// The device that is asked for.
const DEVICE: &str = "Tracker0";
/// Time between two poses, ns.
const PERIOD_NS: u64 = 10_000_000;
/// The server's own numbers of the device and of its types.
const SENDER: i32 = 1;
const TYPES: [&str; 4] = [POS_QUAT, ANALOG_CHANNEL, PING, PONG];
const PONG_TYPE: i32 = 3;

/// A tracker of that server.
pub(crate) fn vrpn_settings() -> VrpnSettings {
    let address = format!("{DEVICE}@tcp://127.0.0.1:3883");
    VrpnSettings::tracker(address.parse().expect("an address"))
}

/// A server with one tracker, as one connection sees it.
#[derive(Debug, Default)]
pub(crate) struct VrpnServer {
    is_greeted: bool,
    next_ns: Option<u64>,
    output: VecDeque<Vec<u8>>,
}

fn message(now_ns: u64, kind: i32, write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let header = Header {
        time: Time::from_unix_ns(now_ns),
        sender: SENDER,
        kind,
        sequence: 0,
    };
    let mut out = Vec::new();
    encode_with(&header, &mut out, write);
    out
}

impl Line for VrpnServer {
    /// Whatever a client says, it is there: it is greeted, and its pings are answered.
    fn hear(&mut self, now_ns: u64, _bytes: &[u8]) {
        if !self.is_greeted {
            self.is_greeted = true;
            self.next_ns = Some(now_ns);
            let mut greeting = COOKIE.to_vec();
            describe_sender(Time::default(), SENDER, DEVICE, &mut greeting);
            for (id, name) in (0..).zip(TYPES) {
                describe_type(Time::default(), id, name, &mut greeting);
            }
            self.output.push_back(greeting);
        }
        if self.output.len() < 16 {
            self.output.push_back(message(now_ns, PONG_TYPE, |_| {}));
        }
    }

    fn say(&mut self, now_ns: u64) -> Vec<u8> {
        if let Some(said) = self.output.pop_front() {
            return said;
        }
        match self.next_ns {
            Some(next_ns) if next_ns <= now_ns => {
                self.next_ns = Some(now_ns + PERIOD_NS);
                let pose = PosQuat {
                    sensor: 0,
                    position: [0.1, 0.2, 0.3],
                    rotation: [0.0, 0.0, 0.6, 0.8],
                };
                message(now_ns, 0, |out| pose.encode(out))
            }
            _ => Vec::new(),
        }
    }

    fn due_ns(&self) -> Option<u64> {
        if self.output.is_empty() {
            self.next_ns
        } else {
            Some(0)
        }
    }

    fn reopen(&mut self, _now_ns: u64) {
        *self = Self::default();
    }
}

/// What a client of our server says: the whole of it, cut into messages.
pub(crate) fn client_transcript() -> Vec<Vec<u8>> {
    let mut said = vec![COOKIE.to_vec()];
    let mut out = Vec::new();
    let header = Header {
        sender: 5_000,
        kind: system::UDP_DESCRIPTION,
        ..Header::default()
    };
    encode_with(&header, &mut out, |out| {
        encode_udp_address([127, 0, 0, 1].into(), out);
    });
    said.push(std::mem::take(&mut out));
    describe_sender(Time::default(), 7, "Hand0", &mut out);
    said.push(std::mem::take(&mut out));
    describe_type(Time::default(), 9, PING, &mut out);
    said.push(std::mem::take(&mut out));
    said.push(message(0, 9, |_| {}));
    said.push(message(0, 2, |out| encode_channels(&[1.0; 21], out)));
    said.push(encode_request([127, 0, 0, 1].into(), 5_000));
    said
}

/// One connection of a client that says anything; how many bytes it made us keep at most.
///
/// # Errors
/// When more was kept than may be, or a good connection after it was not understood.
pub(crate) fn server_side(chance: &mut Chance, from: Transcripts<'_>) -> Result<u64, String> {
    let mut fault = Ok(());
    let info = measure(|| {
        fault = strange_client(chance, from).and_then(|()| good_client(from.own));
    });
    fault.map(|()| info.bytes_max)
}

fn strange_client(chance: &mut Chance, from: Transcripts<'_>) -> Result<(), String> {
    let mut inbound = Inbound::default();
    if !chance.one_in(4) {
        inbound.push(&COOKIE);
    }
    for _ in 0..chance.below(60) {
        let bytes = piece(chance, from);
        inbound.push(&bytes);
        loop {
            match inbound.next_item() {
                Ok(Some(item)) => read(&item),
                Ok(None) => break,
                // The connection is closed.
                Err(_) => return Ok(()),
            }
        }
        if inbound.rest().len() > Inbound::CAPACITY {
            return Err(format!("{} bytes wait", inbound.rest().len()));
        }
        // The same as a datagram that asks to be called.
        let _ = decode_request(&bytes);
        let _ = Message::decode(&bytes, true);
    }
    Ok(())
}

/// Everything that anyone may want of it.
fn read(item: &Item<'_>) {
    if let Item::Message(message) = item {
        let _ = (decode_name(message.body), decode_udp_address(message.body));
        let _ = (
            decode_channels(message.body),
            decode_button_states(message.body),
        );
        let _ = (PosQuat::decode(message.body), Text::decode(message.body));
    }
}

fn good_client(said: &[Vec<u8>]) -> Result<(), String> {
    let mut inbound = Inbound::default();
    let mut n_items = 0;
    // The last one is a datagram.
    let (_, stream) = said.split_last().ok_or("no transcript")?;
    for bytes in stream {
        inbound.push(bytes);
        while let Some(item) = inbound.next_item().map_err(|fault| fault.to_string())? {
            read(&item);
            n_items += 1;
        }
    }
    if n_items == stream.len() {
        Ok(())
    } else {
        Err(format!(
            "{n_items} of {} messages of a good client",
            stream.len()
        ))
    }
}
