//! Vectors, rotations, poses and small enumerations.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use tsukamu_proto::v1;
use tsukamu_world::frame::Tracking;
use tsukamu_world::hand::joint::Side;
use tsukamu_world::state::ContactState;

use super::fault::Fault;

/// How far from 1 a quaternion's length may be for its bits to be taken as they are. What the daemon sends is within
/// a few 1e-16; what is farther off comes from someone who rounds, and is normalised.
const UNIT_TOLERANCE: f64 = 1.0e-9;
/// Length below which a quaternion has no direction.
const NO_ROTATION: f64 = 1.0e-6;

/// Longest name that a client gives, bytes: it is repeated in every event.
const NAME_MAX: usize = 200;

/// Looks at a name that a client gives.
///
/// # Errors
/// When it is too long, or holds what no terminal should get.
pub fn checked_name(name: &str) -> Result<&str, Fault> {
    if name.len() <= NAME_MAX && !name.contains(char::is_control) {
        Ok(name)
    } else {
        Err(Fault::Name(NAME_MAX))
    }
}

/// A vector as a message.
pub fn vec3(v: &Vector3<f64>) -> v1::Vec3 {
    v1::Vec3 {
        x: v.x,
        y: v.y,
        z: v.z,
    }
}

/// A point as a message.
pub fn point(p: &Point3<f64>) -> v1::Vec3 {
    vec3(&p.coords)
}

/// A rotation as a message.
pub fn quat(q: &UnitQuaternion<f64>) -> v1::Quat {
    v1::Quat {
        x: q.i,
        y: q.j,
        z: q.k,
        w: q.w,
    }
}

/// A pose as a message.
pub fn pose(p: &Isometry3<f64>) -> v1::Pose {
    v1::Pose {
        position: Some(vec3(&p.translation.vector)),
        rotation: Some(quat(&p.rotation)),
    }
}

/// A finite vector.
///
/// # Errors
/// When it is missing or not finite.
pub fn vec3_from(message: Option<&v1::Vec3>, field: &'static str) -> Result<Vector3<f64>, Fault> {
    let v = message.ok_or(Fault::Missing(field))?;
    let vector = Vector3::new(v.x, v.y, v.z);
    if vector.iter().all(|x| x.is_finite()) {
        Ok(vector)
    } else {
        Err(Fault::NotFinite(field))
    }
}

/// A finite point.
///
/// # Errors
/// When it is missing or not finite.
pub fn point_from(message: Option<&v1::Vec3>, field: &'static str) -> Result<Point3<f64>, Fault> {
    vec3_from(message, field).map(Point3::from)
}

/// A rotation from x, y, z, w: as it is when it is of unit length, else normalised.
///
/// # Errors
/// When it is not finite or too short to have a direction.
pub fn rotation_from(
    [x, y, z, w]: [f64; 4],
    field: &'static str,
) -> Result<UnitQuaternion<f64>, Fault> {
    let quaternion = Quaternion::new(w, x, y, z);
    let length = quaternion.norm();
    if !length.is_finite() {
        return Err(Fault::NotFinite(field));
    }
    if (length - 1.0).abs() <= UNIT_TOLERANCE {
        return Ok(UnitQuaternion::new_unchecked(quaternion));
    }
    if length < NO_ROTATION {
        return Err(Fault::NotRotation(field, length));
    }
    Ok(UnitQuaternion::new_normalize(quaternion))
}

/// A pose; a missing rotation is the identity.
///
/// # Errors
/// When the position is missing, or a number is bad.
pub fn pose_from(message: Option<&v1::Pose>, field: &'static str) -> Result<Isometry3<f64>, Fault> {
    let message = message.ok_or(Fault::Missing(field))?;
    let position = vec3_from(message.position.as_ref(), field)?;
    let rotation = match &message.rotation {
        Some(q) => rotation_from([q.x, q.y, q.z, q.w], field)?,
        None => UnitQuaternion::identity(),
    };
    Ok(Isometry3::from_parts(
        Translation3::from(position),
        rotation,
    ))
}

/// A side as a message.
pub const fn side(side: Side) -> v1::Side {
    match side {
        Side::Left => v1::Side::Left,
        Side::Right => v1::Side::Right,
    }
}

/// A side.
///
/// # Errors
/// When it is neither left nor right.
pub fn side_from(value: i32) -> Result<Side, Fault> {
    match v1::Side::try_from(value) {
        Ok(v1::Side::Left) => Ok(Side::Left),
        Ok(v1::Side::Right) => Ok(Side::Right),
        _ => Err(Fault::Unknown {
            field: "side",
            value: value.to_string(),
            allowed: "1 (left), 2 (right)",
        }),
    }
}

/// Whether a hand is followed, as a message.
pub const fn tracking(tracking: Tracking) -> v1::Tracking {
    match tracking {
        Tracking::Never => v1::Tracking::Never,
        Tracking::Tracked => v1::Tracking::Tracked,
        Tracking::Held => v1::Tracking::Held,
        Tracking::Lost => v1::Tracking::Lost,
    }
}

/// How hands touch an object, as a message.
pub const fn contact_state(state: ContactState) -> v1::ContactState {
    match state {
        ContactState::Free => v1::ContactState::Free,
        ContactState::PushedAtOne => v1::ContactState::PushedAtOne,
        ContactState::PushedAtSeveral => v1::ContactState::PushedAtSeveral,
        ContactState::Grasped => v1::ContactState::Grasped,
    }
}

/// An id plus one, with 0 for none.
pub const fn plus_one(id: Option<u64>) -> u64 {
    match id {
        Some(id) => id + 1,
        None => 0,
    }
}
