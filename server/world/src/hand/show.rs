//! The shown hand: the fingers of a grasping hand, opened to the surface of what they hold (model §9).

use nalgebra::{Isometry3, Point3};

use super::hand_state::{HandState, Opening};
use super::joint::{Finger, JointId, N_FINGERS, POINTS_PER_FINGER};
use super::prism::PrismAxes;
use super::retract::{DEPTH_TOLERANCE, FingerLinks, OpeningPath, retract_finger};
use super::skeleton::HandModel;
use crate::polyhedron::Polyhedron;
use crate::polyhedron::aabb::Aabb;
use crate::query::point::{is_deeper, signed_distance};
use crate::query::segment_depth::max_depth_above;

/// Something that a hand holds, as seen from its wrist.
#[derive(Clone, Copy, Debug)]
pub struct Held<'a> {
    shape: &'a Polyhedron,
    object_from_wrist: Isometry3<f64>,
    axes: PrismAxes,
}

impl<'a> Held<'a> {
    /// An object of that shape and pose (`world_from_object`), held by that hand.
    pub fn new(hand: &HandState, shape: &'a Polyhedron, pose: &Isometry3<f64>) -> Self {
        let object_from_wrist = pose.inv_mul(hand.wrist());
        let axes = PrismAxes::new(
            hand.model.side,
            &object_from_wrist.rotation,
            hand.model.prism_sides,
        );
        Self {
            shape,
            object_from_wrist,
            axes,
        }
    }

    /// How deep a finger with these joints (wrist space) is inside: points and ridges, metres; 0 outside.
    fn depth(
        &self,
        model: &HandModel,
        finger: Finger,
        points: &[Point3<f64>; POINTS_PER_FINGER],
    ) -> f64 {
        let radii = &model.skeleton.finger(finger).radii;
        let points = points.map(|p| self.object_from_wrist * p);
        let reach = self.shape.bounding_radius();
        if points
            .windows(2)
            .all(|ends| is_far(&ends[0], &ends[1], reach + radii[0]))
        {
            return 0.0;
        }
        let thickest = radii
            .iter()
            .fold(model.point_radius, |most, r| most.max(*r));
        if !Aabb::of(points).grown(thickest).meets(self.shape.aabb()) {
            return 0.0;
        }
        let mut deepest = 0.0_f64;
        for point in &points {
            // Its own distance is asked for only where it can be the deepest.
            if model.point_radius > 0.0 || is_deeper(self.shape, point, deepest) {
                let depth = model.point_radius - signed_distance(self.shape, point).distance;
                deepest = deepest.max(depth);
            }
        }
        self.axes.finger_ridges(finger, &points, radii, |[a, b]| {
            if !is_far(&a, &b, reach) {
                deepest = max_depth_above(self.shape, &a, &b, deepest);
            }
        });
        deepest
    }
}

/// Sets the shown joints of a hand. `touching` tells which fingers touch anything, `held` what the hand holds.
///
/// A finger keeps, from its first touch to its last, the way back to the pose in which it touched first. One that
/// goes right through what the others hold touches nothing by the rules of contact, and is opened all the same.
pub fn show(hand: &mut HandState, touching: [bool; N_FINGERS], held: &[Option<Held<'_>>]) {
    for joint in JointId::all() {
        if let Some(point) = hand.posed.points.get(joint.index()) {
            hand.shown[joint.index()] = *point;
        }
    }
    for finger in Finger::ALL {
        let is_holding = held.iter().any(Option::is_some);
        let touches = touching[finger.index()];
        let tracked = (touches || is_holding)
            .then(|| hand.links(finger))
            .flatten();
        let Some(tracked) = tracked.filter(|links| touches || is_inside(hand, finger, links, held))
        else {
            if !touches {
                hand.openings[finger.index()] = Opening::default();
            }
            continue;
        };
        let known = hand.openings[finger.index()].path;
        let path = known.unwrap_or_else(|| {
            let before = hand.links_before(finger).unwrap_or(tracked);
            OpeningPath::new(&hand.model, finger, before.directions)
        });
        hand.openings[finger.index()].path = Some(path);
        if is_holding {
            open(hand, finger, &tracked, &path, held);
        }
    }
}

/// Whether a finger is deeper in anything that is held than on its surface.
fn is_inside(
    hand: &HandState,
    finger: Finger,
    tracked: &FingerLinks,
    held: &[Option<Held<'_>>],
) -> bool {
    let points = tracked.points();
    let depth = |held: &Held<'_>| held.depth(&hand.model, finger, &points);
    held.iter()
        .flatten()
        .any(|held| depth(held) > DEPTH_TOLERANCE)
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
        let depths = held
            .iter()
            .flatten()
            .map(|held| held.depth(model, finger, points));
        depths.fold(0.0, f64::max)
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

/// Whether the segment stays farther than `reach` from the origin.
fn is_far(a: &Point3<f64>, b: &Point3<f64>, reach: f64) -> bool {
    let along = b - a;
    let share =
        (-a.coords.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (a.coords + along * share).norm_squared() > reach * reach
}
