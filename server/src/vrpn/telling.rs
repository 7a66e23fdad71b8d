//! What one client has been told, and what it is to be told next.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use tsukamu_devices::vrpn::body::{ButtonChange, encode_button_states};
use tsukamu_devices::vrpn::message::Time;
use tsukamu_devices::vrpn::names::{CONTROL, describe_sender, describe_type};

use super::names::{
    ALIASES_MAX, CHANGE_ID, CONTROL_ID, FIRST_ALIAS_ID, HandIds, OBJECTS_ID, PONG_ID, Roster,
    SLOTS_MIN, STATES_ID, TYPES, Target, WORLD_ID, id_of,
};
use super::picture::{HandReport, N_BUTTONS, Picture, Writer};

/// Bytes for a client: what must come, and what may be lost.
#[derive(Debug, Default)]
pub(super) struct Bytes {
    /// Descriptions and buttons: by TCP.
    pub(super) certain: Vec<u8>,
    /// Poses and angles: by UDP where the client takes them so.
    pub(super) urgent: Vec<u8>,
}

/// What one client has been told.
#[derive(Debug, Default)]
pub(super) struct Telling {
    /// The last picture.
    last: Option<u64>,
    /// Numbers of hands that were described.
    n_slots: usize,
    /// Own names that were described, with the ids that they got.
    aliases: BTreeMap<String, i32>,
    /// Names that the client opened.
    opened: BTreeSet<String>,
    /// Buttons by the hand's number.
    buttons: BTreeMap<usize, u32>,
    roster: Option<Arc<Roster>>,
}

impl Telling {
    /// What follows the cookie.
    pub(super) fn greeting(&mut self, time: Time) -> Vec<u8> {
        let mut out = Vec::new();
        describe_sender(time, CONTROL_ID, CONTROL, &mut out);
        describe_sender(time, OBJECTS_ID, "Objects", &mut out);
        describe_sender(time, WORLD_ID, "World", &mut out);
        for (id, name) in (0..).zip(TYPES) {
            describe_type(time, id, name, &mut out);
        }
        self.describe_slots(time, SLOTS_MIN, &mut out);
        out
    }

    /// The client opened a device: it is told everything anew, for it may have thrown away what it was told before.
    pub(super) fn open(&mut self, name: String) {
        if self.opened.len() < ALIASES_MAX && self.opened.insert(name) {
            self.last = None;
            self.roster = None;
        }
    }

    /// The answer to a ping; `None` when there is no such device.
    pub(super) fn pong(&self, time: Time, name: &str) -> Option<Vec<u8>> {
        let id = id_of(name, self.n_slots).or_else(|| {
            let roster = self.roster.as_ref()?;
            roster.get(name)?;
            self.aliases.get(name).copied()
        })?;
        let mut writer = Writer::at(time, 0);
        writer.message(id, PONG_ID, |_| {});
        Some(writer.out)
    }

    /// What is new to the client in a picture, and how many pictures it missed; `None` when it knows it.
    pub(super) fn tell(&mut self, picture: &Picture) -> Option<(Bytes, u64)> {
        if self.last == Some(picture.serial) {
            return None;
        }
        let is_next = self.last.is_some_and(|last| last + 1 == picture.serial);
        let n_missed = self
            .last
            .map_or(0, |last| picture.serial.saturating_sub(last + 1));
        let is_first = self.last.is_none();
        self.last = Some(picture.serial);
        let mut bytes = Bytes::default();
        let n_slots = picture.hands.iter().map(|hand| hand.slot + 1).max();
        self.describe_slots(picture.time, n_slots.unwrap_or(0), &mut bytes.certain);
        self.describe_aliases(picture, &mut bytes.certain);
        self.tell_buttons(picture, is_first, &mut bytes.certain);
        let shared = if is_next {
            &picture.changed
        } else {
            &picture.whole
        };
        bytes.urgent = shared.clone();
        self.tell_aliases(picture, &mut bytes.urgent);
        Some((bytes, n_missed))
    }

    /// All poses and angles of a picture that the client was told before.
    pub(super) fn again(&self, picture: &Picture) -> Vec<u8> {
        let mut urgent = picture.whole.clone();
        self.tell_aliases(picture, &mut urgent);
        urgent
    }

