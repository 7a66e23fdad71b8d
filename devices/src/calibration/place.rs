//! Where things are: the room from points of a table, the tracker's sensor on the wrist from a hand that lies flat.
//!
//! ```text
//!            far side (-z)
//!        ┌────────●────────┐      ● third: anywhere on the table, beyond the near edge
//!        │                 │
//!        ●────────────────●┘      first: the near left corner     second: along the near edge, to the right (+x)
//!             near side            up (+y) is out of the table, as x right and -z away from you make it
//! ```

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use thiserror::Error;

use crate::calibration::tracker_hold::HeldSensor;
use crate::glove::calibrate::MountOffset;

/// Shortest edge that gives a direction, m.
const EDGE_MIN_M: f64 = 0.10;
/// How far the third point has to be off the edge's line, m.
const OFF_EDGE_MIN_M: f64 = 0.05;
/// Farthest point that a tracker could mean, m.
const REACH_MAX_M: f64 = 100.0;

/// Points of a table, in the y-up space in which the tracker's driver reports, m.
#[derive(Debug, Clone, PartialEq)]
pub struct TablePoints {
    /// The near left corner.
    pub corner: Point3<f64>,
    /// A point along the near edge, to the right of it.
    pub along_edge: Point3<f64>,
    /// Points of the table's top farther away; the first says which side is up, more of them make the plane better.
    pub on_table: Vec<Point3<f64>>,
}

/// Where the room is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Room {
    /// `world_from_transmitter`, in the y-up space in which the tracker's driver reports.
    pub world_from_transmitter: Isometry3<f64>,
    /// Root mean square distance of all points from the plane through them, m; 0 for three points.
    pub residual_m: f64,
    /// From the corner to the second point, m: to compare with a ruler.
    pub edge_m: f64,
}

/// Why points make no room.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum RoomFault {
    /// No third point.
    #[error("a third point is missing: touch the table beyond the edge")]
    NoThird,
    /// A number is not finite, or beyond any tracker.
    #[error("a point is not finite or farther than 100 m, or the transmitter would be")]
    Wild,
    /// The first two points are nearly one.
    #[error(
        "the first two points are {0:.3} m apart: touch them at least 0.1 m apart along the edge"
    )]
    ShortEdge(f64),
    /// The third is on the line of the others.
    #[error(
        "the third point is {0:.3} m off the line of the first two: touch it at least 0.05 m away from the edge"
    )]
    OnTheEdge(f64),
}

/// The room in which the corner is at `world_corner` (m, world space), the edge runs along +x and the table's top is
/// level.
///
/// # Errors
/// When the points do not say where the table is.
pub fn room(points: &TablePoints, world_corner: Point3<f64>) -> Result<Room, RoomFault> {
    let third = *points.on_table.first().ok_or(RoomFault::NoThird)?;
    let all = || {
        [points.corner, points.along_edge]
            .into_iter()
            .chain(points.on_table.iter().copied())
    };
    let is_sane = |point: Point3<f64>| point.iter().all(|value| value.abs() <= REACH_MAX_M);
    if !all().chain([world_corner]).all(is_sane) {
        return Err(RoomFault::Wild);
    }
    let edge = points.along_edge - points.corner;
    let edge_m = edge.norm();
    if edge_m < EDGE_MIN_M {
        return Err(RoomFault::ShortEdge(edge_m));
    }
    let to_third = third - points.corner;
    let off_edge = to_third - edge * (edge.dot(&to_third) / edge.norm_squared());
    if off_edge.norm() < OFF_EDGE_MIN_M {
        return Err(RoomFault::OnTheEdge(off_edge.norm()));
    }
    let (centre, plane_normal) = plane(all());
    // x to the right and the third point away from the wearer leave one side that is up.
    let up = if edge.cross(&off_edge).dot(&plane_normal) < 0.0 {
        -plane_normal
    } else {
        plane_normal
    };
    let right = (edge - up * up.dot(&edge)).normalize();
    let toward = right.cross(&up);
    let world_from_axes =
        Matrix3::from_rows(&[right.transpose(), up.transpose(), toward.transpose()]);
    let rotation =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(world_from_axes));
    let heights = all().map(|point| up.dot(&(point - centre)));
    let n = all().count() as f64;
    // The corner as it was touched is off the plane by its own error; the plane is the better height.
    let corner = points.corner - up * up.dot(&(points.corner - centre));
    let place = world_corner - rotation * corner;
    // The settings take no farther one, and a file of it would keep the daemon from starting.
    if !is_sane(place.into()) {
        return Err(RoomFault::Wild);
    }
    Ok(Room {
        world_from_transmitter: Isometry3::from_parts(Translation3::from(place), rotation),
        residual_m: (heights.map(|height| height * height).sum::<f64>() / n).sqrt(),
        edge_m,
    })
}

