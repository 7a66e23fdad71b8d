//! The frame: what changed, where the hands are.

use crate::frame::HandFrame;
use crate::hand::joint::JointId;
use crate::state::ContactState;
use crate::step::Stage;

/// Fills the frame from the state.
pub(crate) fn publish(stage: &mut Stage<'_>) {
    stage.scratch.changed.sort_unstable();
    stage.scratch.changed.dedup();
    stage.frame.changed.clear();
    let (state, frame) = (&*stage.state, &mut *stage.frame);
    let there = stage
        .scratch
        .changed
        .iter()
        .filter(|slot| state.body(**slot).is_some());
    frame.changed.extend(there.map(|slot| state.id(*slot)));
    stage.scratch.changed.clear();
    frame.hands.clear();
    for hand in &state.hands {
        let valid = |joint: JointId| {
            hand.posed
                .point_valid
                .get(joint.index())
                .copied()
                .unwrap_or(false)
        };
        let joints = |places: &[nalgebra::Point3<f64>]| {
            std::array::from_fn(|index| {
                JointId::from_index(index)
                    .filter(|joint| valid(*joint))
                    .map(|joint| places[joint.index()])
            })
        };
        let holds = stage
            .scratch
            .found
            .iter()
            .map(|found| found.slot)
            .find(|slot| {
                state.body(*slot).is_some_and(|body| {
                    body.contact == ContactState::Grasped
                        && body.touches.iter().any(|touch| touch.hand == hand.id)
                })
            });
        frame.hands.push(HandFrame {
            hand: hand.id,
            side: hand.model.side,
            tracking: hand.tracking,
            wrist: *hand.wrist(),
            tracked: joints(&hand.posed.points),
            shown: joints(&hand.shown),
            holds: holds.map(|slot| state.id(slot)),
        });
    }
}
