//! The bones of Unity's humanoid that lead to a hand and its fingers.

use crate::glove::calibrate::Handedness;

/// Bones between the avatar's root and its shoulders, from the root on, by name. The first two are in every avatar.
pub(crate) const TRUNK: [&str; 4] = ["Hips", "Spine", "Chest", "UpperChest"];
/// Bones of one side's arm, from the trunk on, by name without the side. The shoulder is not in every avatar.
pub(crate) const ARM: [&str; 4] = ["Shoulder", "UpperArm", "LowerArm", "Hand"];
/// Fingers by name, without side and link.
pub(crate) const FINGERS: [&str; 5] = ["Thumb", "Index", "Middle", "Ring", "Little"];
/// Links of a finger by name. The thumb's first is its metacarpal.
pub(crate) const LINKS: [&str; 3] = ["Proximal", "Intermediate", "Distal"];
/// Slots of one side: root, trunk, arm and fingers.
pub(crate) const N_SLOTS: usize = 1 + TRUNK.len() + ARM.len() + FINGERS.len() * LINKS.len();
/// The slot of the avatar's root.
pub(crate) const ROOT: usize = 0;
/// The first slot that is of one side alone.
pub(crate) const FIRST_OF_SIDE: usize = 1 + TRUNK.len();
/// The slot of the hand.
pub(crate) const HAND: usize = FIRST_OF_SIDE + ARM.len() - 1;

/// Slots that every avatar's chain from the root to the hand has: hips, spine, upper arm, lower arm, hand.
pub(crate) const WHOLE_CHAIN: [usize; 5] = [1, 2, HAND - 2, HAND - 1, HAND];

/// The slot of a finger's link, both from 0.
pub(crate) const fn link_slot(finger: usize, link: usize) -> usize {
    HAND + 1 + finger * LINKS.len() + link
}

/// Whose bone of that name it is, and its slot; `None` where it does not lead to a hand.
pub(crate) fn find(name: &str) -> Option<(Option<Handedness>, usize)> {
    if let Some(index) = TRUNK.iter().position(|bone| *bone == name) {
        return Some((None, 1 + index));
    }
    let (hand, rest) = match (name.strip_prefix("Left"), name.strip_prefix("Right")) {
        (Some(rest), _) => (Handedness::Left, rest),
        (_, Some(rest)) => (Handedness::Right, rest),
        _ => return None,
    };
    if let Some(index) = ARM.iter().position(|bone| *bone == rest) {
        return Some((Some(hand), FIRST_OF_SIDE + index));
    }
    FINGERS.iter().enumerate().find_map(|(finger, name)| {
        let link = rest.strip_prefix(name)?;
        let link = LINKS.iter().position(|known| *known == link)?;
        Some((Some(hand), link_slot(finger, link)))
    })
}

/// The name of a slot after the root, for emulators.
pub(crate) fn name(hand: Handedness, slot: usize) -> String {
    let side = match hand {
        Handedness::Left => "Left",
        Handedness::Right => "Right",
    };
    if slot < FIRST_OF_SIDE {
        TRUNK[slot - 1].to_owned()
    } else if slot <= HAND {
        format!("{side}{}", ARM[slot - FIRST_OF_SIDE])
    } else {
        let (finger, link) = (
            (slot - HAND - 1) / LINKS.len(),
            (slot - HAND - 1) % LINKS.len(),
        );
        format!("{side}{}{}", FINGERS[finger], LINKS[link])
    }
}

#[cfg(test)]
mod tests {
    use super::{FIRST_OF_SIDE, HAND, N_SLOTS, find, name};
    use crate::glove::calibrate::Handedness;

    #[test]
    fn every_slot_is_found_by_its_name() {
        for hand in [Handedness::Left, Handedness::Right] {
            for slot in 1..N_SLOTS {
                let whose = (slot >= FIRST_OF_SIDE).then_some(hand);
                assert_eq!(find(&name(hand, slot)), Some((whose, slot)));
            }
        }
        assert_eq!(name(Handedness::Left, HAND), "LeftHand");
        assert_eq!(name(Handedness::Right, N_SLOTS - 1), "RightLittleDistal");
        for other in [
            "Head",
            "LeftFoot",
            "LeftThumb",
            "Left",
            "",
            "leftHand",
            "LeftIndexTip",
        ] {
            assert_eq!(find(other), None, "{other}");
        }
    }
}
