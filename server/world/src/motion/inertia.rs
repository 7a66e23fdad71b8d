//! Free objects (Funahashi et al. 1998, §4.1, equation (3)).

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// P(t) = 2 P(t−Δt) − P(t−2Δt) + g Δt², with the rotation of the last step done once more about P.
///
/// `displacement` is P(t−Δt) − P(t−2Δt) in metres, `spin` the last step's rotation, `gravity_step` g Δt² in metres.
pub fn free(
    world_from_object: &Isometry3<f64>,
    displacement: &Vector3<f64>,
    spin: &UnitQuaternion<f64>,
    gravity_step: &Vector3<f64>,
) -> Isometry3<f64> {
    let position = world_from_object.translation.vector + (displacement + gravity_step);
    Isometry3::from_parts(
        Translation3::from(position),
        unit(spin * world_from_object.rotation),
    )
}

/// The same rotation, its length brought back to one: products of thousands of steps would drift from it.
pub fn unit(rotation: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(rotation.into_inner())
}

/// The displacement per step over the last steps of a track of positions (oldest first), in metres: the throw
/// velocity times Δt over a window longer than one step. `None` with fewer than two positions.
pub fn window_displacement(track: &[Point3<f64>]) -> Option<Vector3<f64>> {
    let (first, last) = (track.first()?, track.last()?);
    (track.len() > 1).then(|| (last - first) / (track.len() - 1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (3) summed up: P₀ + k v Δt + g Δt² k(k+1)/2.
    #[test]
    fn free_flight_follows_the_closed_form_at_every_rate() {
        for rate_hz in [60.0, 240.0, 1000.0, 2000.0] {
            let dt: f64 = 1.0 / rate_hz;
            let g = Vector3::new(0.0, -9.81, 0.0);
            let v = Vector3::new(1.5, 2.0, -3.0);
            let start = Isometry3::translation(0.1, 1.0, -0.2);
            let (mut pose, mut displacement) = (start, v * dt);
            for k in 1..=(rate_hz as u32) {
                let next = free(
                    &pose,
                    &displacement,
                    &UnitQuaternion::identity(),
                    &(g * dt * dt),
                );
                displacement = next.translation.vector - pose.translation.vector;
                pose = next;
                let k = f64::from(k);
                let exact =
                    start.translation.vector + v * (k * dt) + g * (dt * dt * k * (k + 1.0) / 2.0);
                assert!(
                    (pose.translation.vector - exact).norm() < 1e-6,
                    "{rate_hz} Hz, step {k}"
                );
            }
        }
    }

    #[test]
    fn a_window_averages_the_track() {
        let track: Vec<Point3<f64>> = (0..5)
            .map(|i| Point3::new(f64::from(i) * 0.01, 0.0, 0.0))
            .collect();
        assert!(
            (window_displacement(&track).unwrap() - Vector3::new(0.01, 0.0, 0.0)).norm() < 1e-15
        );
        assert_eq!(window_displacement(&track[..1]), None);
        assert_eq!(window_displacement(&[]), None);
    }
}
