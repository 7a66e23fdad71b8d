//! Opening a finger of the shown hand until it lies on the surface it went through (Funahashi et al. 1998, §3.2, ref. 16).
//!
//! The tracked finger may be inside an object. Its links are turned along a fixed path until the finger is out:
//!
//! ```text
//!   opening   0 ────────── 1 ───────── 1.5 ─────────── 2.5 ──────────── 3.5
//!          tracked    first touch   as far again    straight      bent to the back
//!                                   half-way        (extended)    of the hand (lifted)
//! ```
//!
//! The least opening on the path that is out is found by bisection, beginning at the one of the step before.

use libm::{atan2, cos, sin};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::joint::{Finger, LINKS_PER_FINGER, POINTS_PER_FINGER};
use super::skeleton::{HandModel, turned};

/// The links of one finger in one space (the wrist's, unless a caller says otherwise).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerLinks {
    /// The joint nearest the palm, metres.
    pub base: Point3<f64>,
    /// Unit vectors along the links, from the palm to the tip.
    pub directions: [Vector3<f64>; LINKS_PER_FINGER],
    /// Link lengths, metres.
    pub lengths: [f64; LINKS_PER_FINGER],
}

/// The directions a finger opens through: unit vectors in the space of its [`FingerLinks`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OpeningPath {
    /// Link directions when the finger first touched the object.
    pub touched: [Vector3<f64>; LINKS_PER_FINGER],
    /// The straight finger.
    pub straight: Vector3<f64>,
    /// The straight finger bent back at its base.
    pub lifted: Vector3<f64>,
}

/// A finger out of the object, or as far out as its path goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Retraction {
    /// The finger's four joints, metres, in the space of its [`FingerLinks`].
    pub points: [Point3<f64>; POINTS_PER_FINGER],
    /// How far the finger was opened, 0 to [`OPENING_MAX`]; the next step's warm start.
    pub opening: f64,
    /// What is left of the penetration, metres: at most [`DEPTH_TOLERANCE`], unless no opening on the path is out.
    pub depth: f64,
    /// How often the depth was asked for.
    pub n_evaluations: u32,
}

/// Penetration that counts as lying on the surface, metres. The shown hand promises less than 1 mm.
pub const DEPTH_TOLERANCE: f64 = 1e-4;
/// The end of the opening path.
pub const OPENING_MAX: f64 = 3.5;
/// Where the path leaves the arc through the first touch.
const ARC_END: f64 = 1.5;
/// Where the finger is straight.
const STRAIGHT_AT: f64 = 2.5;
/// Openings tried in order when a wider one is needed.
const WIDER: [f64; 7] = [0.5, 1.0, ARC_END, 2.0, STRAIGHT_AT, 3.0, OPENING_MAX];
/// How far below the last opening the search begins: the change of a few steps at hundreds of steps a second.
const WARM_STEP: f64 = 0.02;
/// Bisection ends at this share of the path: below a tenth of a millimetre at a fingertip.
const OPENING_RESOLUTION: f64 = 5e-4;
/// Most bisections.
const N_BISECTIONS: u32 = 12;
/// How far the lifted finger is bent back at its base, radians.
const LIFT: f64 = 1.0;
/// Shorter vectors have no direction: metres, or the sine of an angle.
const TINY: f64 = 1e-9;

impl FingerLinks {
    /// The links between four joints. A link without length takes the direction before it, the first one -z.
    pub fn from_points(points: &[Point3<f64>; POINTS_PER_FINGER]) -> Self {
        let mut direction = Vector3::new(0.0, 0.0, -1.0);
        let mut links = Self {
            base: points[0],
            directions: [direction; 3],
            lengths: [0.0; 3],
        };
        for (link, ends) in points.windows(2).enumerate() {
            let along = ends[1] - ends[0];
            direction = along.try_normalize(TINY).unwrap_or(direction);
            links.directions[link] = direction;
            links.lengths[link] = along.norm();
        }
        links
    }

    /// The four joints.
    pub fn points(&self) -> [Point3<f64>; POINTS_PER_FINGER] {
        let mut points = [self.base; POINTS_PER_FINGER];
        for link in 0..LINKS_PER_FINGER {
            points[link + 1] = points[link] + self.directions[link] * self.lengths[link];
        }
        points
    }
}

impl OpeningPath {
    /// The path of a finger of `model` in the wrist's space, given its link directions at the first touch.
    pub fn new(
        model: &HandModel,
        finger: Finger,
        touched: [Vector3<f64>; LINKS_PER_FINGER],
    ) -> Self {
        let base = &model.skeleton.finger(finger).orientation;
        let straight = base * Vector3::new(0.0, 0.0, -1.0);
        // Fingers lift to the back of the hand; the thumb lifts away from the palm's line, back to its side.
        let lift: UnitQuaternion<f64> = match finger {
            Finger::Thumb => {
                let outward = if model.side == super::joint::Side::Right {
                    LIFT
                } else {
                    -LIFT
                };
                turned(&Vector3::y(), outward)
            }
            _ => turned(&Vector3::x(), LIFT),
        };
        Self {
            touched,
            straight,
            lifted: base * (lift * Vector3::new(0.0, 0.0, -1.0)),
        }
    }

