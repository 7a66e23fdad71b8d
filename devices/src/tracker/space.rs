//! From the transmitter's axes to the world's.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};

/// Inch to metre, exactly.
pub const METRES_PER_INCH: f64 = 0.0254;
/// Centimetre to metre.
pub const METRES_PER_CENTIMETRE: f64 = 0.01;

/// Which way a tracker's axes point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TrackerSpace {
    /// x forward, y right, z down: transmitters of Polhemus and Ascension.
    ZDown,
    /// x right, y forward, z up: many optical systems.
    ZUp,
    /// x right, y up, −z forward: the world's own.
    #[default]
    YUp,
}

impl TrackerSpace {
    /// The rotation from these axes to the world's (x right, y up, −z forward).
    #[must_use]
    pub fn world_from_axes(self) -> UnitQuaternion<f64> {
        let axes = match self {
            Self::ZDown => Matrix3::new(
                0.0, 1.0, 0.0, //
                0.0, 0.0, -1.0, //
                -1.0, 0.0, 0.0,
            ),
            Self::ZUp => Matrix3::new(
                1.0, 0.0, 0.0, //
                0.0, 0.0, 1.0, //
                0.0, -1.0, 0.0,
            ),
            Self::YUp => Matrix3::identity(),
        };
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
    }

    /// A sensor's pose in transmitter space (m) as a pose in the y-up world with its origin in the transmitter (m).
    ///
    /// The position takes the world's axes and the rotation is conjugated, so the sensor's own axes are renamed in the
    /// same way: a sensor that is aligned with the transmitter has the identity in the world too.
    #[must_use]
    pub fn to_world(self, transmitter_from_sensor: &Isometry3<f64>) -> Isometry3<f64> {
        renamed(&self.world_from_axes(), transmitter_from_sensor)
    }

    /// The inverse of [`TrackerSpace::to_world`], for emulators that are given a pose in the world.
    #[must_use]
    pub fn from_world(self, world_from_sensor: &Isometry3<f64>) -> Isometry3<f64> {
        renamed(&self.world_from_axes().inverse(), world_from_sensor)
    }
}

fn renamed(axes: &UnitQuaternion<f64>, pose: &Isometry3<f64>) -> Isometry3<f64> {
    let position = axes * pose.translation.vector;
    let rotation = axes * pose.rotation * axes.inverse();
    Isometry3::from_parts(Translation3::from(position), rotation)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion, Vector3};

    use super::TrackerSpace;

    #[test]
    fn axes_go_where_the_manuals_say() {
        let (right, up, forward) = (Vector3::x(), Vector3::y(), -Vector3::z());
        let cases = [
            (TrackerSpace::ZDown, [forward, right, -up]),
            (TrackerSpace::ZUp, [right, forward, up]),
            (TrackerSpace::YUp, [right, up, -forward]),
        ];
        for (space, images) in cases {
            for (axis, world) in [Vector3::x(), Vector3::y(), Vector3::z()]
                .iter()
                .zip(images)
            {
                let pose = space.to_world(&Isometry3::translation(axis.x, axis.y, axis.z));
                assert!(
                    (pose.translation.vector - world).norm() < 1e-12,
                    "{space:?} {axis}"
                );
                assert!(pose.rotation.angle() < 1e-12);
                let turned = space.to_world(&Isometry3::rotation(axis * 0.3));
                assert!((turned.rotation.scaled_axis() - world * 0.3).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn there_and_back_is_nowhere() {
        let pose = Isometry3::from_parts(
            Vector3::new(0.1, -0.2, 0.3).into(),
            UnitQuaternion::from_euler_angles(0.3, -0.7, 1.9),
        );
        for space in [TrackerSpace::ZDown, TrackerSpace::ZUp, TrackerSpace::YUp] {
            let back = space.to_world(&space.from_world(&pose));
            assert!((back.translation.vector - pose.translation.vector).norm() < 1e-12);
            assert!(back.rotation.angle_to(&pose.rotation) < 1e-7);
        }
    }
}
