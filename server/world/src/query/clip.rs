//! The part of a segment inside a convex shape (Cyrus & Beck 1978).

use nalgebra::Point3;

use super::NO_FACE;

/// A part of a segment, by fractions of it, and the faces through which it enters and leaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clip {
    /// 0 if the segment starts inside.
    pub(super) enter: f64,
    /// [`NO_FACE`] if the segment starts inside.
    pub(super) enter_face: u32,
    /// [`NO_FACE`] if the segment ends inside.
    pub(super) leave_face: u32,
}

/// Signed distance of a point from a plane, in metres.
#[inline]
pub(super) fn height(plane: &[f64; 4], p: &Point3<f64>) -> f64 {
    plane[0] * p.x + plane[1] * p.y + plane[2] * p.z - plane[3]
}

/// The part of the segment from `a` to `b` behind all planes, or `None` if it has no length or runs along a
/// plane.
///
/// `a` counts as before a plane down to a depth of `slack` metres; a segment that starts there and goes in enters at
/// 0. Of faces entered or left at the same fraction the lowest is named.
#[inline]
pub(super) fn clip(
    planes: &[[f64; 4]],
    a: &Point3<f64>,
    b: &Point3<f64>,
    slack: f64,
) -> Option<Clip> {
    let (mut enter, mut enter_face, mut leave, mut leave_face) =
        (-1.0_f64, NO_FACE, 1.0_f64, NO_FACE);
    for (face, plane) in (0_u32..).zip(planes) {
        let (from, to) = (height(plane, a), height(plane, b));
        if from >= 0.0 && to >= 0.0 {
            return None;
        }
        if from > -slack && to < from {
            let t = (from / (from - to)).max(0.0);
            if t > enter {
                (enter, enter_face) = (t, face);
            }
        } else if to > 0.0 {
            let t = from / (from - to);
            if t < leave {
                (leave, leave_face) = (t, face);
            }
        }
    }
    let enter = enter.max(0.0);
    (enter < leave).then_some(Clip {
        enter,
        enter_face,
        leave_face,
    })
}