    /// The finger at an opening: `tracked` at 0, then along the path; lengths and base are the tracked finger's.
    pub fn finger_at(&self, tracked: &FingerLinks, opening: f64) -> FingerLinks {
        let mut links = *tracked;
        let past_arc =
            (opening - ARC_END).clamp(0.0, STRAIGHT_AT - ARC_END) / (STRAIGHT_AT - ARC_END);
        let past_straight = (opening - STRAIGHT_AT).clamp(0.0, OPENING_MAX - STRAIGHT_AT)
            / (OPENING_MAX - STRAIGHT_AT);
        for (link, direction) in links.directions.iter_mut().enumerate() {
            let arc = opening.clamp(0.0, ARC_END);
            *direction = slerp(&tracked.directions[link], &self.touched[link], arc);
            if past_arc > 0.0 {
                *direction = slerp(direction, &self.straight, past_arc);
            }
            if past_straight > 0.0 {
                *direction = slerp(direction, &self.lifted, past_straight);
            }
        }
        links
    }
}

/// Opens a finger until it lies on the surface.
///
/// `depth` answers how deep the finger with these four joints is inside, metres: the largest penetration of its points
/// and ridges, 0 or less outside. `last_opening` is that of the step before (0 at first). Where depth falls along
/// the path the least opening is found; the answer is out of the object wherever any opening that was tried is.
pub fn retract_finger(
    tracked: &FingerLinks,
    path: &OpeningPath,
    last_opening: f64,
    depth: &mut dyn FnMut(&[Point3<f64>; POINTS_PER_FINGER]) -> f64,
) -> Retraction {
    let mut n_evaluations = 0;
    let mut at = |opening: f64| {
        n_evaluations += 1;
        let points = path.finger_at(tracked, opening).points();
        let depth = depth(&points);
        Candidate {
            points,
            opening,
            depth,
        }
    };
    let found = least_opening(last_opening, &mut at);
    let Candidate {
        points,
        opening,
        depth,
    } = found;
    Retraction {
        points,
        opening,
        depth,
        n_evaluations,
    }
}

/// The direction `share` of the way from one unit vector to another along their great circle; beyond 1 it goes on.
/// Opposite vectors meet over an axis across the first one, always the same.
pub fn slerp(from: &Vector3<f64>, to: &Vector3<f64>, share: f64) -> Vector3<f64> {
    let cross = from.cross(to);
    let angle = atan2(cross.norm(), from.dot(to));
    if angle < TINY {
        return *from;
    }
    let axis = cross.try_normalize(TINY).unwrap_or_else(|| across(from));
    from * cos(share * angle) + axis.cross(from) * sin(share * angle)
}

/// A unit vector across a unit vector.
fn across(direction: &Vector3<f64>) -> Vector3<f64> {
    let least = direction.iamin();
    let mut axis = Vector3::zeros();
    axis[least] = 1.0;
    direction.cross(&axis).normalize()
}

/// One opening that was tried.
#[derive(Clone, Copy)]
struct Candidate {
    points: [Point3<f64>; POINTS_PER_FINGER],
    opening: f64,
    depth: f64,
}

impl Candidate {
    fn is_out(&self) -> bool {
        self.depth <= DEPTH_TOLERANCE
    }

    fn lies_on_surface(&self) -> bool {
        self.is_out() && self.depth > 0.0
    }
}

fn least_opening(last_opening: f64, at: &mut dyn FnMut(f64) -> Candidate) -> Candidate {
    let last = last_opening.clamp(0.0, OPENING_MAX);
    let warm = (last > 0.0).then(|| at(last));
    // A steady grip: the last opening still lies on the surface, so no narrower one is out.
    if let Some(warm) = warm.filter(Candidate::lies_on_surface) {
        return warm;
    }
    let tracked = at(0.0);
    if tracked.is_out() {
        return tracked;
    }
    let (inside, out) = bracket(tracked, warm, at);
    match out {
        Some(out) => bisect(inside.opening, out, at),
        None => inside,
    }
}

/// An opening that is inside and a wider one that is out; or the least deep one and none.
fn bracket(
    tracked: Candidate,
    warm: Option<Candidate>,
    at: &mut dyn FnMut(f64) -> Candidate,
) -> (Candidate, Option<Candidate>) {
    let last = warm.map_or(0.0, |warm| warm.opening);
    if let Some(warm) = warm.filter(Candidate::is_out) {
        let narrower = (last - WARM_STEP > 0.0).then(|| at(last - WARM_STEP));
        return match narrower {
            Some(narrower) if narrower.is_out() => (tracked, Some(narrower)),
            Some(narrower) => (narrower, Some(warm)),
            None => (tracked, Some(warm)),
        };
    }
    let mut inside = warm.unwrap_or(tracked);
    let mut least_deep = if inside.depth <= tracked.depth {
        inside
    } else {
        tracked
    };
    let near = (last > 0.0).then_some(last + WARM_STEP);
    for opening in near
        .into_iter()
        .chain(WIDER)
        .filter(|opening| *opening > last && *opening <= OPENING_MAX)
    {
        let candidate = at(opening);
        if candidate.is_out() {
            return (inside, Some(candidate));
        }
        if candidate.depth < least_deep.depth {
            least_deep = candidate;
        }
        inside = candidate;
    }
    (least_deep, None)
}

/// Narrows the bracket; what it returns is always out.
fn bisect(mut inside: f64, mut out: Candidate, at: &mut dyn FnMut(f64) -> Candidate) -> Candidate {
    for _ in 0..N_BISECTIONS {
        if out.lies_on_surface() || out.opening - inside <= OPENING_RESOLUTION {
            break;
        }
        let middle = at(0.5 * (inside + out.opening));
        if middle.is_out() {
            out = middle;
        } else {
            inside = middle.opening;
        }
    }
    out
}

#[cfg(test)]
#[path = "retract_tests.rs"]
mod tests;