/// Centre and unit normal of the plane that fits best.
fn plane(points: impl Iterator<Item = Point3<f64>> + Clone) -> (Point3<f64>, Vector3<f64>) {
    let n = points.clone().count().max(1) as f64;
    let centre = Point3::from(
        points
            .clone()
            .map(|point| point.coords)
            .sum::<Vector3<f64>>()
            / n,
    );
    let spread = points.fold(Matrix3::zeros(), |spread, point| {
        let arm = point - centre;
        spread + arm * arm.transpose()
    });
    let eigen = spread.symmetric_eigen();
    (
        centre,
        eigen
            .eigenvectors
            .column(eigen.eigenvalues.imin())
            .into_owned(),
    )
}

/// Yaw, pitch and roll in degrees of a rotation R = R_y(yaw) · R_x(pitch) · R_z(roll), as the setting
/// `transmitter_rotation_deg` takes them.
#[must_use]
pub fn yaw_pitch_roll_deg(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    /// Cosine of the pitch below which yaw and roll are one turn.
    const LOCK: f64 = 1e-6;
    let m = rotation.to_rotation_matrix();
    let pitch = (-m[(1, 2)]).clamp(-1.0, 1.0).asin();
    let (yaw, roll) = if pitch.cos() > LOCK {
        (m[(0, 2)].atan2(m[(2, 2)]), m[(1, 0)].atan2(m[(1, 1)]))
    } else {
        ((-m[(2, 0)]).atan2(m[(0, 0)]), 0.0)
    };
    [yaw, pitch, roll].map(f64::to_degrees)
}

