//! Names of senders and types. Numbers stand for them on the wire, chosen by each side for what it sends.

use std::collections::BTreeMap;

use super::body::{decode_name, encode_name};
use super::message::{Header, Message, Time, encode_with, system};

/// `vrpn_Tracker Pos_Quat`.
pub const POS_QUAT: &str = "vrpn_Tracker Pos_Quat";
/// `vrpn_Analog Channel`.
pub const ANALOG_CHANNEL: &str = "vrpn_Analog Channel";
/// `vrpn_Button Change`.
pub const BUTTON_CHANGE: &str = "vrpn_Button Change";
/// `vrpn_Button States`.
pub const BUTTON_STATES: &str = "vrpn_Button States";
/// `vrpn_Base text_message`.
pub const TEXT: &str = "vrpn_Base text_message";
/// `vrpn_Base ping_message`.
pub const PING: &str = "vrpn_Base ping_message";
/// `vrpn_Base pong_message`.
pub const PONG: &str = "vrpn_Base pong_message";
/// The sender that stands for the connection itself.
pub const CONTROL: &str = "VRPN Control";

/// Numbers beyond this are not kept; VRPN's own tables are as long.
pub const MAX_IDS: i32 = 2000;

/// What the other side calls its senders, or its types. Bounded.
#[derive(Debug, Clone, Default)]
pub struct Names(BTreeMap<i32, String>);

impl Names {
    /// Takes over a description, and gives the name. `None` when it is malformed or its number out of bounds: what
    /// comes under that number is ignored then.
    pub fn learn(&mut self, message: &Message<'_>) -> Option<String> {
        let id = message.header.sender;
        let name = decode_name(message.body)?;
        if !(0..MAX_IDS).contains(&id) {
            return None;
        }
        self.0.insert(id, name.clone());
        Some(name)
    }

    /// The name of a number.
    #[must_use]
    pub fn get(&self, id: i32) -> Option<&str> {
        self.0.get(&id).map(String::as_str)
    }

    /// All names, by number.
    pub fn iter(&self) -> impl Iterator<Item = &str> {
        self.0.values().map(String::as_str)
    }

    /// Forgets everything: a new connection begins.
    pub fn clear(&mut self) {
        self.0.clear();
    }
}

/// Appends the description of a sender.
pub fn describe_sender(time: Time, id: i32, name: &str, out: &mut Vec<u8>) {
    describe(system::SENDER_DESCRIPTION, time, id, name, out);
}

/// Appends the description of a type.
pub fn describe_type(time: Time, id: i32, name: &str, out: &mut Vec<u8>) {
    describe(system::TYPE_DESCRIPTION, time, id, name, out);
}

fn describe(kind: i32, time: Time, id: i32, name: &str, out: &mut Vec<u8>) {
    let header = Header {
        time,
        sender: id,
        kind,
        sequence: 0,
    };
    encode_with(&header, out, |out| encode_name(name, out));
}
