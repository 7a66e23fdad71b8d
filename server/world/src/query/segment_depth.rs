//! How deep a segment goes into a solid.

use nalgebra::{Point3, Vector3};

use super::clip::height;
use super::is_few_planes;
use super::point::signed_distance;
use crate::polyhedron::Polyhedron;

/// Share of the segment's length by which the depth in a shape that is not convex may be found too small.
const RESOLUTION: f64 = 1.0 / 256.0;
/// Most halvings of a segment: as many as the resolution needs, and one.
const MAX_HALVINGS: usize = 9;
/// Steps of the golden section that sharpens the found depth.
const SHARPENINGS: usize = 12;
/// Most lines of a convex shape's depth tried; each try excludes one plane for good, so it ends by itself.
const MAX_TRIES: usize = 128;

/// The deepest place of a segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deepest {
    /// Depth in metres; negative outside.
    pub(super) depth: f64,
    /// Fraction of the segment.
    pub(super) fraction: f64,
    /// From that place to the surface point nearest to it (below planes: the foot on the nearest plane). Its length
    /// is the depth, except outside.
    pub(super) way_out: Vector3<f64>,
}

/// The largest depth inside the solid, in metres, of any point of the segment; 0 or less if it stays outside (how much
/// less is only a bound).
///
/// Exact for convex shapes. For others found by halving: depth changes at most as fast as place, so parts that cannot
/// be deeper are dropped; the answer is at most 1/256 of the segment's length too small, in practice much less.
pub fn max_depth_on_segment(shape: &Polyhedron, a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    deepest_on_segment(shape, a, b, 0.0).depth
}

/// The same where only depths above `floor` metres (0 or more) matter: `floor` for a segment that goes no deeper,
/// which is found out much sooner.
pub fn max_depth_above(shape: &Polyhedron, a: &Point3<f64>, b: &Point3<f64>, floor: f64) -> f64 {
    let stays_above = |plane: &[f64; 4]| height(plane, a) >= -floor && height(plane, b) >= -floor;
    if is_few_planes(shape) && shape.planes().iter().any(stays_above) {
        return floor;
    }
    deepest_on_segment(shape, a, b, floor).depth.max(floor)
}

/// See [`max_depth_on_segment`]. Depths up to `floor` metres (0 or more) need not be told apart.
pub(super) fn deepest_on_segment(
    shape: &Polyhedron,
    a: &Point3<f64>,
    b: &Point3<f64>,
    floor: f64,
) -> Deepest {
    if is_few_planes(shape) {
        return deepest_below_planes(shape.planes(), a, b);
    }
    deepest_by_halving(shape, a, b, floor)
}

/// Depth under one plane along the segment: `start + slope · fraction`.
#[derive(Clone, Copy)]
struct Line {
    start: f64,
    slope: f64,
    face: u32,
}

impl Line {
    fn at(&self, fraction: f64) -> f64 {
        self.start + self.slope * fraction
    }
}

/// The least of all lines at a fraction; of equal ones, the one least on the side that `toward` leans to.
fn lowest(
    planes: &[[f64; 4]],
    a: &Point3<f64>,
    b: &Point3<f64>,
    fraction: f64,
    toward: f64,
) -> Line {
    let mut best = (
        f64::INFINITY,
        Line {
            start: 0.0,
            slope: 0.0,
            face: 0,
        },
    );
    for (face, plane) in (0_u32..).zip(planes) {
        let start = -height(plane, a);
        let line = Line {
            start,
            slope: -height(plane, b) - start,
            face,
        };
        let depth = line.at(fraction);
        if depth < best.0 || (depth == best.0 && (line.slope - best.1.slope) * toward < 0.0) {
            best = (depth, line);
        }
    }
    best.1
}

/// The lower envelope of the planes' lines is concave: cut in from both ends until the cut is on it (Kelley 1960).
fn deepest_below_planes(planes: &[[f64; 4]], a: &Point3<f64>, b: &Point3<f64>) -> Deepest {
    let result = |line: &Line, fraction: f64| {
        let (depth, [x, y, z, _]) = (line.at(fraction), planes[line.face as usize]);
        Deepest {
            depth,
            fraction,
            way_out: Vector3::new(x, y, z) * depth,
        }
    };
    let mut rising = lowest(planes, a, b, 0.0, 1.0);
    if rising.slope <= 0.0 {
        return result(&rising, 0.0);
    }
    let mut falling = lowest(planes, a, b, 1.0, -1.0);
    if falling.slope >= 0.0 {
        return result(&falling, 1.0);
    }
    for _ in 0..MAX_TRIES {
        let fraction =
            ((falling.start - rising.start) / (rising.slope - falling.slope)).clamp(0.0, 1.0);
        let line = lowest(planes, a, b, fraction, 1.0);
        let bound = rising.at(fraction);
        if line.slope == 0.0
            || line.at(fraction) >= bound
            || [rising.face, falling.face].contains(&line.face)
        {
            return result(&line, fraction);
        }
        if line.slope > 0.0 {
            rising = line;
        } else {
            falling = line;
        }
    }
    let fraction =
        ((falling.start - rising.start) / (rising.slope - falling.slope)).clamp(0.0, 1.0);
    result(&lowest(planes, a, b, fraction, 1.0), fraction)
}

fn deepest_by_halving(shape: &Polyhedron, a: &Point3<f64>, b: &Point3<f64>, floor: f64) -> Deepest {
    let along = b - a;
    let length = along.norm();
    let sample = |fraction: f64| {
        let place = a + along * fraction;
        let found = signed_distance(shape, &place);
        Deepest {
            depth: -found.distance,
            fraction,
            way_out: found.on_surface - place,
        }
    };
    let deeper = |a: Deepest, b: Deepest| if b.depth > a.depth { b } else { a };
    let ends = (sample(0.0), sample(1.0));
    let mut best = deeper(ends.0, ends.1);
    let mut stack = [ends; MAX_HALVINGS + 2];
    let mut height = 1;
    while height > 0 {
        height -= 1;
        let (left, right) = stack[height];
        let width = (right.fraction - left.fraction) * length;
        let bound = 0.5 * (left.depth + right.depth + width);
        if bound <= best.depth.max(floor) + RESOLUTION * length || height + 2 > stack.len() {
            continue;
        }
        let middle = sample(0.5 * (left.fraction + right.fraction));
        best = deeper(best, middle);
        stack[height] = (left, middle);
        stack[height + 1] = (middle, right);
        height += 2;
    }
    // Golden section around the best.
    let golden = (5.0_f64.sqrt() - 1.0) * 0.5;
    let reach = 2.0 * RESOLUTION;
    let (mut lo, mut hi) = (
        (best.fraction - reach).max(0.0),
        (best.fraction + reach).min(1.0),
    );
    let is_worth_it = best.depth > floor - RESOLUTION * length;
    for _ in 0..if is_worth_it { SHARPENINGS } else { 0 } {
        let width = (hi - lo) * golden;
        let (left, right) = (sample(hi - width), sample(lo + width));
        best = deeper(deeper(best, left), right);
        if left.depth >= right.depth {
            hi = right.fraction;
        } else {
            lo = left.fraction;
        }
    }
    best
}
