//! The objects of a scene as a hand sees them that plans: where to take hold, how high they reach.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use tsukamu_world::polyhedron::Polyhedron;

use super::posture::TIP_SPREAD_M;

/// One object, in the space of the plan: world space, seen in a mirror at x = 0 where the hand is a left one.
#[derive(Clone, Debug)]
pub(super) struct Thing {
    pub(super) name: String,
    shape: Arc<Polyhedron>,
    /// `world_from_object`.
    pose: Isometry3<f64>,
    mirror: bool,
}

/// How to take hold of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grip {
    /// Between the two faces, metres.
    pub(super) centre: Point3<f64>,
    /// Of the grip frame, radians.
    pub(super) yaw: f64,
    /// Between the two faces, metres.
    pub(super) width: f64,
}

/// Widest and narrowest object that a pinch takes, metres: the hand opens to 105 mm and must come around it.
const WIDTHS_M: (f64, f64) = (0.008, 0.078);
/// Least cosine between a face's normal and the way of the fingertip onto it: a tip does not hold on a steeper one.
const LEVEL: f64 = 0.6;
/// How much nearer or farther the faces may be where index and middle finger come to them, metres.
const UNEVEN_M: f64 = 0.003;
/// Farthest turn of the hand, and the step in which turns are tried, degrees.
const TURNS_DEG: (i32, usize) = (75, 5);

/// How much better a later grip must be than an earlier one: the hand squares up to a face that is nearly in front of it.
const BETTER: f64 = 1.0e-3;

impl Thing {
    pub(super) fn new(
        name: String,
        shape: Arc<Polyhedron>,
        pose: Isometry3<f64>,
        mirror: bool,
    ) -> Self {
        Self {
            name,
            shape,
            pose,
            mirror,
        }
    }

    /// Centre of gravity, metres.
    pub(super) fn centre(&self) -> Point3<f64> {
        self.seen(Point3::from(self.pose.translation.vector))
    }

    /// Height of the lowest and of the highest vertex, metres.
    pub(super) fn heights(&self) -> (f64, f64) {
        let heights = self
            .shape
            .vertices()
            .iter()
            .map(|vertex| (self.pose * vertex).y);
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
            (low.min(y), high.max(y))
        })
    }

    /// Largest distance of a vertex from the centre of gravity, metres.
    pub(super) fn reach(&self) -> f64 {
        self.shape.bounding_radius()
    }

    /// Puts its centre of gravity elsewhere.
    pub(super) fn put(&mut self, centre: &Point3<f64>) {
        self.pose.translation = Translation3::from(self.seen(*centre).coords);
    }

    /// How far it is from a place near the centre of gravity to the surface, and the normal there; the farthest of them.
    pub(super) fn exit(
        &self,
        offset: &Vector3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<(f64, Vector3<f64>)> {
        let from = self
            .pose
            .inverse_transform_point(&self.seen(self.centre() + offset));
        let way = self
            .pose
            .inverse_transform_vector(&self.seen(Point3::from(*direction)).coords);
        let points = self.shape.points();
        let hits = self.shape.triangles().iter().filter_map(|triangle| {
            let corners = triangle.vertices.map(|index| points[index as usize]);
            crossing(&from, &way, &corners).map(|distance| (distance, triangle.face))
        });
        let (distance, face) = hits.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let normal = self.pose.rotation * self.shape.faces()[face as usize].normal;
        Some((distance, self.seen(Point3::from(normal)).coords))
    }

    /// The best way for a thumb and two fingers to take hold of it at the height of its centre, from above.
    pub(super) fn grip(&self) -> Option<Grip> {
        let mut best: Option<(f64, Grip)> = None;
        let by_degrees = (-TURNS_DEG.0..=TURNS_DEG.0)
            .step_by(TURNS_DEG.1)
            .map(|turn| f64::from(turn).to_radians());
        let by_faces = self.shape.faces().iter().map(|face| {
            let normal = self.seen(Point3::from(self.pose.rotation * face.normal));
            libm::atan2(-normal.x, -normal.z)
        });
        let most = f64::from(TURNS_DEG.0).to_radians();
        for yaw in by_faces.chain(by_degrees).filter(|yaw| yaw.abs() <= most) {
            let Some((cost, grip)) = self.grip_at(yaw) else {
                continue;
            };
            if best.is_none_or(|(least, _)| cost < least - BETTER) {
                best = Some((cost, grip));
            }
        }
        best.map(|(_, grip)| grip)
    }

    /// The grip at a yaw and what speaks against it.
    fn grip_at(&self, yaw: f64) -> Option<(f64, Grip)> {
        let forward = Vector3::new(-libm::sin(yaw), 0.0, -libm::cos(yaw));
        let right = Vector3::new(libm::cos(yaw), 0.0, -libm::sin(yaw));
        let spread = right * TIP_SPREAD_M;
        let [index, middle] = [
            self.exit(&-spread, &forward)?,
            self.exit(&spread, &forward)?,
        ];
        let thumb = self.exit(&Vector3::zeros(), &-forward)?;
        let far = 0.5 * (index.0 + middle.0);
        let width = far + thumb.0;
        let level = [
            index.1.dot(&forward),
            middle.1.dot(&forward),
            -thumb.1.dot(&forward),
        ];
        let fits = (index.0 - middle.0).abs() <= UNEVEN_M
            && level.iter().all(|cosine| *cosine >= LEVEL)
            && (WIDTHS_M.0..=WIDTHS_M.1).contains(&width);
        let tilt: f64 = level.iter().map(|cosine| 1.0 - cosine).sum();
        let cost = 6.0 * tilt + 0.1 * yaw.abs() + 4.0 * width;
        let centre = self.centre() + forward * (0.5 * (far - thumb.0));
        fits.then_some((cost, Grip { centre, yaw, width }))
    }

    /// Whether a pinch can take it at all: see [`Thing::grip`].
    pub(super) fn can_be_taken(&self) -> bool {
        self.grip().is_some()
    }

    /// A place of the world as the plan sees it, and back.
    fn seen(&self, place: Point3<f64>) -> Point3<f64> {
        if self.mirror {
            Point3::new(-place.x, place.y, place.z)
        } else {
            place
        }
    }
}

