//! Targets to throw at (Funahashi et al. 1998, §5.2, experiment 2).

use nalgebra::Point3;

use crate::scene::Target;

/// Distance from the target's centre, in metres, at which the way from `from` to `to` goes through its disc;
/// `None` where it does not.
pub(crate) fn hit(target: &Target, from: &Point3<f64>, to: &Point3<f64>) -> Option<f64> {
    let (before, after) = (
        (from - target.centre).dot(&target.normal),
        (to - target.centre).dot(&target.normal),
    );
    let crosses = (before > 0.0) != (after > 0.0);
    if !crosses {
        return None;
    }
    let point = from + (to - from) * (before / (before - after));
    let distance = (point - target.centre).norm();
    (distance <= target.radius).then_some(distance)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn only_a_way_through_the_disc_hits() {
        let target = Target {
            name: "wall".to_owned(),
            centre: Point3::new(0.0, 1.0, -2.0),
            normal: Vector3::z(),
            radius: 0.15,
        };
        let check = |from: [f64; 3], to: [f64; 3], expected: Option<f64>| {
            let found = hit(&target, &Point3::from(from), &Point3::from(to));
            assert_eq!(
                found.map(|d| (d * 1e6).round()),
                expected.map(|d: f64| (d * 1e6).round())
            );
        };
        check([0.0, 1.1, -1.9], [0.0, 1.1, -2.1], Some(0.1));
        check([0.0, 1.1, -2.1], [0.0, 1.1, -1.9], Some(0.1));
        check([0.0, 1.2, -1.9], [0.0, 1.2, -2.1], None);
        check([0.0, 1.0, -1.9], [0.0, 1.0, -1.95], None);
        check([0.0, 1.0, -2.0], [0.0, 1.0, -2.0], None);
    }
}
