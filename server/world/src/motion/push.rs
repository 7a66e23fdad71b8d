//! Pushing at one point (Funahashi et al. 1998, §3.2 (1), equations (1) and (2)).
//!
//! ```text
//!        A ──── C ───────> B        the judgement point enters at C and goes on to B
//!               │ \   R ^
//!               │  \T   |           CB = T + R,  T ∥ CG,  R ⊥ T
//!               │   v───┘
//!               G                   translate by T, turn about G by arctan(|R|/|CG|)
//! ```

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// Below this distance from the centre of gravity, in metres, a contact point has no direction to it.
const AT_CENTRE_M: f64 = 1.0e-12;

/// A displacement split along and across the line from the contact point to the centre of gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    /// T, parallel to CG: what translates.
    pub along: Vector3<f64>,
    /// R, perpendicular to CG: what rotates.
    pub across: Vector3<f64>,
}

/// Splits the displacement `cb` of a contact point, given `cg` from it to the centre of gravity (equation (1)).
/// At C = G nothing can be split: all of it translates.
pub fn split(cb: &Vector3<f64>, cg: &Vector3<f64>) -> Split {
    let length = cg.norm();
    if length < AT_CENTRE_M {
        return Split {
            along: *cb,
            across: Vector3::zeros(),
        };
    }
    let direction = cg / length;
    let along = direction * cb.dot(&direction);
    Split {
        along,
        across: cb - along,
    }
}

/// The rotation that carries the contact point along `across`: about X = R × CG by arctan(|R|/|CG|) (equation (2)).
///
/// The paper prints X = R × T, which is the same axis while T points from C toward G; R × CG stays right where T
/// vanishes or points outward (model §5.1).
pub fn turn(across: &Vector3<f64>, cg: &Vector3<f64>) -> UnitQuaternion<f64> {
    let Some(axis) = Unit::try_new(across.cross(cg), f64::MIN_POSITIVE) else {
        return UnitQuaternion::identity();
    };
    UnitQuaternion::from_axis_angle(&axis, libm::atan(across.norm() / cg.norm()))
}

/// The pose of an object whose contact point `c` is pushed by `cb`; all in world space, metres.
pub fn pushed(
    world_from_object: &Isometry3<f64>,
    c: &Point3<f64>,
    cb: &Vector3<f64>,
) -> Isometry3<f64> {
    let g = Point3::from(world_from_object.translation.vector);
    let cg = g - c;
    let Split { along, across } = split(cb, &cg);
    Isometry3::from_parts(
        Translation3::from(g.coords + along),
        turn(&across, &cg) * world_from_object.rotation,
    )
}

#[cfg(test)]
mod tests {
    use proptest::prelude::{Strategy, prop, prop_assert, proptest};

    use super::*;

    fn vector(reach: f64) -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-reach..reach).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn the_parts_are_parallel_perpendicular_and_whole(cb in vector(0.02), cg in vector(0.1)) {
            let Split { along, across } = split(&cb, &cg);
            prop_assert!((along + across - cb).norm() < 1e-16);
            prop_assert!(along.cross(&cg).norm() < 1e-15);
            prop_assert!(across.dot(&along).abs() < 1e-16);
        }

        #[test]
        fn the_contact_point_comes_to_lie_on_the_line_from_centre_to_finger(cb in vector(0.01), c in vector(0.1)) {
            let pose = pushed(&Isometry3::identity(), &Point3::from(c), &cb);
            let moved = pose * Point3::from(c);
            let finger = c + cb;
            let (from_g, wanted) = (moved.coords - pose.translation.vector, finger - pose.translation.vector);
            // arctan keeps the direction exactly and the distance to second order.
            prop_assert!(from_g.cross(&wanted).norm() < 1e-12, "{from_g} {wanted}");
            prop_assert!(from_g.dot(&wanted) > 0.0 || c.norm() < 0.02);
        }
    }

    #[test]
    fn a_push_through_the_centre_only_translates() {
        let pose = pushed(
            &Isometry3::identity(),
            &Point3::new(-0.025, 0.0, 0.0),
            &Vector3::new(0.002, 0.0, 0.0),
        );
        assert_eq!(pose, Isometry3::translation(0.002, 0.0, 0.0));
    }

    #[test]
    fn a_push_across_only_rotates() {
        // |R| = |CG|: 45°, about +z, for a point at -x that moves down.
        let pose = pushed(
            &Isometry3::identity(),
            &Point3::new(-0.025, 0.0, 0.0),
            &Vector3::new(0.0, -0.025, 0.0),
        );
        assert_eq!(pose.translation, Translation3::identity());
        let expected =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_4);
        assert!(pose.rotation.angle_to(&expected) < 1e-12);
    }

    #[test]
    fn at_the_centre_of_gravity_all_of_it_translates() {
        let cb = Vector3::new(0.001, 0.002, 0.003);
        assert_eq!(
            pushed(&Isometry3::identity(), &Point3::origin(), &cb)
                .translation
                .vector,
            cb
        );
    }
}
