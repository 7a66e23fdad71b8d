use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use tsukamu_client::view::{HandView, WorldView, isometry};
use tsukamu_proto::v1::{Object, Scene, Tracking};

use super::canvas::Canvas;
use super::tables::colour_of;

/// How the camera looks down, radians: enough to see the floor as a floor.
const PITCH: f64 = 0.35;
/// How the camera stands to the side, radians: enough to see boxes as boxes.
const YAW: f64 = 0.45;
/// Edges that are drawn at most; more would be a blot, and take the time of a redraw.
const MAX_EDGES: usize = 20_000;
/// Room around the objects' start, metres.
const ROOM: f64 = 0.1;
/// How fast the picture closes in again, per redraw.
const CLOSING: f64 = 0.02;
/// How far to each side the picture may grow, in sizes of its start.
const MAX_GROWTH: f64 = 1.5;
/// Colour of a hand, and of one that holds.
const HAND: [u8; 3] = [235, 200, 170];
const HOLDING_HAND: [u8; 3] = [140, 230, 140];
/// Colour of the floor and of a target.
const FLOOR: [u8; 3] = [80, 80, 80];
const TARGET: [u8; 3] = [220, 90, 200];
/// Lines of the floor's grid to either side of its middle.
const GRID: i32 = 2;
/// Between two of them, metres.
const GRID_STEP: f64 = 0.2;

/// The box in the camera's plane that the picture shows, metres: left, right, lower, upper.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Fit {
    start: [f64; 4],
    now: [f64; 4],
    /// Where the floor's grid stands, world space.
    floor: Point3<f64>,
}

impl Fit {
    /// Everything that the scene starts with.
    pub(super) fn of_scene(scene: &Scene) -> Self {
        let poses = scene
            .objects
            .iter()
            .filter_map(|object| object.pose.as_ref().and_then(isometry));
        let mut points: Vec<Point3<f64>> = poses
            .map(|pose| Point3::from(pose.translation.vector))
            .collect();
        let middle = points
            .iter()
            .map(|point| point.coords)
            .sum::<Vector3<f64>>()
            / points.len().max(1) as f64;
        let floor = Point3::new(middle.x, scene.floor_height, middle.z);
        for target in &scene.targets {
            let centre = target
                .centre
                .map_or_else(Point3::origin, |p| Point3::new(p.x, p.y, p.z));
            let reach = [-target.radius, target.radius];
            points.extend(
                reach
                    .iter()
                    .flat_map(|r| [centre + Vector3::x() * *r, centre + Vector3::y() * *r]),
            );
        }
        let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
        points.extend(
            corners.map(|[x, z]| floor + Vector3::new(x, 0.0, z) * GRID_STEP * f64::from(GRID)),
        );
        let mut start = bounds(points.iter());
        for (side, value) in start.iter_mut().enumerate() {
            *value += if side % 2 == 0 { -ROOM } else { ROOM };
        }
        Self {
            start,
            now: start,
            floor,
        }
    }

    /// Opens at once to what moves, closes in slowly.
    fn follow(&mut self, view: &WorldView) {
        let objects = view.objects.values().filter(|object| !object.resting);
        let mut points: Vec<Point3<f64>> = objects
            .map(|object| Point3::from(object.pose.translation.vector))
            .collect();
        points.extend(
            view.hands
                .iter()
                .filter(|hand| is_there(hand))
                .flat_map(|hand| hand.shown.iter().flatten()),
        );
        let wanted = if points.is_empty() {
            self.start
        } else {
            union(self.start, bounds(points.iter()))
        };
        for side in 0..4 {
            let outward = if side % 2 == 0 { -1.0 } else { 1.0 };
            let most =
                (self.start[1] - self.start[0]).max(self.start[3] - self.start[2]) * MAX_GROWTH;
            let limit = self.start[side] + outward * most;
            let wanted = if outward > 0.0 {
                wanted[side].min(limit)
            } else {
                wanted[side].max(limit)
            };
            let opens = (wanted - self.now[side]) * outward > 0.0;
            self.now[side] += (wanted - self.now[side]) * if opens { 1.0 } else { CLOSING };
        }
    }
}

/// Floor, objects and hands as lines, seen from the front, from above and from the left.
pub(super) fn picture(
    scene: &Scene,
    view: &WorldView,
    fit: &mut Fit,
    width: usize,
    height: usize,
) -> Vec<String> {
    fit.follow(view);
    let mut pen = Pen::new(Canvas::new(width, height), fit.now);
    draw_floor(&mut pen, fit.floor);
    for target in &scene.targets {
        draw_target(&mut pen, target);
    }
    let mut n_edges = 0;
    for object in &scene.objects {
        let Some(shown) = view.objects.get(&object.id) else {
            continue;
        };
        n_edges += object
            .shape
            .as_ref()
            .map_or(0, |shape| shape.edges.len() / 2);
        if n_edges > MAX_EDGES {
            break;
        }
        draw_object(&mut pen, object, &shown.pose);
    }
    for hand in view.hands.iter().filter(|hand| is_there(hand)) {
        draw_hand(&mut pen, hand);
    }
    pen.canvas.lines()
}

/// Draws world-space lines on the canvas.
struct Pen {
    canvas: Canvas,
    middle: [f64; 2],
    dots_per_metre: f64,
}

impl Pen {
    fn new(canvas: Canvas, [left, right, lower, upper]: [f64; 4]) -> Self {
        let (width, height) = canvas.size_dots();
        let dots_per_metre =
            (width / (right - left).max(1e-3)).min(height / (upper - lower).max(1e-3));
        Self {
            canvas,
            middle: [(left + right) / 2.0, (lower + upper) / 2.0],
            dots_per_metre,
        }
    }

