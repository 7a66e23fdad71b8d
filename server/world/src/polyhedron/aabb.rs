//! Axis-aligned bounding boxes.

use nalgebra::{Isometry3, Point3, Vector3};

/// An axis-aligned bounding box, in metres, in the space of what it bounds. Closed: touching boxes meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Least coordinates.
    pub lo: Point3<f64>,
    /// Greatest coordinates.
    pub hi: Point3<f64>,
}

impl Aabb {
    /// The box of these points; of none, an empty box that meets nothing.
    pub fn of(points: impl IntoIterator<Item = Point3<f64>>) -> Self {
        let empty = Self {
            lo: Point3::from([f64::INFINITY; 3]),
            hi: Point3::from([f64::NEG_INFINITY; 3]),
        };
        points.into_iter().fold(empty, |b, p| Self {
            lo: b.lo.inf(&p),
            hi: b.hi.sup(&p),
        })
    }

    /// Whether the boxes have a point in common.
    #[inline]
    pub fn meets(&self, other: &Self) -> bool {
        self.lo.x <= other.hi.x
            && other.lo.x <= self.hi.x
            && self.lo.y <= other.hi.y
            && other.lo.y <= self.hi.y
            && self.lo.z <= other.hi.z
            && other.lo.z <= self.hi.z
    }

    /// This box grown by `margin` metres on all sides (shrunk if negative).
    #[inline]
    pub fn grown(&self, margin: f64) -> Self {
        let m = Vector3::repeat(margin);
        Self {
            lo: self.lo - m,
            hi: self.hi + m,
        }
    }

    /// The smallest box of both.
    pub fn joined(&self, other: &Self) -> Self {
        Self {
            lo: self.lo.inf(&other.lo),
            hi: self.hi.sup(&other.hi),
        }
    }

    /// The box, in space a, of this box of space b.
    pub fn moved(&self, a_from_b: &Isometry3<f64>) -> Self {
        let centre = a_from_b * nalgebra::center(&self.lo, &self.hi);
        let rotation = a_from_b.rotation.to_rotation_matrix();
        let half = rotation.matrix().abs() * ((self.hi - self.lo) * 0.5);
        Self {
            lo: centre - half,
            hi: centre + half,
        }
    }

    /// Squared distance of a point from the box, in square metres; 0 inside.
    #[inline]
    pub fn distance_squared(&self, p: &Point3<f64>) -> f64 {
        let axis = |lo: f64, hi: f64, x: f64| {
            let d = if x < lo {
                lo - x
            } else if x > hi {
                x - hi
            } else {
                0.0
            };
            d * d
        };
        axis(self.lo.x, self.hi.x, p.x)
            + axis(self.lo.y, self.hi.y, p.y)
            + axis(self.lo.z, self.hi.z, p.z)
    }

    /// Whether the segment from `a` along `ab` (to `a + ab`) meets the box grown by `margin` (slab test).
    #[inline]
    pub fn meets_segment(&self, a: &Point3<f64>, ab: &Vector3<f64>, margin: f64) -> bool {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for i in 0..3 {
            let (lo, hi) = (self.lo[i] - margin - a[i], self.hi[i] + margin - a[i]);
            if ab[i] == 0.0 {
                if lo > 0.0 || hi < 0.0 {
                    return false;
                }
                continue;
            }
            let (t0, t1) = (lo / ab[i], hi / ab[i]);
            enter = enter.max(t0.min(t1));
            leave = leave.min(t0.max(t1));
        }
        enter <= leave
    }
}
