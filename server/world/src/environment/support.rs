//! The convex hull of an object's vertices on the floor, and where over it the object can turn
//! (Funahashi et al. 1998, §4.2, Fig. 5 and 6). Everything is in the floor's plane: x and z in metres.

use nalgebra::{Point2, Vector2};

/// How far outside the hull a projection may fall and still be inside it, in metres: rounding of a box that stands
/// exactly over its edge. Larger values would let objects stand that should topple.
const EDGE_M: f64 = 1.0e-9;
/// Corners whose triangle is flatter than this, in m², are on one line.
const COLLINEAR_M2: f64 = 1.0e-14;

/// What an object that stands on the floor does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stance {
    /// G′ is inside the hull: it stands.
    Stable,
    /// It turns about one vertex (cases 1 and 2a).
    OverVertex {
        /// The vertex C.
        vertex: Point2<f64>,
        /// 1, 2 or 3: by the number of contact vertices.
        case: u8,
    },
    /// It turns about the line through two vertices (case 2b).
    OverEdge {
        /// The two vertices.
        ends: [Point2<f64>; 2],
        /// 2 or 3: by the number of contact vertices.
        case: u8,
    },
}

/// Replaces `points` by the corners of their convex hull, counter-clockwise (x to z), without those on its sides.
/// One point or two remain as they are; several on one line leave its two ends. Nothing is allocated beyond `hull`.
pub fn convex_hull(points: &mut Vec<Point2<f64>>, hull: &mut Vec<Point2<f64>>) {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup_by(|a, b| (*a - *b).norm_squared() <= COLLINEAR_M2);
    hull.clear();
    if points.len() > 2 {
        half_hull(points.iter(), hull, 0);
        let lower = hull.len();
        half_hull(points.iter().rev(), hull, lower - 1);
        hull.pop();
        points.clear();
        points.extend_from_slice(hull);
    }
}

/// Andrew's monotone chain (1979): appends one chain; corners before `start` are not its own.
fn half_hull<'a>(
    points: impl Iterator<Item = &'a Point2<f64>>,
    hull: &mut Vec<Point2<f64>>,
    start: usize,
) {
    for point in points {
        while hull.len() >= start + 2
            && turn(&hull[hull.len() - 2], &hull[hull.len() - 1], point) <= COLLINEAR_M2
        {
            hull.pop();
        }
        // The chain's first point is the other chain's last.
        if hull.len() != start + 1 || start == 0 || hull[start] != *point {
            hull.push(*point);
        }
    }
}

/// Twice the signed area of a triangle, in m²; positive counter-clockwise.
fn turn(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}

/// What an object with these contact vertices (the corners of a hull, at least one) does, G projected to `g`.
///
/// 1. One vertex: over it.
/// 2. Two: over the nearer one if G′ is not between the perpendiculars through them, else over their line.
/// 3. Three or more: the two corners nearest to G′ as in 2.
pub fn stance(hull: &[Point2<f64>], g: &Point2<f64>) -> Stance {
    match hull {
        [] => Stance::Stable,
        [vertex] => Stance::OverVertex {
            vertex: *vertex,
            case: 1,
        },
        [a, b] => over_two([*a, *b], g, 2),
        _ if contains(hull, g) => Stance::Stable,
        _ => over_two(nearest_two(hull, g), g, 3),
    }
}

/// The same for three or more vertices over the side of the hull that faces G′: where the two nearest corners are not
/// neighbours, turning over them would press the others into the floor.
pub fn stance_over_side(hull: &[Point2<f64>], g: &Point2<f64>) -> Stance {
    let sides = (0..hull.len()).map(|i| [hull[i], hull[(i + 1) % hull.len()]]);
    let nearest = sides
        .filter(|[a, b]| turn(a, b, g) < 0.0)
        .min_by(|a, b| distance_to_side(a, g).total_cmp(&distance_to_side(b, g)));
    nearest.map_or(Stance::Stable, |side| over_two(side, g, 3))
}

fn over_two(ends: [Point2<f64>; 2], g: &Point2<f64>, case: u8) -> Stance {
    let line = ends[1] - ends[0];
    let along = (g - ends[0]).dot(&line);
    if along < 0.0 {
        Stance::OverVertex {
            vertex: ends[0],
            case,
        }
    } else if along > line.norm_squared() {
        Stance::OverVertex {
            vertex: ends[1],
            case,
        }
    } else {
        Stance::OverEdge { ends, case }
    }
}

