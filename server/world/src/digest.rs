//! One number that stands for the whole state, bit by bit.

use nalgebra::Isometry3;

use crate::frame::Feature;
use crate::hand::judgement::PosedHand;
use crate::hand::part::JudgementPart;
use crate::state::{Body, Rest, State};

/// FNV-1a's offset and prime for 64 bits (Fowler, Noll, Vo), taken over words in place of bytes, with a final mix.
const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

/// A hash that takes numbers one after the other.
#[derive(Clone, Copy, Debug)]
struct Hash(u64);

impl Hash {
    fn word(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(PRIME);
        self.0 ^= self.0 >> 29;
    }

    fn numbers<'a>(&mut self, numbers: impl IntoIterator<Item = &'a f64>) {
        for number in numbers {
            self.word(number.to_bits());
        }
    }

    fn pose(&mut self, pose: &Isometry3<f64>) {
        self.numbers(pose.translation.vector.iter());
        self.numbers(pose.rotation.coords.iter());
    }
}

/// The digest of a state: equal states give equal digests.
pub fn digest(state: &State) -> u64 {
    let mut hash = Hash(OFFSET);
    hash.word(state.tick);
    for slot in &state.slots {
        hash.word(u64::from(slot.generation) << 1 | u64::from(slot.body.is_some()));
        if let Some(body) = &slot.body {
            add_body(&mut hash, body);
        }
    }
    for hand in &state.hands {
        hash.word(u64::from(hand.id.0));
        hash.word(hand.tracking as u64);
        hash.word(hand.unseen_steps);
        add_posed(&mut hash, &hand.posed);
        add_posed(&mut hash, &hand.before);
    }
    let mut mixed = hash.0;
    mixed = (mixed ^ (mixed >> 32)).wrapping_mul(PRIME);
    mixed ^ (mixed >> 29)
}

fn add_body(hash: &mut Hash, body: &Body) {
    hash.pose(&body.pose);
    hash.numbers(body.displacement.iter());
    hash.numbers(body.spin.coords.iter());
    for point in &body.track {
        hash.numbers(point.iter());
    }
    let rest = match body.rest {
        Rest::Awake => 0,
        Rest::OnFloor => 1,
        Rest::OnObject(slot) => 2 + u64::from(slot),
    };
    let flags =
        u64::from(body.on_floor) << 1 | u64::from(body.still) << 2 | u64::from(body.barred) << 3;
    hash.word(body.contact as u64 | flags << 2 | u64::from(body.topple_case) << 8 | rest << 16);
    if let Some(hold) = &body.hold {
        hash.word(hold.leader.map_or(0, |hand| u64::from(hand.0) + 1));
        hash.word(hold.since_tick);
        hash.pose(&hold.wrist_from_object);
    }
    for touch in &body.touches {
        let (kind, index) = match touch.part {
            JudgementPart::Point(index) => (0, u64::from(index)),
            JudgementPart::Segment(index) => (1, u64::from(index)),
        };
        let feature = match touch.feature {
            Feature::Face(face) => u64::from(face) << 1,
            Feature::Edge(edge) => u64::from(edge) << 1 | 1,
        };
        hash.word(u64::from(touch.hand.0) << 32 | index << 1 | kind);
        hash.word(feature);
        hash.numbers(touch.point.iter());
        hash.numbers(touch.motion.iter());
        hash.numbers([&touch.fraction]);
    }
}

fn add_posed(hash: &mut Hash, posed: &PosedHand) {
    hash.pose(&posed.wrist);
    for (point, valid) in posed.points.iter().zip(&posed.point_valid) {
        hash.word(u64::from(*valid));
        hash.numbers(point.iter());
    }
}
