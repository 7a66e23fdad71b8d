//! What numbers of a record can be a position or a rotation; the same for every tracker of this family.

use nalgebra::{Point3, Quaternion, UnitQuaternion};

/// Positions beyond this are no tracker's of this kind, m.
const MAX_POSITION_M: f64 = 20.0;

/// A position in m; `None` when it is not a number or is out of every reach.
pub(crate) fn position(metres: [f64; 3]) -> Option<Point3<f64>> {
    metres
        .iter()
        .all(|part| part.is_finite() && part.abs() <= MAX_POSITION_M)
        .then(|| Point3::from(metres))
}

/// R = Rz(azimuth) · Ry(elevation) · Rx(roll), degrees.
pub(crate) fn from_euler(degrees: [f64; 3]) -> Option<UnitQuaternion<f64>> {
    let [azimuth, elevation, roll] = degrees.map(f64::to_radians);
    degrees
        .iter()
        .all(|part| part.is_finite() && part.abs() <= 360.0)
        .then(|| UnitQuaternion::from_euler_angles(roll, elevation, azimuth))
}

/// A rotation from w, x, y, z; `None` when its length is further from 1 than `slack`.
pub(crate) fn from_wxyz([w, x, y, z]: [f64; 4], slack: f64) -> Option<UnitQuaternion<f64>> {
    let quaternion = Quaternion::new(w, x, y, z);
    let length = quaternion.norm();
    // Written so that a length that is not a number fails too.
    ((length - 1.0).abs() < slack).then(|| UnitQuaternion::from_quaternion(quaternion))
}
