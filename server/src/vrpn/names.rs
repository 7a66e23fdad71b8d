//! Ids and names of senders. Ids are this side's own choice and the same for every client, but for own names.

use std::collections::BTreeMap;
use std::sync::Arc;

use tsukamu_devices::vrpn::names::{
    ANALOG_CHANNEL, BUTTON_CHANGE, BUTTON_STATES, PING, PONG, POS_QUAT,
};
use tsukamu_world::scene::ObjectSpec;
use tsukamu_world::state::ObjectId;

/// Sender of the connection itself.
pub(super) const CONTROL_ID: i32 = 0;
/// `Objects`.
pub(super) const OBJECTS_ID: i32 = 1;
/// `World`.
pub(super) const WORLD_ID: i32 = 2;
/// The first hand's senders begin here.
const FIRST_HAND_ID: i32 = 3;
/// Hands that are shown; VRPN's tables are short.
pub(super) const SLOTS_MAX: usize = 64;
/// Hands that are announced though there may be none: whoever opens them before is answered.
pub(super) const SLOTS_MIN: usize = 2;
/// Own names begin here.
pub(super) const FIRST_ALIAS_ID: i32 = 256;
/// Own names that one client is told of.
pub(super) const ALIASES_MAX: usize = 512;
/// Longest name, bytes; VRPN keeps 100 with the NUL.
const NAME_MAX: usize = 99;

/// Types, by id.
pub(super) const TYPES: [&str; 6] = [
    POS_QUAT,
    ANALOG_CHANNEL,
    BUTTON_CHANGE,
    BUTTON_STATES,
    PING,
    PONG,
];
/// Id of [`POS_QUAT`].
pub(super) const POS_QUAT_ID: i32 = 0;
/// Id of [`ANALOG_CHANNEL`].
pub(super) const CHANNEL_ID: i32 = 1;
/// Id of [`BUTTON_CHANGE`].
pub(super) const CHANGE_ID: i32 = 2;
/// Id of [`BUTTON_STATES`].
pub(super) const STATES_ID: i32 = 3;
/// Id of [`PONG`].
pub(super) const PONG_ID: i32 = 5;

/// The three senders of a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct HandIds {
    pub(super) hand: i32,
    pub(super) glove: i32,
    pub(super) grasp: i32,
}

impl HandIds {
    /// Those of a hand by its number.
    pub(super) const fn of(slot: usize) -> Self {
        let first = FIRST_HAND_ID + 3 * slot as i32;
        Self {
            hand: first,
            glove: first + 1,
            grasp: first + 2,
        }
    }

    /// All in one: a hand's own name.
    pub(super) const fn all(id: i32) -> Self {
        Self {
            hand: id,
            glove: id,
            grasp: id,
        }
    }

    /// With their names.
    pub(super) fn named(self, slot: usize) -> [(i32, String); 3] {
        [
            (self.hand, format!("Hand{slot}")),
            (self.glove, format!("Glove{slot}")),
            (self.grasp, format!("Grasp{slot}")),
        ]
    }
}

/// What an own name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// A hand, by its number.
    Hand(usize),
    /// An object, by its slot.
    Object(u32),
}

/// The own names of everything in the world.
#[derive(Debug, Default)]
pub(super) struct Roster {
    targets: BTreeMap<String, Target>,
    /// Names of hands, which are announced to everybody.
    pub(super) hands: Vec<String>,
}

impl Roster {
    /// Of hands with their numbers, and objects. A name that is taken, or that this server gives itself, gets a number
    /// behind it; hands come first.
    pub(super) fn of(hands: &[(usize, &str)], objects: &[(ObjectId, Arc<ObjectSpec>)]) -> Self {
        let mut roster = Self::default();
        for (slot, name) in hands {
            let name = roster.add(name, Target::Hand(*slot));
            roster.hands.push(name);
        }
        for (id, spec) in objects {
            roster.add(&spec.name, Target::Object(id.slot));
        }
        roster
    }

    /// What a name stands for.
    pub(super) fn get(&self, name: &str) -> Option<Target> {
        self.targets.get(name).copied()
    }

    fn add(&mut self, name: &str, target: Target) -> String {
        let safe = safe(name);
        let numbered = (2_u64..).map(|number| format!("{safe}_{number}"));
        let name = std::iter::once(safe.clone())
            .chain(numbered)
            .find(|name| !is_ours(name) && !self.targets.contains_key(name))
            .unwrap_or_default();
        self.targets.insert(name.clone(), target);
        name
    }
}

/// A name as VRPN can have it: `@`, `:`, `/` and blanks mean something there.
fn safe(name: &str) -> String {
    let safe: String = name
        .chars()
        .map(|letter| match letter {
            'a'..='z' | 'A'..='Z' | '0'..='9' | '_' | '-' | '.' => letter,
            _ => '_',
        })
        // Room for a number behind it.
        .take(NAME_MAX - 20)
        .collect();
    if safe.is_empty() {
        "_".to_owned()
    } else {
        safe
    }
}

/// Whether a name is one that this server gives itself.
fn is_ours(name: &str) -> bool {
    let numbered = ["Hand", "Glove", "Grasp"].iter().any(|stem| {
        name.strip_prefix(stem).is_some_and(|rest| {
            !rest.is_empty() && rest.bytes().all(|letter| letter.is_ascii_digit())
        })
    });
    numbered || name == "Objects" || name == "World"
}

/// The number of the hand that one of our own names stands for.
pub(super) fn id_of(name: &str, n_slots: usize) -> Option<i32> {
    match name {
        "Objects" => Some(OBJECTS_ID),
        "World" => Some(WORLD_ID),
        _ => (0..n_slots)
            .flat_map(|slot| HandIds::of(slot).named(slot))
            .find(|(_, known)| known == name)
            .map(|(id, _)| id),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_names_are_safe_and_unique() {
        let hands = [
            (0, "alice:right"),
            (1, "alice/right"),
            (2, "Hand0"),
            (3, ""),
        ];
        let roster = Roster::of(&hands, &[]);
        let expected = ["alice_right", "alice_right_2", "Hand0_2", "_"];
        assert_eq!(roster.hands, expected);
        for (slot, name) in expected.iter().enumerate() {
            assert_eq!(roster.get(name), Some(Target::Hand(slot)));
        }
        assert_eq!(roster.get("Hand0"), None);
        let long = Roster::of(&[(0, &"手@".repeat(200))], &[]);
        assert!(long.hands[0].len() < NAME_MAX && long.hands[0].chars().all(|c| c == '_'));
    }

    #[test]
    fn ids_do_not_meet() {
        let last = HandIds::of(SLOTS_MAX - 1);
        assert!(last.grasp < FIRST_ALIAS_ID);
        assert!(FIRST_ALIAS_ID + (ALIASES_MAX as i32) < tsukamu_devices::vrpn::names::MAX_IDS);
        assert_eq!(id_of("Glove1", 2), Some(HandIds::of(1).glove));
        assert_eq!(id_of("Glove2", 2), None);
        assert_eq!(id_of("Objects", 2), Some(OBJECTS_ID));
    }
}
