//! From the transmitter's axes to the world's.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};

/// Inch to metre, exactly.
pub const METRES_PER_INCH: f64 = 0.0254;
/// Centimetre to metre.
pub const METRES_PER_CENTIMETRE: f64 = 0.01;

/// The rotation from transmitter axes (x forward, y right, z down) to world axes (x right, y up, −z forward):
/// `x_w = y`, `y_w = −z`, `z_w = −x`.
#[must_use]
pub fn world_from_transmitter_axes() -> UnitQuaternion<f64> {
    let axes = Matrix3::new(
        0.0, 1.0, 0.0, //
        0.0, 0.0, -1.0, //
        -1.0, 0.0, 0.0,
    );
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

/// A sensor's pose in transmitter space (m) as a pose in the y-up world with its origin in the transmitter (m).
///
/// The position takes the world's axes and the rotation is conjugated, so the sensor's own axes are renamed in the
/// same way: a sensor that is aligned with the transmitter has the identity in the world too.
#[must_use]
pub fn transmitter_to_world(transmitter_from_sensor: &Isometry3<f64>) -> Isometry3<f64> {
    let world_from_transmitter = world_from_transmitter_axes();
    let position = world_from_transmitter * transmitter_from_sensor.translation.vector;
    let rotation = world_from_transmitter
        * transmitter_from_sensor.rotation
        * world_from_transmitter.inverse();
    Isometry3::from_parts(Translation3::from(position), rotation)
}

/// The inverse of [`transmitter_to_world`], for emulators that are given a pose in the world.
#[must_use]
pub fn world_to_transmitter(world_from_sensor: &Isometry3<f64>) -> Isometry3<f64> {
    let transmitter_from_world = world_from_transmitter_axes().inverse();
    let position = transmitter_from_world * world_from_sensor.translation.vector;
    let rotation =
        transmitter_from_world * world_from_sensor.rotation * transmitter_from_world.inverse();
    Isometry3::from_parts(Translation3::from(position), rotation)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion, Vector3};

    use super::{transmitter_to_world, world_to_transmitter};

    #[test]
    fn axes_go_where_the_manual_says() {
        let cases = [
            (Vector3::x(), -Vector3::z()), // forward
            (Vector3::y(), Vector3::x()),  // right
            (Vector3::z(), -Vector3::y()), // down
        ];
        for (transmitter, world) in cases {
            let pose = transmitter_to_world(&Isometry3::translation(
                transmitter.x,
                transmitter.y,
                transmitter.z,
            ));
            assert!((pose.translation.vector - world).norm() < 1e-12);
            assert!(pose.rotation.angle() < 1e-12);
            let turned = Isometry3::rotation(transmitter * 0.3);
            let turned_world = transmitter_to_world(&turned).rotation.scaled_axis();
            assert!((turned_world - world * 0.3).norm() < 1e-12);
        }
    }

    #[test]
    fn there_and_back_is_nowhere() {
        let pose = Isometry3::from_parts(
            Vector3::new(0.1, -0.2, 0.3).into(),
            UnitQuaternion::from_euler_angles(0.3, -0.7, 1.9),
        );
        let back = transmitter_to_world(&world_to_transmitter(&pose));
        assert!((back.translation.vector - pose.translation.vector).norm() < 1e-12);
        assert!(back.rotation.angle_to(&pose.rotation) < 1e-7);
    }
}
