//! Which edges two faces share.

use super::Edge;

/// Faces up to which the pairs are a square table.
const MAX_SQUARE: usize = 64;
const NONE: u32 = u32::MAX;

/// Edges by their pair of faces.
#[derive(Clone, Debug)]
pub(crate) struct FacePairs {
    /// Lower face, higher face, edge; sorted. Two faces of a solid that is not convex can share several edges.
    sorted: Vec<[u32; 3]>,
    /// For few faces: the lowest edge of a pair, or `NONE`.
    square: Vec<u32>,
    n_faces: usize,
}

impl FacePairs {
    pub(super) fn new(edges: &[Edge], n_faces: usize) -> Self {
        let mut sorted: Vec<[u32; 3]> = (0..)
            .zip(edges)
            .map(|(i, e)| [e.faces[0].min(e.faces[1]), e.faces[0].max(e.faces[1]), i])
            .collect();
        sorted.sort_unstable();
        let mut square = if n_faces <= MAX_SQUARE {
            vec![NONE; n_faces * n_faces]
        } else {
            Vec::new()
        };
        if !square.is_empty() {
            for &[a, b, edge] in sorted.iter().rev() {
                square[a as usize * n_faces + b as usize] = edge;
                square[b as usize * n_faces + a as usize] = edge;
            }
        }
        Self {
            sorted,
            square,
            n_faces,
        }
    }

    /// The lowest edge that the faces share.
    #[inline]
    pub(crate) fn edge(&self, a: u32, b: u32) -> Option<u32> {
        if self.square.is_empty() {
            return self.edges(a, b).next();
        }
        let edge = self.square[a as usize * self.n_faces + b as usize];
        (edge != NONE).then_some(edge)
    }

    /// All edges that the faces share, ascending.
    pub(crate) fn edges(&self, a: u32, b: u32) -> impl Iterator<Item = u32> + '_ {
        let key = [a.min(b), a.max(b)];
        let first = self
            .sorted
            .partition_point(|entry| [entry[0], entry[1]] < key);
        self.sorted[first..]
            .iter()
            .take_while(move |entry| [entry[0], entry[1]] == key)
            .map(|entry| entry[2])
    }
}
