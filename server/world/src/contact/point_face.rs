//! (A): judgement points on faces.

use nalgebra::Point3;

use super::{CLING_M, ObjectSpace, Touch, known, misses};
use crate::frame::Feature;
use crate::hand::hand_state::HandState;
use crate::hand::part::JudgementPart;
use crate::polyhedron::Polyhedron;
use crate::query::point::{signed_distance, sweep_point};

/// Appends a contact for each judgement point that is inside the solid or whose path over the step enters it.
///
/// On entering, the face is the one that the path crosses; while the point stays inside, the contact keeps it; a point
/// found inside with no history takes the face of least penetration depth (model §4).
pub(super) fn find(
    hand: &HandState,
    shape: &Polyhedron,
    [before_space, now_space]: &[ObjectSpace; 2],
    last: &[Touch],
    touches: &mut Vec<Touch>,
) {
    let radius = hand.model.point_radius;
    for (index, now, before) in hand.moving_points() {
        let from = before_space.map(before);
        let to = now_space.map(now);
        if misses(shape.aabb(), [&from, &to], radius + CLING_M) {
            continue;
        }
        let part = JudgementPart::Point(index);
        let kept = known(last, hand.id, part, None).map(|touch| touch.feature);
        let Some((face, start)) = contact(shape, &from, &to, radius, kept) else {
            continue;
        };
        let normal = shape.faces()[face as usize].normal;
        touches.push(Touch {
            hand: hand.id,
            part,
            feature: Feature::Face(face),
            point: start - normal * radius,
            motion: to - start,
            normal,
            fraction: 0.0,
        });
    }
}

/// The face touched, and where the judgement point was when its motion in contact began; it moves from `from` to `to`
/// (object space) and has a radius, in metres.
fn contact(
    shape: &Polyhedron,
    from: &Point3<f64>,
    to: &Point3<f64>,
    radius: f64,
    kept: Option<Feature>,
) -> Option<(u32, Point3<f64>)> {
    if let Some(Feature::Face(face)) = kept
        && signed_distance(shape, to).distance <= radius + CLING_M
    {
        return Some((face, *from));
    }
    if let Some(entry) = sweep_point(shape, from, to, radius) {
        let start = if radius > 0.0 {
            from + (to - from) * entry.fraction
        } else {
            entry.point
        };
        return Some((entry.face, start));
    }
    // No entry: the point was inside before without being known (a hand that came up inside, an object set back).
    let depth = signed_distance(shape, to);
    let was_inside = || signed_distance(shape, from).distance < radius;
    (kept.is_none() && depth.distance < radius && was_inside()).then_some((depth.face, *from))
}