    fn line(&mut self, from: &Point3<f64>, to: &Point3<f64>, colour: [u8; 3]) {
        let (from, to) = (self.dot(from), self.dot(to));
        self.canvas.line(from, to, Some(colour));
    }

    fn dot(&self, point: &Point3<f64>) -> [f64; 2] {
        let [x, y] = seen(point);
        let (width, height) = self.canvas.size_dots();
        [
            width / 2.0 + (x - self.middle[0]) * self.dots_per_metre,
            height / 2.0 - (y - self.middle[1]) * self.dots_per_metre,
        ]
    }
}

fn draw_floor(pen: &mut Pen, floor: Point3<f64>) {
    let reach = GRID_STEP * f64::from(GRID);
    for n in -GRID..=GRID {
        let offset = GRID_STEP * f64::from(n);
        let across = Vector3::new(reach, 0.0, offset);
        let along = Vector3::new(offset, 0.0, reach);
        pen.line(
            &(floor + Vector3::new(-across.x, 0.0, across.z)),
            &(floor + across),
            FLOOR,
        );
        pen.line(
            &(floor + Vector3::new(along.x, 0.0, -along.z)),
            &(floor + along),
            FLOOR,
        );
    }
}

fn draw_target(pen: &mut Pen, target: &tsukamu_proto::v1::Target) {
    let (Some(centre), Some(normal)) = (target.centre, target.normal) else {
        return;
    };
    let centre = Point3::new(centre.x, centre.y, centre.z);
    let normal = Vector3::new(normal.x, normal.y, normal.z);
    let Some(turn) = UnitQuaternion::rotation_between(&Vector3::z(), &normal) else {
        return;
    };
    let at = |n: u32| {
        let angle = f64::from(n) * std::f64::consts::TAU / 24.0;
        centre + turn * Vector3::new(angle.cos(), angle.sin(), 0.0) * target.radius
    };
    for n in 0..24 {
        pen.line(&at(n), &at(n + 1), TARGET);
    }
}

fn draw_object(pen: &mut Pen, object: &Object, world_from_object: &Isometry3<f64>) {
    let Some(shape) = &object.shape else { return };
    let vertex = |index: u32| {
        let xyz = shape.vertices.chunks_exact(3).nth(index as usize)?;
        Some(world_from_object * Point3::new(xyz[0], xyz[1], xyz[2]))
    };
    let colour = colour_of(&object.colour);
    for edge in shape.edges.chunks_exact(2) {
        if let (Some(from), Some(to)) = (vertex(edge[0]), vertex(edge[1])) {
            pen.line(&from, &to, colour);
        }
    }
}

/// Each finger from the wrist to its tip.
fn draw_hand(pen: &mut Pen, hand: &HandView) {
    let colour = if hand.holds.is_some() {
        HOLDING_HAND
    } else {
        HAND
    };
    let wrist = Point3::from(hand.wrist.translation.vector);
    for finger in hand.shown.chunks(4) {
        let mut from = wrist;
        for joint in finger.iter().flatten() {
            pen.line(&from, joint, colour);
            from = *joint;
        }
    }
}

fn is_there(hand: &HandView) -> bool {
    matches!(hand.tracking, Tracking::Tracked | Tracking::Held)
}

/// Where the camera sees a point, metres: right and up.
fn seen(point: &Point3<f64>) -> [f64; 2] {
    let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PITCH)
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), YAW)
        * point;
    [turned.x, turned.y]
}

fn bounds<'a>(points: impl Iterator<Item = &'a Point3<f64>>) -> [f64; 4] {
    let empty = [
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    points
        .map(seen)
        .fold(empty, |b, [x, y]| union(b, [x, x, y, y]))
}

fn union(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0].min(b[0]),
        a[1].max(b[1]),
        a[2].min(b[2]),
        a[3].max(b[3]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_looks_from_the_front_and_above() {
        let [x, y] = seen(&Point3::new(1.0, 0.0, 0.0));
        assert!(x > 0.8 && y.abs() < 0.2, "right is right: {x} {y}");
        let [x, y] = seen(&Point3::new(0.0, 1.0, 0.0));
        assert!(x.abs() < 1e-12 && y > 0.9, "up is up: {x} {y}");
        let [_, far] = seen(&Point3::new(0.0, 0.0, -1.0));
        assert!(
            far > 0.2,
            "farther along the floor is higher in the picture: {far}"
        );
    }

    #[test]
    fn the_fit_opens_at_once_and_closes_slowly() {
        let mut fit = Fit::of_scene(&Scene::default());
        let start = fit.now;
        let mut view = WorldView::default();
        let far = tsukamu_client::view::ObjectView {
            pose: Isometry3::translation(0.0, 0.5, 0.0),
            state: tsukamu_proto::v1::ContactState::Free,
            resting: false,
            holder: None,
        };
        view.objects.insert(1, far);
        fit.follow(&view);
        assert!(fit.now[3] > start[3] + 0.1);
        let open = fit.now[3];
        view.objects.clear();
        fit.follow(&view);
        assert!(fit.now[3] < open && fit.now[3] > start[3] + 0.1);
        view.objects.insert(
            1,
            tsukamu_client::view::ObjectView {
                pose: Isometry3::translation(0.0, 1e6, 0.0),
                ..far
            },
        );
        fit.follow(&view);
        assert!(
            fit.now[3] < start[3] + 2.0,
            "a lost object does not make the rest invisible"
        );
    }
}
