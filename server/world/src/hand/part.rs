//! The order and the names of a hand's judgement points and segments.
//!
//! Points: the twenty joints in [`JointId`] order; with palm contacts then, for each finger but the thumb, two points
//! along its metacarpal. Segments: finger by finger, link by link from the palm, ridge by ridge; with palm contacts
//! then the ridges of the four metacarpals.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::joint::{
    Finger, JOINT_NAMES, JointId, LINKS_PER_FINGER, N_FINGERS, N_JOINTS, POINTS_PER_FINGER,
};
use super::skeleton::HandModel;

/// One judgement point or segment of a hand, by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum JudgementPart {
    /// Index into [`super::judgement::PosedHand::points`].
    Point(u16),
    /// Index into [`super::judgement::PosedHand::segments`].
    Segment(u16),
}

/// How many judgement parts a hand has and where each belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartLayout {
    /// Ridges per prism.
    prism_sides: usize,
    /// Whether the palm's parts follow the fingers'.
    palm: bool,
}

/// Where a judgement point or segment sits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartPlace {
    /// A joint of a finger.
    Joint(JointId),
    /// A ridge of a link of a finger.
    Ridge {
        /// The finger.
        finger: Finger,
        /// The link, 0 nearest the palm.
        link: usize,
        /// The ridge; 0 is on the palmar side.
        ridge: usize,
    },
    /// A point in the palm, along a finger's metacarpal.
    PalmPoint {
        /// The finger whose metacarpal it is.
        finger: Finger,
        /// 0 nearer the wrist, 1 nearer the knuckle.
        step: usize,
    },
    /// A ridge of a metacarpal in the palm.
    PalmRidge {
        /// The finger whose metacarpal it is.
        finger: Finger,
        /// The ridge; 0 is on the palmar side.
        ridge: usize,
    },
}

/// Metacarpals in the palm: those of all fingers but the thumb.
pub const N_METACARPALS: usize = N_FINGERS - 1;
/// Palm points along each metacarpal.
pub const POINTS_PER_METACARPAL: usize = 2;
/// Links of all fingers.
pub const N_LINKS: usize = N_FINGERS * LINKS_PER_FINGER;

impl PartLayout {
    /// The layout of a valid hand model.
    pub fn of(model: &HandModel) -> Self {
        Self {
            prism_sides: model.prism_sides as usize,
            palm: model.palm_contacts,
        }
    }

    /// Number of judgement points.
    pub const fn n_points(self) -> usize {
        N_JOINTS
            + if self.palm {
                N_METACARPALS * POINTS_PER_METACARPAL
            } else {
                0
            }
    }

    /// Number of judgement segments.
    pub const fn n_segments(self) -> usize {
        self.prism_sides * (N_LINKS + if self.palm { N_METACARPALS } else { 0 })
    }

    /// Ridges per prism.
    pub const fn prism_sides(self) -> usize {
        self.prism_sides
    }

    /// Indices of a finger's four judgement points.
    pub const fn points_of(self, finger: Finger) -> std::ops::Range<usize> {
        let start = finger.index() * POINTS_PER_FINGER;
        start..start + POINTS_PER_FINGER
    }

    /// Indices of a finger's judgement segments, without the palm's.
    pub const fn segments_of(self, finger: Finger) -> std::ops::Range<usize> {
        let n = LINKS_PER_FINGER * self.prism_sides;
        finger.index() * n..(finger.index() + 1) * n
    }

    /// Where a part sits, or `None` beyond the last.
    pub fn place(self, part: JudgementPart) -> Option<PartPlace> {
        match part {
            JudgementPart::Point(index) => self.point_place(usize::from(index)),
            JudgementPart::Segment(index) => self.segment_place(usize::from(index)),
        }
    }

    /// The finger that owns a part; `None` for the palm's and beyond the last.
    pub fn finger(self, part: JudgementPart) -> Option<Finger> {
        self.place(part).and_then(PartPlace::finger)
    }

    fn point_place(self, index: usize) -> Option<PartPlace> {
        if let Some(joint) = JointId::from_index(index) {
            return Some(PartPlace::Joint(joint));
        }
        let palm = index - N_JOINTS;
        (index < self.n_points()).then(|| PartPlace::PalmPoint {
            finger: Finger::ALL[1 + palm / POINTS_PER_METACARPAL],
            step: palm % POINTS_PER_METACARPAL,
        })
    }

