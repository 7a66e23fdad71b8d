//! What the world does to the fingers in a glove.
//!
//! A finger that touches something is kept from bending further into it, for as long as it touches: that is a grasp's
//! end as well as a push's. The tick tells the glove's thread when that changes, and now and then that it still holds;
//! it never waits, and a glove that is not told any more frees the fingers by itself.

use std::sync::{Mutex, PoisonError};

use tsukamu_devices::feedback::{FORCES_LAST_NS, Feedback, Vibration};
use tsukamu_devices::port_thread::SessionHandle;
use tsukamu_world::hand::joint::N_FINGERS;
use tsukamu_world::hand::part::PartLayout;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::step::HandTouch;

/// How often a glove is told that its forces still hold, nanoseconds; often enough that one time may be missed.
const REFRESH_NS: u64 = FORCES_LAST_NS / 4;
/// Vibration at the moment of a touch, Hz: the skin feels about this frequency best.
const TOUCH_FREQUENCY_HZ: f64 = 200.0;
/// How long it lasts, seconds.
const TOUCH_DURATION_S: f64 = 0.05;

/// The way from a hand in the world to the fingers in its glove.
#[derive(Debug)]
pub struct Feel {
    /// Share of the glove's full force, 0 to 1.
    strength: f64,
    glove: SessionHandle,
    told: Mutex<Told>,
}

/// What the glove was told.
#[derive(Clone, Copy, Debug, Default)]
struct Told {
    touching: [bool; N_FINGERS],
    at_ns: u64,
}

impl Feel {
    /// To a glove that has been told nothing yet, at a share of its full force from 0 to 1.
    pub fn new(strength: f64, glove: SessionHandle) -> Self {
        Self {
            strength,
            glove,
            told: Mutex::default(),
        }
    }

    /// Says which fingers touch something after a step, at a monotonic time in nanoseconds. Only the tick calls it.
    pub fn tell(&self, now_ns: u64, touching: [bool; N_FINGERS]) {
        // Nobody else locks it; a panic leaves two whole values.
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let is_free = touching == [false; N_FINGERS];
        let is_fresh = is_free || now_ns.saturating_sub(told.at_ns) < REFRESH_NS;
        if touching == told.touching && is_fresh {
            return;
        }
        let begins = touching
            .iter()
            .zip(told.touching)
            .any(|(now, before)| *now && !before);
        let feedback = Feedback {
            resistance: touching.map(|touches| if touches { self.strength } else { 0.0 }),
            vibration: begins.then_some(Vibration {
                frequency_hz: TOUCH_FREQUENCY_HZ,
                duration_s: TOUCH_DURATION_S,
                amplitude: self.strength,
            }),
        };
        // Where the glove's thread is just reading, the next step says it.
        if self.glove.try_set_feedback(feedback) {
            *told = Told {
                touching,
                at_ns: now_ns,
            };
        }
    }
}

/// The fingers that touch something: with a joint, or with any edge of a link. The palm is none.
pub fn fingers_of(model: &HandModel, touches: &[HandTouch]) -> [bool; N_FINGERS] {
    let layout = PartLayout::of(model);
    let mut touching = [false; N_FINGERS];
    for finger in touches.iter().filter_map(|touch| layout.finger(touch.part)) {
        touching[finger.index()] = true;
    }
    touching
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};
    use tsukamu_world::frame::Feature;
    use tsukamu_world::hand::joint::{Finger, Side};
    use tsukamu_world::hand::part::JudgementPart;
    use tsukamu_world::state::ObjectId;

    use super::*;

    fn touch(part: JudgementPart) -> HandTouch {
        HandTouch {
            object: ObjectId {
                slot: 0,
                generation: 0,
            },
            part,
            feature: Feature::Face(0),
            point: Point3::origin(),
            normal: Vector3::x(),
        }
    }

    #[test]
    fn points_and_edges_belong_to_fingers_and_the_palm_to_none() {
        let model = HandModel {
            palm_contacts: true,
            ..HandModel::adult(Side::Right)
        };
        let layout = PartLayout::of(&model);
        let point = |index: usize| JudgementPart::Point(index as u16);
        let edge = |index: usize| JudgementPart::Segment(index as u16);
        let little = layout.segments_of(Finger::Little).start;
        let cases = [
            (vec![], [false; N_FINGERS]),
            (
                vec![point(layout.points_of(Finger::Thumb).end - 1), edge(little)],
                [true, false, false, false, true],
            ),
            (
                vec![
                    point(layout.points_of(Finger::Middle).start),
                    point(layout.n_points() - 1),
                    edge(layout.n_segments() - 1),
                ],
                [false, false, true, false, false],
            ),
        ];
        for (parts, expected) in cases {
            let touches: Vec<HandTouch> = parts.into_iter().map(touch).collect();
            assert_eq!(fingers_of(&model, &touches), expected, "{touches:?}");
        }
    }
}