/// The mount of a sensor whose wrist is known: the hand lies flat, palm down, fingers away from the wearer (-z), so that
/// the wrist's axes are the world's.
///
/// With `world_wrist` (m, world space) the position is found too; without, `before` keeps its own and only the rotation
/// is new.
#[must_use]
pub fn mount(
    held: &HeldSensor,
    world_from_transmitter: &Isometry3<f64>,
    world_wrist: Option<Point3<f64>>,
    before: &MountOffset,
) -> MountOffset {
    let world_from_sensor = world_from_transmitter * held.pose;
    let wrist_from_sensor = world_from_sensor.rotation;
    let q = wrist_from_sensor.coords;
    MountOffset {
        position_m: world_wrist.map_or(before.position_m, |wrist| {
            (world_from_sensor.translation.vector - wrist.coords).into()
        }),
        rotation_xyzw: [q.x, q.y, q.z, q.w],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world() -> Isometry3<f64> {
        Isometry3::from_parts(
            Vector3::new(0.2, 0.8, -0.4).into(),
            UnitQuaternion::from_euler_angles(0.4, -1.1, 2.0),
        )
    }

    /// The points of a level table, as the transmitter of that world sees them.
    fn touched(on_table: &[[f64; 3]]) -> TablePoints {
        let see = |point: [f64; 3]| world().inverse_transform_point(&Point3::from(point));
        TablePoints {
            corner: see([-0.3, 0.0, 0.1]),
            along_edge: see([0.5, 0.0, 0.1]),
            on_table: on_table.iter().map(|point| see(*point)).collect(),
        }
    }

    #[test]
    fn three_points_find_the_room() {
        let found = room(&touched(&[[0.1, 0.0, -0.4]]), Point3::new(-0.3, 0.0, 0.1)).unwrap();
        let error = found.world_from_transmitter.inverse() * world();
        assert!(error.translation.vector.norm() < 1e-9 && error.rotation.angle() < 1e-7);
        assert!(found.residual_m < 1e-9 && (found.edge_m - 0.8).abs() < 1e-9);
    }

    #[test]
    fn more_points_make_a_residual() {
        let table = [[0.1, 0.0, -0.4], [0.4, 0.004, -0.4], [-0.2, 0.0, -0.5]];
        let found = room(&touched(&table), Point3::new(-0.3, 0.0, 0.1)).unwrap();
        assert!(
            (1e-4..4e-3).contains(&found.residual_m),
            "{}",
            found.residual_m
        );
        let error = found.world_from_transmitter.inverse() * world();
        assert!(error.rotation.angle() < 0.02, "{}", error.rotation.angle());
    }

    #[test]
    fn points_that_say_nothing_are_refused() {
        let corner = Point3::origin();
        let check = |points: &TablePoints, words: &str| {
            let fault = room(points, corner).unwrap_err().to_string();
            assert!(fault.contains(words), "{fault}");
        };
        check(&touched(&[]), "third point is missing");
        check(&touched(&[[0.0, 0.0, 0.12]]), "0.020 m off the line");
        check(&touched(&[[0.9, 0.0, 0.1]]), "0.000 m off the line");
        let mut near = touched(&[[0.0, 0.0, -0.4]]);
        near.along_edge = near.corner + Vector3::new(0.03, 0.0, 0.0);
        check(&near, "0.030 m apart");
        near.along_edge.x = f64::NAN;
        check(&near, "not finite");
        near.along_edge.x = 1e9;
        check(&near, "farther than 100 m");
        let mut far = touched(&[[0.0, 0.0, -0.4]]);
        let step = Vector3::new(90.0, 0.0, 0.0);
        far.corner += step;
        far.along_edge += step;
        far.on_table[0] += step;
        let corner = world() * far.corner;
        assert!(
            room(&far, corner).is_ok(),
            "the transmitter is where it was"
        );
        let beyond = room(&far, Point3::from(-(world() * step))).unwrap_err();
        assert_eq!(beyond, RoomFault::Wild);
    }

    #[test]
    fn angles_are_those_of_the_setting() {
        let about = |axis, deg: f64| UnitQuaternion::from_axis_angle(&axis, deg.to_radians());
        for angles in [
            [30.0, 20.0, -10.0],
            [-170.0, -80.0, 120.0],
            [0.0; 3],
            [45.0, 90.0, 0.0],
        ] {
            let rotation = about(Vector3::y_axis(), angles[0])
                * about(Vector3::x_axis(), angles[1])
                * about(Vector3::z_axis(), angles[2]);
            let found = yaw_pitch_roll_deg(&rotation);
            for (found, expected) in found.into_iter().zip(angles) {
                assert!((found - expected).abs() < 1e-5, "{found}, not {expected}");
            }
        }
    }

    #[test]
    fn a_flat_hand_finds_the_mount() {
        let wrist_from_sensor = Isometry3::from_parts(
            Vector3::new(0.01, 0.02, 0.03).into(),
            UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3),
        );
        let wrist = Point3::new(0.1, 0.03, -0.2);
        let held = HeldSensor {
            pose: world().inverse()
                * Isometry3::translation(wrist.x, wrist.y, wrist.z)
                * wrist_from_sensor,
            noise_m: 0.0,
            noise_rad: 0.0,
            n_readings: 100,
        };
        let before = MountOffset {
            position_m: [1.0, 2.0, 3.0],
            ..MountOffset::default()
        };
        let found = mount(&held, &world(), Some(wrist), &before).wrist_from_sensor();
        let error = found.inverse() * wrist_from_sensor;
        assert!(error.translation.vector.norm() < 1e-9 && error.rotation.angle() < 1e-7);
        let turned = mount(&held, &world(), None, &before);
        assert_eq!(turned.position_m, before.position_m);
        assert!(
            turned
                .wrist_from_sensor()
                .rotation
                .angle_to(&wrist_from_sensor.rotation)
                < 1e-7
        );
    }
}
