//! Cutting polygons into triangles.

use nalgebra::{Point3, Vector3};

/// A corner whose sine is below this counts as straight: cutting there gives a triangle without area.
const STRAIGHT_SINE: f64 = 1e-9;

/// The triangles of a polygon, as triples of positions in `ids`, always `ids.len() - 2` of them.
///
/// `normal` is the polygon's unit normal; corners are projected along it, so the polygon need not be quite planar.
/// A convex polygon becomes a fan; of any other the best-shaped ear is cut off first (ear clipping, Meisters 1975),
/// which keeps corners on straight lines from making triangles without area where another cut is possible.
/// A polygon that crosses itself gives some triangulation.
pub(super) fn triangulate(
    points: &[Point3<f64>],
    ids: &[u32],
    normal: &Vector3<f64>,
) -> Vec<[usize; 3]> {
    let n = ids.len();
    if n == 3 {
        return vec![[0, 1, 2]];
    }
    let flat = project(points, ids, normal);
    if (0..n).all(|i| sine(&flat, (i + n - 1) % n, i, (i + 1) % n) > STRAIGHT_SINE) {
        return (1..n - 1).map(|i| [0, i, i + 1]).collect();
    }
    let mut left: Vec<usize> = (0..n).collect();
    let mut triangles = Vec::with_capacity(n - 2);
    while left.len() > 3 {
        let ear = best_ear(&flat, &left);
        triangles.push(around(&left, ear));
        left.remove(ear);
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}

/// The polygon in its own plane.
fn project(points: &[Point3<f64>], ids: &[u32], normal: &Vector3<f64>) -> Vec<[f64; 2]> {
    let mut axis = Vector3::zeros();
    axis[normal.iamin()] = 1.0;
    let u = normal.cross(&axis).normalize();
    let v = normal.cross(&u);
    ids.iter()
        .map(|&i| points[i as usize] - points[ids[0] as usize])
        .map(|p| [p.dot(&u), p.dot(&v)])
        .collect()
}

/// Corner `k` of what is left, with its neighbours.
fn around(left: &[usize], k: usize) -> [usize; 3] {
    let n = left.len();
    [left[(k + n - 1) % n], left[k], left[(k + 1) % n]]
}

/// The ear with the largest sine at its tip; if there is none (the polygon crosses itself), the most convex corner.
fn best_ear(flat: &[[f64; 2]], left: &[usize]) -> usize {
    let (mut best, mut most_convex) = ((STRAIGHT_SINE, None), (f64::NEG_INFINITY, 0));
    for k in 0..left.len() {
        let [a, b, c] = around(left, k);
        let tip = sine(flat, a, b, c);
        if tip > most_convex.0 {
            most_convex = (tip, k);
        }
        let shape = tip.min(sine(flat, b, c, a)).min(sine(flat, c, a, b));
        if shape > best.0
            && left
                .iter()
                .all(|&p| [a, b, c].contains(&p) || !covers(flat, [a, b, c], p))
        {
            best = (shape, Some(k));
        }
    }
    best.1.unwrap_or(most_convex.1)
}

fn cross(o: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
}

/// Sine of the turn at `b` on the way a, b, c; 0 if two of them coincide.
fn sine(flat: &[[f64; 2]], a: usize, b: usize, c: usize) -> f64 {
    let length = |p: [f64; 2], q: [f64; 2]| {
        ((q[0] - p[0]) * (q[0] - p[0]) + (q[1] - p[1]) * (q[1] - p[1])).sqrt()
    };
    let (a, b, c) = (flat[a], flat[b], flat[c]);
    let lengths = length(a, b) * length(b, c);
    if lengths > 0.0 {
        cross(a, b, c) / lengths
    } else {
        0.0
    }
}

/// Whether the counter-clockwise triangle has `p` inside or on its boundary.
fn covers(flat: &[[f64; 2]], [a, b, c]: [usize; 3], p: usize) -> bool {
    let (a, b, c, p) = (flat[a], flat[b], flat[c], flat[p]);
    cross(a, b, p) >= 0.0 && cross(b, c, p) >= 0.0 && cross(c, a, p) >= 0.0
}