fn contains(hull: &[Point2<f64>], g: &Point2<f64>) -> bool {
    (0..hull.len()).all(|i| {
        let (a, b) = (&hull[i], &hull[(i + 1) % hull.len()]);
        turn(a, b, g) >= -EDGE_M * (b - a).norm()
    })
}

fn nearest_two(hull: &[Point2<f64>], g: &Point2<f64>) -> [Point2<f64>; 2] {
    let distance = |index: usize| (hull[index] - g).norm_squared();
    let (mut first, mut second) = if distance(1) < distance(0) {
        (1, 0)
    } else {
        (0, 1)
    };
    for index in 2..hull.len() {
        if distance(index) < distance(first) {
            (first, second) = (index, first);
        } else if distance(index) < distance(second) {
            second = index;
        }
    }
    [hull[first], hull[second]]
}

fn distance_to_side([a, b]: &[Point2<f64>; 2], g: &Point2<f64>) -> f64 {
    let line: Vector2<f64> = b - a;
    let share = ((g - a).dot(&line) / line.norm_squared()).clamp(0.0, 1.0);
    (g - (a + line * share)).norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hull_of(points: &[[f64; 2]]) -> Vec<Point2<f64>> {
        let mut points: Vec<Point2<f64>> = points.iter().map(|p| Point2::from(*p)).collect();
        convex_hull(&mut points, &mut Vec::new());
        points
    }

    #[test]
    fn hulls() {
        let square = hull_of(&[
            [1.0, 1.0],
            [0.0, 0.0],
            [0.5, 0.5],
            [1.0, 0.0],
            [0.5, 0.0],
            [0.0, 1.0],
        ]);
        assert_eq!(
            square,
            hull_of(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        );
        assert_eq!(square.len(), 4);
        assert_eq!(
            hull_of(&[[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]]),
            hull_of(&[[0.0, 0.0], [1.0, 0.0]])
        );
        assert_eq!(hull_of(&[[0.0, 0.0], [0.0, 0.0]]).len(), 1);
        assert_eq!(hull_of(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]).len(), 3);
        assert!(hull_of(&[]).is_empty());
    }

    #[test]
    fn each_case_of_the_floor_by_hand() {
        let p = |x: f64, z: f64| Point2::new(x, z);
        let square = hull_of(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        let check = |hull: &[Point2<f64>], g: Point2<f64>, expected: Stance| {
            assert_eq!(stance(hull, &g), expected, "{g}")
        };
        check(&square, p(0.5, 0.5), Stance::Stable);
        check(&square, p(1.0, 0.5), Stance::Stable);
        check(
            &[p(0.0, 0.0)],
            p(0.3, 0.0),
            Stance::OverVertex {
                vertex: p(0.0, 0.0),
                case: 1,
            },
        );
        let two = [p(0.0, 0.0), p(1.0, 0.0)];
        check(
            &two,
            p(-0.2, 0.4),
            Stance::OverVertex {
                vertex: p(0.0, 0.0),
                case: 2,
            },
        );
        check(
            &two,
            p(1.2, -0.4),
            Stance::OverVertex {
                vertex: p(1.0, 0.0),
                case: 2,
            },
        );
        check(&two, p(0.4, 0.4), Stance::OverEdge { ends: two, case: 2 });
        check(
            &square,
            p(1.5, 0.4),
            Stance::OverEdge {
                ends: [p(1.0, 0.0), p(1.0, 1.0)],
                case: 3,
            },
        );
        check(
            &square,
            p(1.5, -0.4),
            Stance::OverVertex {
                vertex: p(1.0, 0.0),
                case: 3,
            },
        );
    }

    #[test]
    fn the_side_that_faces_g_may_not_have_the_nearest_corners() {
        // A long thin hull. G′ is 0.50 m from (1, 0), 0.57 m from (1, 0.1) and 0.67 m from (0, 0).
        let p = |x: f64, z: f64| Point2::new(x, z);
        let long = hull_of(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.1], [0.0, 0.1]]);
        let g = p(0.6, -0.3);
        assert_eq!(
            stance(&long, &g),
            Stance::OverVertex {
                vertex: p(1.0, 0.0),
                case: 3
            }
        );
        assert_eq!(
            stance_over_side(&long, &g),
            Stance::OverEdge {
                ends: [p(0.0, 0.0), p(1.0, 0.0)],
                case: 3
            }
        );
    }
}
