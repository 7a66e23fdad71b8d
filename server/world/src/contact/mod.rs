//! Touching (model §4, stage 3): what a hand's judgement parts do to one object in one step.
//!
//! Everything here is in the object's space, so that a moving object and a moving hand are one case:
//!
//! ```text
//!   before:  object_from_world(before) * part(before)  ──┐
//!                                                        ├─ the part's path past a solid that stands still
//!   now:     object_from_world(now)    * part(now)     ──┘
//! ```

/// Which objects and hands may meet at all.
pub mod broad;
mod point_face;
mod segment_edge;

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::frame::Feature;
use crate::hand::hand_state::HandState;
use crate::hand::judgement::PosedHand;
use crate::hand::part::JudgementPart;
use crate::polyhedron::Polyhedron;
use crate::polyhedron::aabb::Aabb;
use crate::state::HandId;

/// A contact lasts while its point is no farther out of the solid than this, in metres. It covers the rounding of a
/// push, which leaves the point on the surface; larger values would let a leaving finger cling.
const CLING_M: f64 = 1.0e-7;
/// A part that moves out along the normal by more than this within a step presses no longer, in metres.
const LEAVING_M: f64 = 1.0e-9;

/// One contact of one hand with one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Touch {
    /// Whose contact.
    pub hand: HandId,
    /// Which point or segment.
    pub part: JudgementPart,
    /// What it touches.
    pub feature: Feature,
    /// The contact point C at the start of its motion: where the part entered the solid in this step, or where
    /// it stood at the last one. Object space, metres.
    pub point: Point3<f64>,
    /// CB: from the contact point to where the part is now. Object space, metres.
    pub motion: Vector3<f64>,
    /// Outward unit normal of the face, or pseudo-normal of the edge. Object space.
    pub normal: Vector3<f64>,
    /// Where on a judgement segment the contact is, as a share of its length; 0 for a point.
    pub fraction: f64,
}

impl Touch {
    /// What tells one contact from another, and their order.
    pub fn key(&self) -> (HandId, JudgementPart, Feature) {
        (self.hand, self.part, self.feature)
    }

    /// Whether the part moves into the solid, along its surface, or not at all. One that moves out is leaving: it
    /// still counts in the grasp test, for it is inside, but it pushes nothing (it would pull).
    pub fn presses(&self) -> bool {
        self.motion.dot(&self.normal) <= LEAVING_M
    }

    /// Where the touching place of the part is in a posed hand, world space; `None` if that hand has no such part.
    pub fn part_in(&self, posed: &PosedHand) -> Option<Point3<f64>> {
        match self.part {
            JudgementPart::Point(index) => posed.points.get(usize::from(index)).copied(),
            JudgementPart::Segment(index) => {
                let [a, b] = posed.segments.get(usize::from(index))?;
                Some(a + (b - a) * self.fraction)
            }
        }
    }

    /// The place on the face's plane, or on the edge, that is nearest to a point; object space, metres.
    pub fn on_feature(&self, shape: &Polyhedron, point: &Point3<f64>) -> Point3<f64> {
        match self.feature {
            Feature::Face(face) => {
                let face = &shape.faces()[face as usize];
                point - face.normal * (face.normal.dot(&point.coords) - face.offset)
            }
            Feature::Edge(id) => {
                let [from, _] = shape.edge_ends(id);
                let edge = &shape.edges()[id as usize];
                let along = edge.direction.dot(&(point - from));
                from + edge.direction * along.clamp(0.0, edge.length)
            }
        }
    }
}

/// One object before and after the motion that is supposed for this step.
#[derive(Clone, Copy, Debug)]
pub struct Path {
    /// `world_from_object` at the end of the last step.
    pub before: Isometry3<f64>,
    /// `world_from_object` as supposed for this step.
    pub now: Isometry3<f64>,
}

/// Memory that contact search uses again in every step.
#[derive(Clone, Debug, Default)]
pub struct ContactScratch {
    cuts: Vec<crate::query::segment::EdgeCut>,
    crossings: Vec<crate::query::segment_sweep::EdgeCross>,
}

/// Appends all contacts of `hand` with one object, ascending by [`Touch::key`].
///
/// `last` are the object's contacts of the last step, ascending.
pub fn find(
    hand: &HandState,
    shape: &Polyhedron,
    path: &Path,
    last: &[Touch],
    scratch: &mut ContactScratch,
    touches: &mut Vec<Touch>,
) {
    let first = touches.len();
    let before = ObjectSpace::of(&path.before);
    let now = ObjectSpace::of(&path.now);
    point_face::find(hand, shape, &[before, now], last, touches);
    segment_edge::find(hand, shape, &[before, now], last, scratch, touches);
    touches[first..].sort_unstable_by_key(Touch::key);
}

/// The contact with that key, if there was one.
fn known(
    last: &[Touch],
    hand: HandId,
    part: JudgementPart,
    feature: Option<Feature>,
) -> Option<&Touch> {
    let from = last.partition_point(|touch| (touch.hand, touch.part) < (hand, part));
    last[from..]
        .iter()
        .take_while(|touch| (touch.hand, touch.part) == (hand, part))
        .find(|touch| feature.is_none_or(|wanted| touch.feature == wanted))
}

/// The pose `object_from_world` as a matrix and an offset: hundreds of points go through it in a step.
#[derive(Clone, Copy, Debug)]
struct ObjectSpace {
    turn: Matrix3<f64>,
    offset: Vector3<f64>,
}

impl ObjectSpace {
    fn of(world_from_object: &Isometry3<f64>) -> Self {
        let object_from_world = world_from_object.inverse();
        let turn = *object_from_world.rotation.to_rotation_matrix().matrix();
        Self {
            turn,
            offset: object_from_world.translation.vector,
        }
    }

    #[inline]
    fn map(&self, world: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.turn * world.coords + self.offset)
    }
}

/// Whether the box around the points, grown by `margin` metres, misses a box.
#[inline]
fn misses<const N: usize>(around: &Aabb, points: [&Point3<f64>; N], margin: f64) -> bool {
    for axis in 0..3 {
        let (mut low, mut high) = (points[0][axis], points[0][axis]);
        for point in &points[1..] {
            low = low.min(point[axis]);
            high = high.max(point[axis]);
        }
        if low > around.hi[axis] + margin || high < around.lo[axis] - margin {
            return true;
        }
    }
    false
}