/// How far along a unit vector a line from a place crosses a triangle (Möller & Trumbore 1997).
fn crossing(from: &Point3<f64>, way: &Vector3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let across = way.cross(&ac);
    let volume = ab.dot(&across);
    if volume.abs() < 1e-18 {
        return None;
    }
    let start = from - a;
    let u = start.dot(&across) / volume;
    let turned = start.cross(&ab);
    let v = way.dot(&turned) / volume;
    let distance = ac.dot(&turned) / volume;
    let inside = u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9;
    (inside && distance > 0.0).then_some(distance)
}

#[cfg(test)]
mod tests {
    use tsukamu_world::polyhedron::shapes;

    use super::*;

    fn thing(shape: Polyhedron, yaw: f64, mirror: bool) -> Thing {
        let pose = Isometry3::new(Vector3::new(0.1, 0.03, -0.3), Vector3::y() * yaw);
        Thing::new("it".to_owned(), Arc::new(shape), pose, mirror)
    }

    #[test]
    fn a_box_is_taken_across_its_narrow_side() {
        let shape = shapes::cuboid(&Vector3::new(0.06, 0.04, 0.03)).unwrap();
        for (yaw, mirror) in [(0.0, false), (0.3, false), (0.3, true), (-0.7, true)] {
            let grip = thing(shape.clone(), yaw, mirror).grip().unwrap();
            assert!((grip.width - 0.03).abs() < 1e-9, "{grip:?}");
            let expected = if mirror { -yaw } else { yaw };
            assert!((grip.yaw - expected).abs() < 1e-9, "{grip:?}");
            assert!((grip.centre.x.abs() - 0.1).abs() < 1e-9);
        }
    }

    #[test]
    fn what_is_too_wide_or_too_steep_is_not_taken() {
        assert!(
            !thing(
                shapes::cuboid(&Vector3::new(0.2, 0.2, 0.2)).unwrap(),
                0.0,
                false
            )
            .can_be_taken()
        );
        assert!(!thing(shapes::pyramid(0.06, 0.06, 0.02).unwrap(), 0.0, false).can_be_taken());
        assert!(thing(shapes::pyramid(0.06, 0.06, 0.08).unwrap(), 0.0, false).can_be_taken());
    }
}
