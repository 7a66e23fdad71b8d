//! The line under a cloud of points: when things were sent, from when they arrived.
//!
//! A message takes a shortest time to arrive and often longer, never shorter. Plotted over the sender's time, arrivals
//! lie above a line; its slope is the rate of one clock against the other.
//!
//! ```text
//!   arrival |            o         o
//!           |      o  o      o  _,-'     the points that came without waiting lie on the line,
//!           |   o     __,o--'            the others above it
//!           | __,o--''
//!           +----------------------- sender's time
//! ```
//!
//! Moon, Skelly and Towsley, "Estimation and removal of clock skew from network delay measurements" (INFOCOM 1999), find
//! the line by linear programming: below all points, with the least sum of distances to them. That line is the edge of
//! the points' lower convex hull above (or below) their mean: here it is looked up there.

use std::collections::VecDeque;

/// Corners kept of the hull of one bin; random delays make some five.
const CORNERS_MAX: usize = 32;
/// Points until the line is found anew at each of them.
const WARM_UP: u64 = 64;
/// Bins from which their lowest points tell the error; before, it is the spread of all points.
const BINS_MIN: usize = 8;

/// A point: the sender's time in units of its own, and the arrival in ns, both from origins of the caller's choice.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    x: f64,
    y: f64,
}

/// A line through a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    through: Point,
    /// Nanoseconds per unit of the sender's time.
    pub(super) slope: f64,
}

impl Line {
    /// The earliest arrival of what was sent at `x`.
    pub(super) fn at(&self, x: f64) -> f64 {
        self.through.y + self.slope * (x - self.through.x)
    }
}

/// The points of some time, of which only the lower hull is kept.
#[derive(Debug, Clone, Default)]
struct Bin {
    start: f64,
    n: u64,
    sum_x: f64,
    corners: Vec<Point>,
    /// Largest distance of a point above the line of its time, ns.
    spread: f64,
}

/// The lower envelope of the points of the newest bins.
#[derive(Debug, Clone)]
pub(super) struct Envelope {
    bin_ns: f64,
    n_bins_max: usize,
    /// Least and greatest slope, where it is known beforehand.
    limits: Option<(f64, f64)>,
    bins: VecDeque<Bin>,
    line: Option<Line>,
    /// The slope without limits.
    free_slope: Option<f64>,
    error: f64,
    /// Kept for their memory.
    hull: Vec<Point>,
    distances: Vec<f64>,
}

impl Envelope {
    pub(super) fn new(bin_ns: f64, n_bins_max: usize) -> Self {
        Self {
            bin_ns,
            n_bins_max,
            limits: None,
            bins: VecDeque::new(),
            line: None,
            free_slope: None,
            error: 0.0,
            hull: Vec::new(),
            distances: Vec::new(),
        }
    }

    /// Forgets all points; from now on the slope is within the limits.
    pub(super) fn restart(&mut self, limits: Option<(f64, f64)>) {
        *self = Self {
            limits,
            ..Self::new(self.bin_ns, self.n_bins_max)
        };
    }

    /// Whether the slope was known beforehand.
    pub(super) const fn has_limits(&self) -> bool {
        self.limits.is_some()
    }

    /// Drops the limits, and keeps the points.
    pub(super) fn unlimit(&mut self) {
        self.limits = None;
        self.refit();
    }

    /// Takes a point; `x` must not fall.
    pub(super) fn push(&mut self, x: f64, y: f64) {
        let is_new = self
            .bins
            .back()
            .is_none_or(|bin| y >= bin.start + self.bin_ns);
        if is_new {
            if self.bins.len() == self.n_bins_max {
                self.bins.pop_front();
            }
            self.bins.push_back(Bin {
                start: y,
                ..Bin::default()
            });
        }
        let above = self.line.map_or(0.0, |line| y - line.at(x));
        if let Some(bin) = self.bins.back_mut() {
            bin.n += 1;
            bin.sum_x += x;
            bin.spread = bin.spread.max(above);
            add_corner(&mut bin.corners, Point { x, y });
            if bin.corners.len() > CORNERS_MAX {
                let mut is_kept = false;
                bin.corners.retain(|_| {
                    is_kept = !is_kept;
                    is_kept
                });
            }
        }
        if is_new || above < 0.0 || self.line.is_none() || self.n() < WARM_UP {
            self.refit();
        }
    }

    /// The line; `None` while nothing tells its slope.
    pub(super) const fn line(&self) -> Option<Line> {
        self.line
    }

    /// The slope that the points alone have.
    pub(super) const fn free_slope(&self) -> Option<f64> {
        self.free_slope
    }

