//! (B): judgement segments on edges.

use nalgebra::Point3;

use super::{ContactScratch, ObjectSpace, Touch, known, misses};
use crate::frame::Feature;
use crate::hand::hand_state::HandState;
use crate::hand::part::JudgementPart;
use crate::polyhedron::Polyhedron;
use crate::query::segment::segment_cuts;
use crate::query::segment_sweep::sweep_segment;
use crate::state::HandId;

/// A segment whose ends move by no more than this against an object stands still, in metres: the rounding of a hand
/// that carries what it holds.
const STILL_M: f64 = 1.0e-12;

/// Appends a contact for each judgement segment and edge where the segment passes through the solid cutting the two
/// faces that share the edge, or crosses the edge inward on its way over the step (model §4).
pub(super) fn find(
    hand: &HandState,
    shape: &Polyhedron,
    [before_space, now_space]: &[ObjectSpace; 2],
    last: &[Touch],
    scratch: &mut ContactScratch,
    touches: &mut Vec<Touch>,
) {
    let around = shape.aabb();
    for (index, now, before) in hand.moving_segments() {
        let from = [before_space.map(&before[0]), before_space.map(&before[1])];
        let to = [now_space.map(&now[0]), now_space.map(&now[1])];
        if misses(around, [&from[0], &from[1], &to[0], &to[1]], 0.0) {
            continue;
        }
        let part = JudgementPart::Segment(index);
        one_segment(shape, (hand.id, part), [&from, &to], last, scratch, touches);
    }
}

fn one_segment(
    shape: &Polyhedron,
    (hand, part): (HandId, JudgementPart),
    [from, to]: [&[Point3<f64>; 2]; 2],
    last: &[Touch],
    scratch: &mut ContactScratch,
    touches: &mut Vec<Touch>,
) {
    scratch.cuts.clear();
    scratch.crossings.clear();
    segment_cuts(shape, &to[0], &to[1], &mut scratch.cuts);
    let all_known = !scratch.cuts.is_empty()
        && scratch
            .cuts
            .iter()
            .all(|cut| known(last, hand, part, Some(Feature::Edge(cut.edge))).is_some());
    // A segment that stands still against the object, as that of a steady grip, crosses nothing.
    let moves = from
        .iter()
        .zip(to)
        .any(|(a, b)| (b - a).norm_squared() > STILL_M * STILL_M);
    if moves && !all_known {
        sweep_segment(shape, *from, *to, &mut scratch.crossings);
    }
    let touch = |edge: u32, fraction: f64, start: Point3<f64>| Touch {
        hand,
        part,
        feature: Feature::Edge(edge),
        point: start,
        motion: along(to, fraction) - start,
        normal: shape.edges()[edge as usize].pseudo_normal,
        fraction,
    };
    for cut in &scratch.cuts {
        // An edge crossed in this step was entered there; one already known moves with the segment's own matter.
        let crossing = scratch
            .crossings
            .iter()
            .find(|crossing| crossing.edge == cut.edge);
        touches.push(match crossing {
            Some(crossing) => touch(cut.edge, crossing.on_segment, crossing.on_edge),
            None => touch(cut.edge, cut.on_segment, along(from, cut.on_segment)),
        });
    }
    for crossing in &scratch.crossings {
        let cut_too = scratch.cuts.iter().any(|cut| cut.edge == crossing.edge);
        if !cut_too {
            touches.push(touch(crossing.edge, crossing.on_segment, crossing.on_edge));
        }
    }
}

/// The point of a segment at a fraction of its length.
fn along(segment: &[Point3<f64>; 2], fraction: f64) -> Point3<f64> {
    segment[0] + (segment[1] - segment[0]) * fraction
}
