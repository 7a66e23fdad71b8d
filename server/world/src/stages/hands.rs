//! Stages 1 and 7: the hands take their samples; they are shown opened to what they hold.

use crate::frame::{Event, EventKind, Tracking};
use crate::hand::joint::N_FINGERS;
use crate::hand::part::PartLayout;
use crate::hand::show::{Held, show as show_hand};
use crate::input::HandInput;
use crate::state::ContactState;
use crate::step::Stage;

/// Each hand takes its sample of this step, or none; the boxes that they sweep are kept for the broad phase.
pub(crate) fn advance(stage: &mut Stage<'_>, inputs: &[HandInput]) {
    let grace_steps = stage.scene.grace_steps();
    stage.scratch.swept.clear();
    for hand in &mut stage.state.hands {
        // Two samples for one hand: the later one counts.
        let sample = inputs
            .iter()
            .rev()
            .find(|input| input.hand == hand.id)
            .and_then(|input| input.sample.as_ref());
        let was = hand.advance(sample, grace_steps);
        let kind = match (was, hand.tracking) {
            (Tracking::Never | Tracking::Lost, Tracking::Tracked) => Some(EventKind::HandFound),
            (Tracking::Tracked | Tracking::Held, Tracking::Lost) => Some(EventKind::HandLost),
            _ => None,
        };
        if let Some(kind) = kind {
            stage.frame.events.push(Event {
                object: None,
                hand: Some(hand.id),
                kind,
            });
        }
        stage.scratch.swept.push(hand.swept());
    }
}

/// Corrects the fingers of grasping hands to the surface.
pub(crate) fn show(stage: &mut Stage<'_>) {
    let mut hands = std::mem::take(&mut stage.state.hands);
    for hand in &mut hands {
        let layout = PartLayout::of(&hand.model);
        let mut touching = [false; N_FINGERS];
        let mut held: [Option<Held<'_>>; N_FINGERS] = [None; N_FINGERS];
        let mut n_held = 0;
        for found in &stage.scratch.found {
            let Some(body) = stage.state.body(found.slot) else {
                continue;
            };
            let own = body.touches.iter().filter(|touch| touch.hand == hand.id);
            let mut touches = false;
            for finger in own.filter_map(|touch| layout.finger(touch.part)) {
                touching[finger.index()] = true;
                touches = true;
            }
            if touches && body.contact == ContactState::Grasped && n_held < held.len() {
                held[n_held] = Some(Held::new(hand, &body.spec.shape, &body.pose));
                n_held += 1;
            }
        }
        show_hand(hand, touching, &held);
    }
    stage.state.hands = hands;
}
