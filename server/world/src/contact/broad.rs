//! The broad phase: a tree of boxes around all objects, so that objects at rest far away cost nothing.

use nalgebra::Point3;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};

use crate::polyhedron::aabb::Aabb;

/// How much larger than its object a box in the tree is, in metres: an object that moves less stays where it is in
/// the tree. It never changes what a query answers, for answers are checked against the exact boxes.
const MARGIN_M: f64 = 0.01;

/// The box around nothing.
const EMPTY: Aabb = Aabb {
    lo: Point3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
    hi: Point3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
};

/// The tree. It follows from the state and is no part of it: it may be built anew at any time.
#[derive(Clone, Debug, Default)]
pub struct BroadPhase {
    tree: Bvh,
    /// Exact box of each slot, `None` for an empty one.
    exact: Vec<Option<Aabb>>,
    /// Box of each slot in the tree.
    stored: Vec<Aabb>,
}

impl BroadPhase {
    /// A tree around the given boxes, one per slot.
    pub fn new(exact: Vec<Option<Aabb>>) -> Self {
        let stored: Vec<Aabb> = exact
            .iter()
            .map(|bounds| bounds.map_or(EMPTY, |bounds| bounds.grown(MARGIN_M)))
            .collect();
        let leaves = exact
            .iter()
            .zip(&stored)
            .enumerate()
            .filter(|(_, (bounds, _))| bounds.is_some())
            .map(|(slot, (_, stored))| (slot, to_parry(stored)));
        Self {
            tree: tree(leaves.collect()),
            exact,
            stored,
        }
    }

    /// Says where the object of a slot is now.
    pub fn set(&mut self, slot: u32, bounds: Aabb) {
        let index = slot as usize;
        if self.exact.len() <= index {
            self.exact.resize(index + 1, None);
            self.stored.resize(index + 1, EMPTY);
        }
        let known = self.exact[index].replace(bounds).is_some();
        if known && holds(&self.stored[index], &bounds) {
            return;
        }
        if known {
            self.tree.remove(slot);
        }
        self.stored[index] = bounds.grown(MARGIN_M);
        self.tree.insert(to_parry(&self.stored[index]), slot);
    }

    /// Says that a slot is empty.
    pub fn clear(&mut self, slot: u32) {
        if self
            .exact
            .get_mut(slot as usize)
            .and_then(Option::take)
            .is_some()
        {
            self.tree.remove(slot);
        }
    }

    /// The exact box of a slot.
    pub fn bounds(&self, slot: u32) -> Option<&Aabb> {
        self.exact.get(slot as usize)?.as_ref()
    }

    /// Appends the slots whose exact boxes meet `bounds`, ascending.
    pub fn query(&self, bounds: &Aabb, slots: &mut Vec<u32>) {
        let first = slots.len();
        let wanted = to_parry(bounds);
        let met = |slot: &u32| self.bounds(*slot).is_some_and(|exact| exact.meets(bounds));
        slots.extend(self.tree.intersect_aabb(&wanted).filter(met));
        slots[first..].sort_unstable();
    }
}

/// The tree of one or two leaves is built by insertion: parry 0.31's `Bvh::from_iter` takes their indices to be 0 and 1.
fn tree(leaves: Vec<(usize, parry3d_f64::bounding_volume::Aabb)>) -> Bvh {
    if leaves.len() > 2 {
        return Bvh::from_iter(BvhBuildStrategy::Binned, leaves);
    }
    let mut tree = Bvh::new();
    for (slot, bounds) in leaves {
        tree.insert(bounds, slot as u32);
    }
    tree
}

fn holds(outer: &Aabb, inner: &Aabb) -> bool {
    (0..3).all(|axis| outer.lo[axis] <= inner.lo[axis] && inner.hi[axis] <= outer.hi[axis])
}

fn to_parry(bounds: &Aabb) -> parry3d_f64::bounding_volume::Aabb {
    let [lo, hi] = [&bounds.lo, &bounds.hi].map(|corner| Vector::new(corner.x, corner.y, corner.z));
    parry3d_f64::bounding_volume::Aabb::new(lo, hi)
}