    fn describe_slots(&mut self, time: Time, n_slots: usize, out: &mut Vec<u8>) {
        for slot in self.n_slots..n_slots {
            for (id, name) in HandIds::of(slot).named(slot) {
                describe_sender(time, id, &name, out);
            }
        }
        self.n_slots = self.n_slots.max(n_slots);
    }

    /// Own names: of hands as they come, of objects when they are opened.
    fn describe_aliases(&mut self, picture: &Picture, out: &mut Vec<u8>) {
        let is_known = self
            .roster
            .as_ref()
            .is_some_and(|roster| Arc::ptr_eq(roster, &picture.roster));
        if is_known {
            return;
        }
        let opened = self
            .opened
            .iter()
            .filter(|name| picture.roster.get(name).is_some());
        for name in picture.roster.hands.iter().chain(opened) {
            if self.aliases.len() < ALIASES_MAX && !self.aliases.contains_key(name) {
                let id = FIRST_ALIAS_ID + self.aliases.len() as i32;
                describe_sender(picture.time, id, name, out);
                self.aliases.insert(name.clone(), id);
            }
        }
        self.roster = Some(Arc::clone(&picture.roster));
    }

    /// All buttons of hands that are new to the client, and what changed of the others.
    fn tell_buttons(&mut self, picture: &Picture, is_first: bool, out: &mut Vec<u8>) {
        let mut writer = Writer::at(picture.time, picture.serial);
        let mut before = std::mem::take(&mut self.buttons);
        if is_first {
            before.clear();
        }
        for hand in &picture.hands {
            self.buttons.insert(hand.slot, hand.buttons);
            let was = before.remove(&hand.slot);
            for ids in self.senders_of(hand, picture) {
                write_buttons(&mut writer, ids.grasp, was, hand.buttons);
            }
        }
        // Whoever has gone holds and touches nothing.
        for (slot, was) in before {
            write_buttons(&mut writer, HandIds::of(slot).grasp, Some(was), 0);
        }
        out.append(&mut writer.out);
    }

    /// The numbered senders of a hand, and that of its own name if the client opened it.
    fn senders_of(&self, hand: &HandReport, picture: &Picture) -> Vec<HandIds> {
        let own = self.opened_aliases(picture);
        let own = own.filter(|(target, _)| *target == Target::Hand(hand.slot));
        std::iter::once(HandIds::of(hand.slot))
            .chain(own.map(|(_, id)| HandIds::all(id)))
            .collect()
    }

    /// Own names that the client opened: what they stand for, and their ids.
    fn opened_aliases(&self, picture: &Picture) -> impl Iterator<Item = (Target, i32)> {
        self.opened.iter().filter_map(|name| {
            let id = *self.aliases.get(name)?;
            Some((picture.roster.get(name)?, id))
        })
    }

    fn tell_aliases(&self, picture: &Picture, out: &mut Vec<u8>) {
        let mut writer = Writer::at(picture.time, picture.serial);
        for (target, id) in self.opened_aliases(picture) {
            match target {
                Target::Hand(slot) => {
                    let hand = picture.hands.iter().find(|hand| hand.slot == slot);
                    hand.into_iter()
                        .for_each(|hand| writer.hand(HandIds::all(id), hand));
                }
                Target::Object(slot) => {
                    if let Some(pose) = picture.objects.get(&slot) {
                        let mut pose = *pose;
                        pose.sensor = 0;
                        writer.pose(id, &pose);
                    }
                }
            }
        }
        out.append(&mut writer.out);
    }
}

fn write_buttons(writer: &mut Writer, sender: i32, was: Option<u32>, now: u32) {
    let state = |button: usize| (now >> button & 1) as i32;
    let Some(was) = was else {
        let states: [i32; N_BUTTONS] = std::array::from_fn(state);
        return writer.message(sender, STATES_ID, |out| encode_button_states(&states, out));
    };
    for button in (0..N_BUTTONS).filter(|button| (was ^ now) >> button & 1 == 1) {
        let change = ButtonChange {
            button: button as i32,
            state: state(button),
        };
        writer.message(sender, CHANGE_ID, |out| change.encode(out));
    }
}