    /// Points in the window.
    pub(super) fn n(&self) -> u64 {
        self.bins.iter().map(|bin| bin.n).sum()
    }

    /// Bins with points.
    pub(super) fn n_bins(&self) -> usize {
        self.bins.len()
    }

    /// How far the line may be off, ns: three times the distance from it within which nine bins in ten have a point; at the
    /// beginning the distance of all points.
    pub(super) fn error_ns(&self) -> f64 {
        if self.bins.len() < BINS_MIN {
            self.bins.iter().map(|bin| bin.spread).fold(0.0, f64::max)
        } else {
            3.0 * self.error
        }
    }

    fn refit(&mut self) {
        self.hull.clear();
        let (mut n, mut sum_x) = (0, 0.0);
        for bin in &self.bins {
            n += bin.n;
            sum_x += bin.sum_x;
            for corner in &bin.corners {
                add_corner(&mut self.hull, *corner);
            }
        }
        let mean_x = sum_x / n.max(1) as f64;
        self.free_slope = slope_over(&self.hull, mean_x);
        let slope = match (self.free_slope, self.limits) {
            (Some(slope), Some((least, greatest))) => Some(slope.clamp(least, greatest)),
            (None, Some((least, greatest))) => Some((least + greatest) / 2.0),
            (slope, None) => slope,
        };
        self.line = slope.and_then(|slope| {
            let height = |point: &&Point| point.y - slope * point.x;
            let through = *self
                .hull
                .iter()
                .min_by(|a, b| height(a).total_cmp(&height(b)))?;
            Some(Line { through, slope })
        });
        self.error = self.line.map_or(0.0, |line| {
            self.distances.clear();
            let lowest = self.bins.iter().map(|bin| {
                let above = bin.corners.iter().map(|point| point.y - line.at(point.x));
                above.fold(f64::INFINITY, f64::min).max(0.0)
            });
            self.distances.extend(lowest);
            self.distances.sort_by(f64::total_cmp);
            let last = self.distances.len().saturating_sub(1);
            self.distances.get(last * 9 / 10).copied().unwrap_or(0.0)
        });
    }
}

/// Adds a point on the right of a lower hull (Andrew 1979, monotone chain).
fn add_corner(hull: &mut Vec<Point>, point: Point) {
    if let Some(last) = hull.last()
        && point.x <= last.x
    {
        if point.x < last.x || point.y >= last.y {
            return;
        }
        hull.pop();
    }
    while let [.., a, b] = hull.as_slice() {
        let turn = (b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x);
        if turn > 0.0 {
            break;
        }
        hull.pop();
    }
    hull.push(point);
}

/// The slope of the hull's edge at a place; `None` of a single point, or where time stands still.
fn slope_over(hull: &[Point], x: f64) -> Option<f64> {
    if hull.len() < 2 {
        return None;
    }
    let right = hull
        .partition_point(|point| point.x <= x)
        .clamp(1, hull.len() - 1);
    let (a, b) = (hull[right - 1], hull[right]);
    let slope = (b.y - a.y) / (b.x - a.x);
    (slope > 0.0).then_some(slope)
}

#[cfg(test)]
mod tests {
    use super::Envelope;

    #[test]
    fn the_line_lies_under_all_points_and_through_the_quick_ones() {
        let mut envelope = Envelope::new(1.0e9, 64);
        let delay = |k: u64| [3.0e6, 0.0, 7.0e6, 1.0e6, 9.0e6][k as usize % 5];
        for k in 0..1000_u64 {
            envelope.push(k as f64, 1.0e7 * k as f64 + 5.0e6 + delay(k));
        }
        let line = envelope.line().expect("many points");
        assert!((line.slope - 1.0e7).abs() < 1e-3, "{}", line.slope);
        assert!((line.at(500.0) - 5.005e9).abs() < 1.0);
        assert!(envelope.error_ns() < 1.0, "each bin has a quick one");
    }

    #[test]
    fn a_single_point_tells_a_line_only_within_limits() {
        let mut envelope = Envelope::new(1.0e9, 4);
        envelope.push(0.0, 100.0);
        assert_eq!(envelope.line(), None);
        envelope.restart(Some((9.0, 11.0)));
        envelope.push(0.0, 100.0);
        let line = envelope.line().expect("limits");
        assert_eq!((line.slope, line.at(2.0)), (10.0, 120.0));
        envelope.push(1.0, 200.0);
        assert_eq!(envelope.line().map(|line| line.slope), Some(11.0));
        assert_eq!(envelope.free_slope(), Some(100.0));
        envelope.unlimit();
        assert_eq!(envelope.line().map(|line| line.slope), Some(100.0));
    }
}
