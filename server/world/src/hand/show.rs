//! The shown hand: the fingers of a grasping hand, opened to the surface of what they hold (model §9).

use nalgebra::{Isometry3, Point3};

use super::hand_state::HandState;
use super::joint::{Finger, JointId, N_FINGERS, POINTS_PER_FINGER};
use super::judgement::finger_ridges;
use super::retract::{FingerLinks, OpeningPath, retract_finger};
use crate::polyhedron::Polyhedron;
use crate::query::point::signed_distance;
use crate::query::segment_depth::max_depth_on_segment;

/// Something that a hand holds.
#[derive(Clone, Copy, Debug)]
pub struct Held<'a> {
    /// Its solid.
    pub shape: &'a Polyhedron,
    /// `world_from_object`.
    pub pose: Isometry3<f64>,
}

/// Sets the shown joints of a hand. `touching` tells which fingers touch anything, `held` what the hand holds.
///
/// A finger keeps, from its first touch to its last, the way back to the pose in which it touched first.
pub fn show(hand: &mut HandState, touching: [bool; N_FINGERS], held: &[Option<Held<'_>>]) {
    for joint in JointId::all() {
        if let Some(point) = hand.posed.points.get(joint.index()) {
            hand.shown[joint.index()] = *point;
        }
    }
    for finger in Finger::ALL {
        if !touching[finger.index()] {
            hand.openings[finger.index()] = super::hand_state::Opening::default();
            continue;
        }
        let Some(tracked) = hand.links(finger) else {
            continue;
        };
        let touched = hand
            .links_before(finger)
            .map_or(tracked.directions, |links| links.directions);
        let path = *hand.openings[finger.index()]
            .path
            .get_or_insert_with(|| OpeningPath::new(&hand.model, finger, touched));
        if held.iter().any(Option::is_some) {
            open(hand, finger, &tracked, &path, held);
        }
    }
}

fn open(
    hand: &mut HandState,
    finger: Finger,
    tracked: &FingerLinks,
    path: &OpeningPath,
    held: &[Option<Held<'_>>],
) {
    let wrist = *hand.wrist();
    let last = hand.openings[finger.index()].opening;
    let model = &hand.model;
    let mut depth = |points: &[Point3<f64>; POINTS_PER_FINGER]| {
        held.iter()
            .flatten()
            .map(|held| depth_in(model, &wrist, finger, points, held))
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let found = retract_finger(tracked, path, last, &mut depth);
    hand.openings[finger.index()].opening = found.opening;
    if found.opening > 0.0 {
        let start = JointId::of(finger, 0).index();
        for (shown, point) in hand.shown[start..].iter_mut().zip(found.points) {
            *shown = wrist * point;
        }
    }
}

/// How deep a finger with these joints (wrist space) is inside the object: points and ridges, metres.
fn depth_in(
    model: &super::skeleton::HandModel,
    world_from_wrist: &Isometry3<f64>,
    finger: Finger,
    points: &[Point3<f64>; POINTS_PER_FINGER],
    held: &Held<'_>,
) -> f64 {
    let object_from_wrist = held.pose.inv_mul(world_from_wrist);
    let points = points.map(|p| object_from_wrist * p);
    let reach = held.shape.bounding_radius() + model.skeleton.finger(finger).radii[0];
    if points
        .windows(2)
        .all(|ends| is_far(&ends[0], &ends[1], reach))
    {
        return f64::NEG_INFINITY;
    }
    let inside = points
        .iter()
        .map(|p| model.point_radius - signed_distance(held.shape, p).distance);
    let mut deepest = inside.fold(f64::NEG_INFINITY, f64::max);
    finger_ridges(
        model,
        &object_from_wrist.rotation,
        finger,
        &points,
        |[a, b]| {
            if !is_far(&a, &b, held.shape.bounding_radius()) {
                deepest = deepest.max(max_depth_on_segment(held.shape, &a, &b));
            }
        },
    );
    deepest
}

/// Whether the segment stays farther than `reach` from the origin.
fn is_far(a: &Point3<f64>, b: &Point3<f64>, reach: f64) -> bool {
    let along = b - a;
    let share =
        (-a.coords.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (a.coords + along * share).norm_squared() > reach * reach
}
