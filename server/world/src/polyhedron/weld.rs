//! Making one vertex of vertices at one place: STL names every triangle's corners anew.

use nalgebra::Point3;

/// The distinct points, and for each given point the index of the one that stands for it.
///
/// Two points not farther apart than `tolerance` (metres, same space) become one, the first given; the result does
/// not depend on anything else. Points that are not finite stay themselves (a shape made of them is refused later).
pub fn weld(vertices: &[Point3<f64>], tolerance: f64) -> (Vec<Point3<f64>>, Vec<u32>) {
    // Sweep along x: only points within `tolerance` in x can be one.
    let mut by_x: Vec<u32> = (0..vertices.len() as u32).collect();
    by_x.sort_unstable_by(|&i, &j| {
        vertices[i as usize]
            .x
            .total_cmp(&vertices[j as usize].x)
            .then(i.cmp(&j))
    });
    let mut place = vec![0_usize; vertices.len()];
    for (k, &i) in by_x.iter().enumerate() {
        place[i as usize] = k;
    }
    let mut stands_for: Vec<Option<u32>> = vec![None; vertices.len()];
    let mut kept = Vec::new();
    for (i, p) in vertices.iter().enumerate() {
        if stands_for[i].is_some() {
            continue;
        }
        let id = kept.len() as u32;
        kept.push(*p);
        stands_for[i] = Some(id);
        let mut take = |j: u32| {
            let q = &vertices[j as usize];
            let near_x = (q.x - p.x).abs() <= tolerance;
            if near_x
                && stands_for[j as usize].is_none()
                && (q - p).norm_squared() <= tolerance * tolerance
            {
                stands_for[j as usize] = Some(id);
            }
            near_x
        };
        let _ = by_x[place[i] + 1..].iter().all(|&j| take(j));
        let _ = by_x[..place[i]].iter().rev().all(|&j| take(j));
    }
    // Every point was either kept or taken above.
    (kept, stands_for.into_iter().flatten().collect())
}
