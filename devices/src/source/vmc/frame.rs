//! One side of an avatar as it arrives, bone by bone: when a frame of it is whole, and what it says.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::bones::{FIRST_OF_SIDE, HAND, N_SLOTS, WHOLE_CHAIN, link_slot};
use crate::glove::calibrate::Handedness;
use crate::glove::sensor::GloveSensor;
use crate::source::links::HandLinks;
use crate::source::unity::hand_from_wrist;

/// Slots of one side alone, one bit each.
const OF_SIDE: u32 = (u32::MAX << FIRST_OF_SIDE) & ((1 << N_SLOTS) - 1);
/// Nearer to its parent than this, a bone's position says nothing, m.
const NO_LENGTH_M: f64 = 1.0e-6;

/// The bones of one side, trunk included.
///
/// Senders split a frame over datagrams and say nowhere where it ends. It ends with the last bone of those that the
/// frame before had, or at the latest when a bone comes for the second time.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SideFrame {
    /// `parent_from_bone` by slot, m.
    bones: [Option<Isometry3<f64>>; N_SLOTS],
    /// When the last bone was read, ns.
    stamp_ns: u64,
    /// Bones of this frame so far, one bit each.
    got: u32,
    /// Bones of the frame before.
    expected: u32,
    /// Whether this frame has been given out.
    is_out: bool,
    /// Whether the frame before lacked bones.
    was_cut_short: bool,
}

impl SideFrame {
    /// Takes a bone. True when the frame before it has to be given out first, by [`SideFrame::hand`] as it was then;
    /// the bone is not taken then, and has to be given again.
    pub(super) fn ends_before(&mut self, slot: usize) -> bool {
        if self.got & (1 << slot) == 0 {
            return false;
        }
        let is_cut_short = !self.is_out && self.got & OF_SIDE != 0;
        for (slot, bone) in self.bones.iter_mut().enumerate() {
            // Left out of two frames, it is not sent any more.
            if (self.got | self.expected) & (1 << slot) == 0 {
                *bone = None;
            }
        }
        // A datagram that is lost once changes nothing of what a frame has.
        let is_first_loss = is_cut_short && !self.was_cut_short;
        self.expected = if is_first_loss {
            self.expected | self.got
        } else {
            self.got
        };
        self.was_cut_short = is_cut_short;
        self.got = 0;
        self.is_out = false;
        is_cut_short
    }

    /// Takes a bone of the present frame. True when that makes it whole.
    pub(super) fn take(
        &mut self,
        stamp_ns: u64,
        slot: usize,
        parent_from_bone: Isometry3<f64>,
    ) -> bool {
        self.stamp_ns = stamp_ns;
        self.bones[slot] = Some(parent_from_bone);
        self.got |= 1 << slot;
        let is_whole = self.expected & OF_SIDE != 0 && self.got & self.expected == self.expected;
        let is_news = is_whole && !self.is_out;
        self.is_out |= is_whole;
        is_news
    }

    /// When the last bone was read, ns.
    pub(super) const fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    /// Whether the chain from the root to the hand is there, with positions.
    pub(super) fn is_placed(&self) -> bool {
        let is_there = |slot: &usize| self.bones[*slot].is_some();
        let has_length = |bone: &Isometry3<f64>| bone.translation.vector.norm() > NO_LENGTH_M;
        WHOLE_CHAIN.iter().all(is_there)
            && WHOLE_CHAIN[2..]
                .iter()
                .any(|slot| self.bones[*slot].as_ref().is_some_and(has_length))
    }

    /// `world_from_wrist` in the sender's space, m, by way of the bones that are there; `None` without a hand bone.
    pub(super) fn wrist(&self, hand: Handedness) -> Option<Isometry3<f64>> {
        self.bones[HAND]?;
        let root_from_hand = self.bones[..=HAND]
            .iter()
            .flatten()
            .fold(Isometry3::identity(), |chain, bone| chain * bone);
        let hand_from_wrist =
            Isometry3::from_parts(Translation3::identity(), hand_from_wrist(hand));
        Some(root_from_hand * hand_from_wrist)
    }

    /// What the sensors of a glove would read, degrees by slot; `None` without a finger.
    pub(super) fn degrees(&self, hand: Handedness) -> Option<[Option<f64>; GloveSensor::N_SLOTS]> {
        let links = self.links(hand);
        (!links.is_empty()).then(|| links.degrees(hand))
    }

    fn links(&self, hand: Handedness) -> HandLinks {
        let rotations = |finger: usize| {
            let from_wrist = hand_from_wrist(hand);
            let mut chain = UnitQuaternion::identity();
            let mut links = [UnitQuaternion::identity(); 3];
            for (link, place) in links.iter_mut().enumerate() {
                chain *= self.bones[link_slot(finger, link)]?.rotation;
                *place = from_wrist.inverse() * chain * from_wrist;
            }
            Some(links)
        };
        let finger = |finger: usize| {
            let links = rotations(finger)?;
            let sideways = links[0] * Vector3::x();
            Some((links.map(|link| link * -Vector3::z()), sideways))
        };
        let at_rest = thumb_at_rest(hand);
        HandLinks {
            thumb: rotations(0).map(|links| links.map(|link| link * at_rest)),
            fingers: [finger(1), finger(2), finger(3), finger(4)],
        }
    }
}

/// Direction of the thumb's links in T-pose, in the wrist's space: level, halfway between the fingers and forward.
pub(crate) fn thumb_at_rest(hand: Handedness) -> Vector3<f64> {
    let toward_thumb = match hand {
        Handedness::Left => Vector3::x(),
        Handedness::Right => -Vector3::x(),
    };
    (toward_thumb - Vector3::z()).normalize()
}
