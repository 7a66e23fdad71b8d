//! From joint angles to joint places in the wrist's space, and back.
//!
//! Each finger other than the thumb is a universal joint at the MCP and two hinges, all links in one plane:
//!
//! ```text
//!   +y back of the hand          base ──── PIP          abduction turns the plane about +y,
//!    │                             \ mcp      \ pip      flexion turns the links within it,
//!    └── -z fingers              (flexion toward -y)     from -z toward -y.
//! ```
//!
//! The thumb's plane contains the base's -z. Opposition turns that plane about -z (from beside the palm to
//! across it), abduction lifts the metacarpal out of -z within the plane, and the flexions bend it back.
//! A left hand is the mirror image of a right one at the same angles.

use libm::{atan2, cos, sin};
use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::joint::{Finger, LINKS_PER_FINGER, N_JOINTS, POINTS_PER_FINGER, Side};
use super::sample::{FingerAngles, JointAngles, ThumbAngles};
use super::skeleton::{FingerBones, Skeleton, turned};

/// Axis of the right hand's palm arch in the wrist's space: it lowers the little finger's knuckle and turns it to the thumb.
const PALM_ARCH_AXIS: Vector3<f64> = Vector3::new(-0.570_977, 0.0, -0.820_966);
/// Where on the line from the wrist to the little finger's knuckle the palm arch has its pivot.
const PALM_ARCH_PIVOT: f64 = 0.5;
/// Opposition in the middle of the thumb's range, radians: of the two readings of a thumb's plane, half a turn apart,
/// the one nearer to this is taken.
const OPPOSITION_CENTRE: f64 = 0.75;
/// Below this mean square of direction components a finger's plane is not defined by its links.
const PLANE_UNDEFINED: f64 = 1e-18;

/// The twenty joints in the wrist's space, metres, for joint angles in radians.
pub fn forward(skeleton: &Skeleton, side: Side, angles: &JointAngles) -> [Point3<f64>; N_JOINTS] {
    let mut points = [Point3::origin(); N_JOINTS];
    for (finger, places) in Finger::ALL
        .into_iter()
        .zip(points.chunks_exact_mut(POINTS_PER_FINGER))
    {
        let bones = arched(skeleton.finger(finger), finger, side, angles.palm_arch);
        let directions = match finger {
            Finger::Thumb => thumb_directions(&angles.thumb),
            _ => finger_directions(finger, &angles.fingers[finger.index() - 1]),
        };
        places[0] = bones.base;
        for link in 0..LINKS_PER_FINGER {
            let direction = bones.orientation * handed(&directions[link], side);
            places[link + 1] = places[link] + direction * bones.lengths[link];
        }
    }
    points
}

/// The joint angles, in radians, that bring a skeleton's links into the directions of the given links.
///
/// `points` are the twenty joints in the wrist's space. Only directions count (and the little finger's base, for the palm arch),
/// so another hand's points give the angles at which this skeleton has the same posture. Each finger's links are
/// taken to lie in their best plane. Where that is undefined (a thumb along its base's -z; a finger bent straight down at every link)
/// the opposition or abduction is 0; a link without length continues the one before it.
pub fn angles_from_points(
    skeleton: &Skeleton,
    side: Side,
    points: &[Point3<f64>; N_JOINTS],
) -> JointAngles {
    let little = skeleton.finger(Finger::Little);
    let knuckle = &points[Finger::Little.index() * POINTS_PER_FINGER];
    let palm_arch = arch_of_knuckle(little, side, knuckle);
    let mut angles = JointAngles {
        palm_arch,
        ..JointAngles::default()
    };
    for (finger, places) in Finger::ALL
        .into_iter()
        .zip(points.chunks_exact(POINTS_PER_FINGER))
    {
        let bones = arched(skeleton.finger(finger), finger, side, palm_arch);
        let directions = local_directions(&bones, side, places);
        match finger {
            Finger::Thumb => angles.thumb = thumb_angles(&directions),
            _ => angles.fingers[finger.index() - 1] = finger_angles(finger, &directions),
        }
    }
    angles
}

/// A direction of the right hand as that of `side`.
fn handed(direction: &Vector3<f64>, side: Side) -> Vector3<f64> {
    match side {
        Side::Right => *direction,
        Side::Left => Vector3::new(-direction.x, direction.y, direction.z),
    }
}

/// Which way a finger's positive abduction turns about +y at a right hand.
fn abduction_sign(finger: Finger) -> f64 {
    if matches!(finger, Finger::Ring | Finger::Little) {
        -1.0
    } else {
        1.0
    }
}

/// Link directions of a right hand's finger in its base space.
fn finger_directions(finger: Finger, angles: &FingerAngles) -> [Vector3<f64>; LINKS_PER_FINGER] {
    let swing = abduction_sign(finger) * angles.abduction;
    let proximal = angles.mcp_flexion;
    let middle = proximal + angles.pip_flexion;
    [proximal, middle, middle + angles.dip_flexion]
        .map(|bend| Vector3::new(-cos(bend) * sin(swing), -sin(bend), -cos(bend) * cos(swing)))
}

