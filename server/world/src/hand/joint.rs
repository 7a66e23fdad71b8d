//! The names of a hand's parts: sides, fingers and the twenty joints that are judgement points.

use serde::{Deserialize, Serialize};

/// Which hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Side {
    /// The left hand.
    Left,
    /// The right hand.
    Right,
}

impl Side {
    /// `left` or `right`, as in files and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// One of the five fingers, thumb first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Finger {
    /// The thumb.
    Thumb,
    /// The index finger.
    Index,
    /// The middle finger.
    Middle,
    /// The ring finger.
    Ring,
    /// The little finger.
    Little,
}

/// Number of fingers.
pub const N_FINGERS: usize = 5;
/// Judgement points of one finger: its tip and its three joints.
pub const POINTS_PER_FINGER: usize = 4;
/// Links of one finger, each between two neighbouring judgement points.
pub const LINKS_PER_FINGER: usize = 3;
/// Judgement points of a hand (Funahashi et al. 1998, §5.2, experiment 3).
pub const N_JOINTS: usize = N_FINGERS * POINTS_PER_FINGER;

impl Finger {
    /// All fingers, in index order.
    pub const ALL: [Self; N_FINGERS] = [
        Self::Thumb,
        Self::Index,
        Self::Middle,
        Self::Ring,
        Self::Little,
    ];

    /// 0 for the thumb to 4 for the little finger.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The name in files and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Thumb => "thumb",
            Self::Index => "index",
            Self::Middle => "middle",
            Self::Ring => "ring",
            Self::Little => "little",
        }
    }
}

/// One of the twenty joints (judgement points): finger by finger, from the palm to the tip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JointId(u8);

/// The OpenXR names (`XR_EXT_hand_tracking`) of the twenty joints, in index order.
pub const JOINT_NAMES: [&str; N_JOINTS] = [
    "thumb_metacarpal",
    "thumb_proximal",
    "thumb_distal",
    "thumb_tip",
    "index_proximal",
    "index_intermediate",
    "index_distal",
    "index_tip",
    "middle_proximal",
    "middle_intermediate",
    "middle_distal",
    "middle_tip",
    "ring_proximal",
    "ring_intermediate",
    "ring_distal",
    "ring_tip",
    "little_proximal",
    "little_intermediate",
    "little_distal",
    "little_tip",
];

impl JointId {
    /// The joint with this index, or `None` at [`N_JOINTS`] and above.
    pub const fn from_index(index: usize) -> Option<Self> {
        if index < N_JOINTS {
            Some(Self(index as u8))
        } else {
            None
        }
    }

    /// The joint of `finger` counted from the palm (0) to the tip (3); larger counts give the tip.
    pub const fn of(finger: Finger, from_palm: usize) -> Self {
        let step = if from_palm < POINTS_PER_FINGER {
            from_palm
        } else {
            POINTS_PER_FINGER - 1
        };
        Self((finger.index() * POINTS_PER_FINGER + step) as u8)
    }

    /// All joints, in index order.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..N_JOINTS as u8).map(Self)
    }

    /// 0 to 19.
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// The finger it belongs to.
    pub const fn finger(self) -> Finger {
        Finger::ALL[self.index() / POINTS_PER_FINGER]
    }

    /// The OpenXR name, e.g. `index_tip`.
    pub const fn name(self) -> &'static str {
        JOINT_NAMES[self.index()]
    }
}
