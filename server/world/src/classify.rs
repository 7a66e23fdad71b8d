//! From the contacts of one object to free, pushed or grasped (model §5.2).

use nalgebra::Vector3;

use crate::contact::Touch;
use crate::frame::GraspNormal;
use crate::state::HandId;

/// How far below the cosine of the grasp angle a cosine may be missed and still count, so that exactly 90° does.
/// About 6e-8 degrees at 90°.
const COSINE_TOLERANCE: f64 = 1.0e-9;

/// What the contacts of one object amount to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Verdict {
    /// Nothing presses on it.
    Free,
    /// One contact presses: the index of the touch.
    PushedAtOne(usize),
    /// Several contacts press, and make no grasp.
    PushedAtSeveral,
    /// Two normals are at least the grasp angle apart.
    Grasped(GraspPair),
}

/// The pair of normals with the largest angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GraspPair {
    /// The two.
    pub(crate) normals: [GraspNormal; 2],
    /// Cosine of their angle.
    pub(crate) cosine: f64,
}

impl GraspPair {
    /// Their angle in radians.
    pub(crate) fn angle(&self) -> f64 {
        libm::acos(self.cosine.clamp(-1.0, 1.0))
    }

    /// Whether the pair makes a grasp at that threshold (radians).
    pub(crate) fn holds_at(&self, threshold: f64) -> bool {
        self.cosine <= libm::cos(threshold) + COSINE_TOLERANCE
    }
}

/// What the touches amount to at a grasp angle in radians. A grasp counts every touch; a push only those that press.
pub(crate) fn classify(touches: &[Touch], grasp_angle: f64) -> Verdict {
    match widest_pair(touches, None) {
        Some(pair) if pair.holds_at(grasp_angle) => Verdict::Grasped(pair),
        _ => classify_push(touches),
    }
}

/// The same without the grasp test.
pub(crate) fn classify_push(touches: &[Touch]) -> Verdict {
    let mut pressing = touches
        .iter()
        .enumerate()
        .filter(|(_, touch)| touch.presses());
    match (pressing.next(), pressing.next()) {
        (None, _) => Verdict::Free,
        (Some((index, _)), None) => Verdict::PushedAtOne(index),
        _ => Verdict::PushedAtSeveral,
    }
}

/// The two touches, of `hand` alone if one is named, whose normals make the largest angle; ties go to the first pair.
pub(crate) fn widest_pair(touches: &[Touch], hand: Option<HandId>) -> Option<GraspPair> {
    let mut widest: Option<GraspPair> = None;
    for (index, first) in touches.iter().enumerate() {
        if hand.is_some_and(|hand| first.hand != hand) {
            continue;
        }
        // Several touches of one feature have one normal.
        let seen = touches[..index].iter().any(|other| {
            other.feature == first.feature && hand.is_none_or(|hand| other.hand == hand)
        });
        if seen {
            continue;
        }
        for second in &touches[index + 1..] {
            if hand.is_some_and(|hand| second.hand != hand) || second.feature == first.feature {
                continue;
            }
            let cosine = first.normal.dot(&second.normal);
            if widest.as_ref().is_none_or(|pair| cosine < pair.cosine) {
                widest = Some(GraspPair {
                    normals: [grasp_normal(first), grasp_normal(second)],
                    cosine,
                });
            }
        }
    }
    widest
}

fn grasp_normal(touch: &Touch) -> GraspNormal {
    GraspNormal {
        hand: touch.hand,
        part: touch.part,
        feature: touch.feature,
        normal: touch.normal,
    }
}

/// The mean motion of the pressing touches, in the object's space: what an object pushed at several points follows.
pub(crate) fn mean_motion(touches: &[Touch]) -> Vector3<f64> {
    let pressing = touches.iter().filter(|touch| touch.presses());
    let (sum, n) = pressing.fold((Vector3::zeros(), 0_u32), |(sum, n), touch| {
        (sum + touch.motion, n + 1)
    });
    if n == 0 { sum } else { sum / f64::from(n) }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::frame::Feature;
    use crate::hand::part::JudgementPart;

    fn touch(part: u16, feature: u32, normal: [f64; 3], motion: [f64; 3]) -> Touch {
        Touch {
            hand: HandId(1),
            part: JudgementPart::Point(part),
            feature: Feature::Face(feature),
            point: Point3::origin(),
            motion: motion.into(),
            normal: normal.into(),
            fraction: 0.0,
        }
    }

    fn check(touches: &[Touch], degrees: f64, expected: &str) {
        let verdict = match classify(touches, f64::to_radians(degrees)) {
            Verdict::Free => "free".to_owned(),
            Verdict::PushedAtOne(index) => format!("push-1 by {index}"),
            Verdict::PushedAtSeveral => "push-n".to_owned(),
            Verdict::Grasped(pair) => format!("grasped at {:.0}", pair.angle().to_degrees()),
        };
        assert_eq!(verdict, expected);
    }

    #[test]
    fn number_and_normals_of_the_contacts_decide() {
        let left = touch(3, 0, [-1.0, 0.0, 0.0], [0.001, 0.0, 0.0]);
        let left_too = touch(7, 0, [-1.0, 0.0, 0.0], [0.001, 0.0, 0.0]);
        let right = touch(11, 1, [1.0, 0.0, 0.0], [-0.001, 0.0, 0.0]);
        let top = touch(15, 2, [0.0, 1.0, 0.0], [0.0, -0.001, 0.0]);
        let leaving = touch(3, 0, [-1.0, 0.0, 0.0], [-0.001, 0.0, 0.0]);
        check(&[], 90.0, "free");
        check(std::slice::from_ref(&left), 90.0, "push-1 by 0");
        check(&[left.clone(), left_too.clone()], 90.0, "push-n");
        check(&[left.clone(), right.clone()], 90.0, "grasped at 180");
        // Exactly 90° counts: two neighbouring faces of a cube do hold it.
        check(&[left.clone(), top.clone()], 90.0, "grasped at 90");
        check(&[left.clone(), top.clone()], 91.0, "push-n");
        // A finger that leaves pushes nothing, but holds as long as it is inside.
        check(std::slice::from_ref(&leaving), 90.0, "free");
        check(&[leaving.clone(), left_too], 120.0, "push-1 by 1");
        check(&[leaving, right], 90.0, "grasped at 180");
    }

    #[test]
    fn only_pressing_contacts_carry() {
        let press = touch(3, 0, [-1.0, 0.0, 0.0], [0.002, 0.0, 0.0]);
        let leave = touch(7, 0, [-1.0, 0.0, 0.0], [-0.1, 0.0, 0.0]);
        assert_eq!(mean_motion(&[press, leave]), Vector3::new(0.002, 0.0, 0.0));
        assert_eq!(mean_motion(&[]), Vector3::zeros());
    }
}