    fn segment_place(self, index: usize) -> Option<PartPlace> {
        if index >= self.n_segments() {
            return None;
        }
        let (prism, ridge) = (index / self.prism_sides, index % self.prism_sides);
        Some(if prism < N_LINKS {
            PartPlace::Ridge {
                finger: Finger::ALL[prism / LINKS_PER_FINGER],
                link: prism % LINKS_PER_FINGER,
                ridge,
            }
        } else {
            PartPlace::PalmRidge {
                finger: Finger::ALL[1 + prism - N_LINKS],
                ridge,
            }
        })
    }
}

impl PartPlace {
    /// The finger that owns it; `None` for the palm's.
    pub const fn finger(self) -> Option<Finger> {
        match self {
            Self::Joint(joint) => Some(joint.finger()),
            Self::Ridge { finger, .. } => Some(finger),
            Self::PalmPoint { .. } | Self::PalmRidge { .. } => None,
        }
    }
}

/// `index_tip`, `index_distal_link ridge 2`, `palm_index_metacarpal point 0`, `palm_index_metacarpal ridge 2`.
/// A link is named for the joint at its end nearest the palm.
impl fmt::Display for PartPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Joint(joint) => f.write_str(joint.name()),
            Self::Ridge {
                finger,
                link,
                ridge,
            } => {
                let joint = JOINT_NAMES[finger.index() * POINTS_PER_FINGER + link];
                write!(f, "{joint}_link ridge {ridge}")
            }
            Self::PalmPoint { finger, step } => {
                write!(f, "palm_{}_metacarpal point {step}", finger.name())
            }
            Self::PalmRidge { finger, ridge } => {
                write!(f, "palm_{}_metacarpal ridge {ridge}", finger.name())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand::joint::Side;

    fn layout(palm: bool) -> PartLayout {
        PartLayout::of(&HandModel {
            palm_contacts: palm,
            ..HandModel::adult(Side::Right)
        })
    }

    #[test]
    fn the_paper_has_twenty_points_and_sixty_segments() {
        assert_eq!(
            (layout(false).n_points(), layout(false).n_segments()),
            (20, 60)
        );
        assert_eq!(
            (layout(true).n_points(), layout(true).n_segments()),
            (28, 76)
        );
    }

    #[test]
    fn parts_have_readable_names() {
        let check = |part, name: &str| {
            let place = layout(true).place(part);
            assert_eq!(place.map(|p| p.to_string()).as_deref(), Some(name));
        };
        check(JudgementPart::Point(0), "thumb_metacarpal");
        check(JudgementPart::Point(7), "index_tip");
        check(JudgementPart::Segment(0), "thumb_metacarpal_link ridge 0");
        check(JudgementPart::Segment(22), "index_distal_link ridge 2");
        check(JudgementPart::Segment(59), "little_distal_link ridge 3");
        check(JudgementPart::Point(20), "palm_index_metacarpal point 0");
        check(JudgementPart::Point(27), "palm_little_metacarpal point 1");
        check(JudgementPart::Segment(60), "palm_index_metacarpal ridge 0");
        assert_eq!(layout(true).place(JudgementPart::Point(28)), None);
        assert_eq!(layout(false).place(JudgementPart::Point(20)), None);
        assert_eq!(layout(false).place(JudgementPart::Segment(60)), None);
        assert_eq!(
            layout(false).finger(JudgementPart::Segment(22)),
            Some(Finger::Index)
        );
        assert_eq!(layout(true).finger(JudgementPart::Point(20)), None);
    }

    #[test]
    fn ranges_agree_with_places() {
        let layout = layout(false);
        for finger in Finger::ALL {
            for index in layout.points_of(finger) {
                assert_eq!(
                    layout.finger(JudgementPart::Point(index as u16)),
                    Some(finger)
                );
            }
            for index in layout.segments_of(finger) {
                assert_eq!(
                    layout.finger(JudgementPart::Segment(index as u16)),
                    Some(finger)
                );
            }
        }
    }
}
