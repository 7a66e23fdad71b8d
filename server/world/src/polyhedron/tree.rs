//! A static tree of boxes over triangles or edges: the parts of a shape near a box, a segment or a point.

use nalgebra::{Point3, Vector3};

use super::aabb::Aabb;

/// Most items of a leaf.
const LEAF_ITEMS: usize = 4;
/// Enough for the halved halves of 2^32 items: each level leaves at most one node behind.
const STACK_DEPTH: usize = 48;

/// Nodes in depth-first order: the left child follows its parent.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Node {
    aabb: Aabb,
    /// First item of a leaf; right child of an inner node.
    first: u32,
    /// Items of a leaf; 0 marks an inner node.
    n_items: u32,
}

impl Tree {
    /// The tree over these boxes; items are their indices.
    pub(crate) fn new(boxes: &[Aabb]) -> Self {
        let mut tree = Self {
            nodes: Vec::with_capacity(boxes.len()),
            items: (0..boxes.len() as u32).collect(),
        };
        if !boxes.is_empty() {
            tree.grow(boxes, 0, boxes.len());
        }
        tree
    }

    fn grow(&mut self, boxes: &[Aabb], start: usize, end: usize) {
        let items = &mut self.items[start..end];
        let aabb = items
            .iter()
            .skip(1)
            .fold(boxes[items[0] as usize], |b, &i| {
                b.joined(&boxes[i as usize])
            });
        let node = self.nodes.len();
        self.nodes.push(Node {
            aabb,
            first: start as u32,
            n_items: items.len() as u32,
        });
        if items.len() <= LEAF_ITEMS {
            items.sort_unstable();
            return;
        }
        let axis = (aabb.hi - aabb.lo).imax();
        let middle = |i: u32| boxes[i as usize].lo[axis] + boxes[i as usize].hi[axis];
        items.sort_unstable_by(|&i, &j| middle(i).total_cmp(&middle(j)).then(i.cmp(&j)));
        let half = start + items.len() / 2;
        self.grow(boxes, start, half);
        self.nodes[node].first = self.nodes.len() as u32;
        self.nodes[node].n_items = 0;
        self.grow(boxes, half, end);
    }

    /// Calls `visit` with every item of every leaf that `enter` lets pass.
    #[inline]
    fn walk(&self, mut enter: impl FnMut(&Aabb) -> bool, mut visit: impl FnMut(u32)) {
        let mut stack = [0_u32; STACK_DEPTH];
        let mut height = usize::from(!self.nodes.is_empty());
        while height > 0 {
            height -= 1;
            let index = stack[height];
            let node = &self.nodes[index as usize];
            if !enter(&node.aabb) {
                continue;
            }
            if node.n_items == 0 {
                stack[height] = node.first;
                stack[height + 1] = index + 1;
                height += 2;
            } else {
                let first = node.first as usize;
                self.items[first..first + node.n_items as usize]
                    .iter()
                    .for_each(|&i| visit(i));
            }
        }
    }

    /// Items whose leaf meets the box.
    #[inline]
    pub(crate) fn in_box(&self, query: &Aabb, visit: impl FnMut(u32)) {
        self.walk(|b| b.meets(query), visit);
    }

    /// Items whose leaf, grown by `margin`, meets the segment from `a` to `a + ab`.
    #[inline]
    pub(crate) fn on_segment(
        &self,
        a: &Point3<f64>,
        ab: &Vector3<f64>,
        margin: f64,
        visit: impl FnMut(u32),
    ) {
        self.walk(|b| b.meets_segment(a, ab, margin), visit);
    }

    /// Items of leaves not farther from `p` than the best found so far. `visit` gets an item and the best squared
    /// distance, and returns the new best.
    #[inline]
    pub(crate) fn nearest(&self, p: &Point3<f64>, mut visit: impl FnMut(u32, f64) -> f64) {
        let mut stack = [(0_u32, 0.0_f64); STACK_DEPTH];
        let mut height = usize::from(!self.nodes.is_empty());
        let mut best = f64::INFINITY;
        while height > 0 {
            height -= 1;
            let (index, distance) = stack[height];
            if distance > best {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.n_items > 0 {
                let first = node.first as usize;
                for &item in &self.items[first..first + node.n_items as usize] {
                    best = visit(item, best);
                }
                continue;
            }
            let left = (
                index + 1,
                self.nodes[index as usize + 1].aabb.distance_squared(p),
            );
            let right = (
                node.first,
                self.nodes[node.first as usize].aabb.distance_squared(p),
            );
            let (far, near) = if left.1 <= right.1 {
                (right, left)
            } else {
                (left, right)
            };
            stack[height] = far;
            stack[height + 1] = near;
            height += 2;
        }
    }
}
