//! The prisms around the links of a finger, whose ridges are the judgement segments (Funahashi et al. 1998, §3.1).
//!
//! ```text
//!        ridge 2 (back)
//!           ┌───┐          A prism of four sides seen along its link, from the palm: ridge 0 is on the palmar side,
//!  ridge 3 ─┤ ● ├─ ridge 1  the others follow at equal angles, first toward the little finger. Each is parallel
//!           └───┘          to the link at the distance of its radius.
//!        ridge 0 (palm)
//! ```
//!
//! A link's roll is not measured, so the prism is turned by a direction of the hand that the finger's links never
//! run along: for a finger the wrist's x axis, for the thumb the axis of its hinges at middle opposition. Projected
//! off the link it turns continuously as the finger bends.

use libm::{cos, sin};
use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::joint::{Finger, POINTS_PER_FINGER, Side};
use super::skeleton::PRISM_SIDES_MAX;

/// The directions of one hand, in world space, from which its prisms are turned.
#[derive(Clone, Copy, Debug)]
pub struct PrismAxes {
    side: Side,
    /// Toward the fingers.
    forward: Vector3<f64>,
    /// Out of the palm.
    palmar: Vector3<f64>,
    /// Toward the little finger.
    ulnar: Vector3<f64>,
    /// The thumb's hinge axis.
    thumb_hinge: Vector3<f64>,
    /// Cosine and sine of each ridge's angle from the palmar side.
    turns: [(f64, f64); PRISM_SIDES_MAX as usize],
    n_ridges: usize,
}

/// The right thumb's hinge axis in the wrist's space at middle opposition: seen along it, the pad is on the palmar side.
const THUMB_HINGE: (f64, f64) = (-0.84, 0.542_586_4);
/// Shortest link that has a direction, metres; a shorter one takes that of its neighbour nearer the palm.
const LINK_MIN: f64 = 1e-9;
/// Below this share of its length a reference direction counts as along the link.
const ALONG_LINK: f64 = 1e-6;

/// Cosine and sine of each ridge's angle. Those of four, the 1998 model's, are quarter turns: no angle is computed.
fn turns(n_ridges: usize) -> [(f64, f64); PRISM_SIDES_MAX as usize] {
    let mut turns = [(1.0, 0.0); PRISM_SIDES_MAX as usize];
    if n_ridges == 4 {
        turns[1..4].copy_from_slice(&[(0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]);
        return turns;
    }
    for (ridge, turn) in turns.iter_mut().enumerate().take(n_ridges) {
        let angle = std::f64::consts::TAU * ridge as f64 / n_ridges as f64;
        *turn = (cos(angle), sin(angle));
    }
    turns
}

impl PrismAxes {
    /// The axes of a hand whose wrist stands at `world_from_wrist`, for prisms of `prism_sides` ridges (at most 8).
    pub fn new(side: Side, world_from_wrist: &UnitQuaternion<f64>, prism_sides: u32) -> Self {
        let mirror = if side == Side::Right { 1.0 } else { -1.0 };
        let n_ridges = prism_sides.min(PRISM_SIDES_MAX) as usize;
        let world = |x, y, z| world_from_wrist * Vector3::new(x, y, z);
        Self {
            side,
            forward: world(0.0, 0.0, -1.0),
            palmar: world(0.0, -1.0, 0.0),
            ulnar: world(mirror, 0.0, 0.0),
            thumb_hinge: world(mirror * THUMB_HINGE.0, THUMB_HINGE.1, 0.0),
            turns: turns(n_ridges),
            n_ridges,
        }
    }

    /// Calls `emit` with each ridge of the prism of `radius` metres around the link from `start` to `end`, in order.
    /// A link without length has no direction of its own; it takes `direction`. Returns the link's direction.
    pub fn ridges(
        &self,
        finger: Finger,
        link: [Point3<f64>; 2],
        radius: f64,
        direction: &Vector3<f64>,
        mut emit: impl FnMut([Point3<f64>; 2]),
    ) -> Vector3<f64> {
        let direction = (link[1] - link[0])
            .try_normalize(LINK_MIN)
            .unwrap_or(*direction);
        let (palmar, ulnar) = self.cross_axes(finger, &direction);
        for (cosine, sine) in &self.turns[..self.n_ridges] {
            let offset = (palmar * *cosine + ulnar * *sine) * radius;
            emit([link[0] + offset, link[1] + offset]);
        }
        direction
    }

    /// The ridges of all three links of a finger, from the palm to the tip, three times `prism_sides` in order.
    pub fn finger_ridges(
        &self,
        finger: Finger,
        points: &[Point3<f64>; POINTS_PER_FINGER],
        radii: &[f64; super::joint::LINKS_PER_FINGER],
        mut emit: impl FnMut([Point3<f64>; 2]),
    ) {
        let mut direction = self.forward;
        for (ends, radius) in points.windows(2).zip(radii) {
            direction = self.ridges(finger, [ends[0], ends[1]], *radius, &direction, &mut emit);
        }
    }

    /// Toward the fingers, a unit vector: the direction of a first link without length.
    pub fn forward(&self) -> Vector3<f64> {
        self.forward
    }

    /// Unit vectors across a link: to its palmar side and toward the little finger.
    fn cross_axes(&self, finger: Finger, direction: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let reference = if finger == Finger::Thumb {
            self.thumb_hinge
        } else {
            self.ulnar
        };
        let across = |axis: &Vector3<f64>| {
            (axis - direction * direction.dot(axis)).try_normalize(ALONG_LINK)
        };
        // A right hand: -z toward the fingers × x toward the little finger = -y out of the palm. A left one mirrors it.
        let right = self.side == Side::Right;
        if let Some(ulnar) = across(&reference) {
            let palmar = direction.cross(&ulnar);
            return (if right { palmar } else { -palmar }, ulnar);
        }
        // Along its reference the link lies across the hand, so -y is across the link (and the thumb's hinge is far from -y).
        let palmar = across(&self.palmar).unwrap_or(self.forward);
        let ulnar = palmar.cross(direction);
        (palmar, if right { ulnar } else { -ulnar })
    }
}