/// Link directions of a right hand's thumb in its base space.
fn thumb_directions(angles: &ThumbAngles) -> [Vector3<f64>; LINKS_PER_FINGER] {
    let metacarpal = angles.abduction;
    let proximal = metacarpal - angles.mcp_flexion;
    [metacarpal, proximal, proximal - angles.ip_flexion].map(|lift| {
        Vector3::new(
            -sin(lift) * cos(angles.opposition),
            -sin(lift) * sin(angles.opposition),
            -cos(lift),
        )
    })
}

/// The axis and pivot of the palm arch.
fn arch_axis(bones: &FingerBones, side: Side) -> (Vector3<f64>, Point3<f64>) {
    let axis = match side {
        Side::Right => PALM_ARCH_AXIS,
        // The mirror image of a turn: an axis is an axial vector.
        Side::Left => Vector3::new(PALM_ARCH_AXIS.x, -PALM_ARCH_AXIS.y, -PALM_ARCH_AXIS.z),
    };
    (axis.normalize(), bones.base * PALM_ARCH_PIVOT)
}

/// The bones of a finger after the palm has arched; only the little finger's move.
fn arched(bones: &FingerBones, finger: Finger, side: Side, palm_arch: f64) -> FingerBones {
    if finger != Finger::Little {
        return *bones;
    }
    let (axis, pivot) = arch_axis(bones, side);
    let turn: UnitQuaternion<f64> = turned(&axis, palm_arch);
    FingerBones {
        base: pivot + turn * (bones.base - pivot),
        orientation: turn * bones.orientation,
        ..*bones
    }
}

/// The palm arch that brings the little finger's knuckle nearest to a place in the wrist's space.
fn arch_of_knuckle(bones: &FingerBones, side: Side, knuckle: &Point3<f64>) -> f64 {
    let (axis, pivot) = arch_axis(bones, side);
    let rest = bones.base - pivot;
    let now = knuckle - pivot;
    let rest = rest - axis * axis.dot(&rest);
    let now = now - axis * axis.dot(&now);
    atan2(axis.dot(&rest.cross(&now)), rest.dot(&now))
}

/// Link directions as those of a right hand in the finger's base space.
fn local_directions(
    bones: &FingerBones,
    side: Side,
    places: &[Point3<f64>],
) -> [Vector3<f64>; LINKS_PER_FINGER] {
    let mut direction = Vector3::new(0.0, 0.0, -1.0);
    let mut directions = [direction; LINKS_PER_FINGER];
    for (slot, ends) in directions.iter_mut().zip(places.windows(2)) {
        let link = (ends[1] - ends[0]).try_normalize(f64::EPSILON);
        direction = link.map_or(direction, |d| {
            handed(&(bones.orientation.inverse() * d), side)
        });
        *slot = direction;
    }
    directions
}

/// The angle, modulo half a turn, of the line through the origin that fits pairs of coordinates best; 0 where none does.
fn line_angle(pairs: [(f64, f64); LINKS_PER_FINGER]) -> f64 {
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in pairs {
        aa += a * a;
        bb += b * b;
        ab += a * b;
    }
    if aa + bb < PLANE_UNDEFINED {
        0.0
    } else {
        0.5 * atan2(2.0 * ab, aa - bb)
    }
}

fn finger_angles(finger: Finger, directions: &[Vector3<f64>; LINKS_PER_FINGER]) -> FingerAngles {
    // The swing is within a quarter turn of -z, which picks one of the line's two ends.
    let swing = line_angle(directions.map(|d| (-d.z, -d.x)));
    let bends = directions.map(|d| atan2(-d.y, -d.x * sin(swing) - d.z * cos(swing)));
    FingerAngles {
        mcp_flexion: bends[0],
        pip_flexion: wrapped(bends[1] - bends[0]),
        dip_flexion: wrapped(bends[2] - bends[1]),
        abduction: abduction_sign(finger) * swing,
    }
}

fn thumb_angles(directions: &[Vector3<f64>; LINKS_PER_FINGER]) -> ThumbAngles {
    let line = line_angle(directions.map(|d| (-d.x, -d.y)));
    let quarter = std::f64::consts::FRAC_PI_2;
    let opposition = if line < OPPOSITION_CENTRE - quarter {
        line + 2.0 * quarter
    } else {
        line
    };
    let lifts = directions.map(|d| atan2(-d.x * cos(opposition) - d.y * sin(opposition), -d.z));
    ThumbAngles {
        opposition,
        abduction: lifts[0],
        mcp_flexion: wrapped(lifts[0] - lifts[1]),
        ip_flexion: wrapped(lifts[1] - lifts[2]),
    }
}

/// An angle brought into (-π, π], radians.
fn wrapped(angle: f64) -> f64 {
    atan2(sin(angle), cos(angle))
}

#[cfg(test)]
#[path = "kinematics_tests.rs"]
pub(crate) mod tests;
