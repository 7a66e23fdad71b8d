//! The primitives: box, prism, pyramid, L-shape and the ellipsoid of the 1998 experiments.
//!
//! All measures in metres. Each is a [`Polyhedron`] like any mesh, so its origin is its centre of gravity.

use core::f64::consts::PI;

use nalgebra::{Point3, Vector3};

use super::Polyhedron;
use super::fault::ShapeFault;

/// Most sides of a prism.
const MAX_PRISM_SIDES: usize = 1000;
/// Meridians of the ellipsoid.
const N_MERIDIANS: u32 = 8;
/// Parallels of the ellipsoid between its poles.
const N_PARALLELS: u32 = 3;

/// A box with edges of length `size` along the axes.
///
/// # Errors
/// [`ShapeFault::BadMeasure`] unless all lengths are positive and finite; size limits as for any shape.
pub fn cuboid(size: &Vector3<f64>) -> Result<Polyhedron, ShapeFault> {
    positive("the box's width (x)", size.x)?;
    positive("the box's height (y)", size.y)?;
    positive("the box's depth (z)", size.z)?;
    let (x, y) = (size.x * 0.5, size.y * 0.5);
    extrude(&[[-x, -y], [x, -y], [x, y], [-x, y]], size.z)
}

/// A prism on a regular polygon: `sides` corners at distance `radius` from the y axis, the first toward +x;
/// `height` along y.
///
/// # Errors
/// [`ShapeFault::BadMeasure`] for fewer than 3 or more than 1000 sides or lengths that are not positive and finite.
pub fn prism(sides: u32, radius: f64, height: f64) -> Result<Polyhedron, ShapeFault> {
    positive("the prism's radius", radius)?;
    positive("the prism's height", height)?;
    if !(3..=MAX_PRISM_SIDES as u32).contains(&sides) {
        let (name, value) = ("the prism's number of sides", f64::from(sides));
        return Err(ShapeFault::BadMeasure {
            name,
            value,
            bound: "3 to 1000",
        });
    }
    let corner = |k: u32, y: f64| {
        let angle = 2.0 * PI * f64::from(k) / f64::from(sides);
        Point3::new(radius * libm::cos(angle), y, -radius * libm::sin(angle))
    };
    let ring = |y: f64| (0..sides).map(move |k| corner(k, y));
    let vertices: Vec<Point3<f64>> = ring(-height * 0.5).chain(ring(height * 0.5)).collect();
    Polyhedron::from_faces(&vertices, &prism_faces(sides))
}

/// A pyramid: base `base_width` (x) by `base_depth` (z), apex `height` above its middle (+y).
///
/// # Errors
/// [`ShapeFault::BadMeasure`] unless all lengths are positive and finite.
pub fn pyramid(base_width: f64, base_depth: f64, height: f64) -> Result<Polyhedron, ShapeFault> {
    positive("the pyramid's base width (x)", base_width)?;
    positive("the pyramid's base depth (z)", base_depth)?;
    positive("the pyramid's height (y)", height)?;
    let (x, z) = (base_width * 0.5, base_depth * 0.5);
    let vertices = [
        [x, 0.0, z],
        [x, 0.0, -z],
        [-x, 0.0, -z],
        [-x, 0.0, z],
        [0.0, height, 0.0],
    ]
    .map(Point3::from);
    let faces = [
        vec![3, 2, 1, 0],
        vec![0, 1, 4],
        vec![1, 2, 4],
        vec![2, 3, 4],
        vec![3, 0, 4],
    ];
    Polyhedron::from_faces(&vertices, &faces)
}

/// An L: a foot along +x of length `width` and an upright along +y of length `height`, both `thickness` strong,
/// `depth` along z. The notch opens toward +x and +y.
///
/// # Errors
/// [`ShapeFault::BadMeasure`] unless all lengths are positive and finite and the thickness below width and height.
pub fn l_shape(
    width: f64,
    height: f64,
    depth: f64,
    thickness: f64,
) -> Result<Polyhedron, ShapeFault> {
    positive("the L's width (x)", width)?;
    positive("the L's height (y)", height)?;
    positive("the L's depth (z)", depth)?;
    positive("the L's thickness", thickness)?;
    if thickness >= width.min(height) {
        let bound = "less than its width and its height";
        return Err(ShapeFault::BadMeasure {
            name: "the L's thickness",
            value: thickness,
            bound,
        });
    }
    let t = thickness;
    extrude(
        &[
            [0.0, 0.0],
            [width, 0.0],
            [width, t],
            [t, t],
            [t, height],
            [0.0, height],
        ],
        depth,
    )
}

/// The ellipsoid of the 1998 experiments: 8 meridians, 3 parallels and 2 poles (on the y axis) on an ellipsoid with
/// these half axes: 32 faces, 56 edges, 26 vertices.
///
/// # Errors
/// [`ShapeFault::BadMeasure`] unless all half axes are positive and finite.
pub fn ellipsoid(semi_axes: &Vector3<f64>) -> Result<Polyhedron, ShapeFault> {
    positive("the ellipsoid's half axis x", semi_axes.x)?;
    positive("the ellipsoid's half axis y", semi_axes.y)?;
    positive("the ellipsoid's half axis z", semi_axes.z)?;
    let n = N_MERIDIANS;
    let mut vertices = Vec::new();
    for parallel in 1..=N_PARALLELS {
        let polar = PI * f64::from(parallel) / f64::from(N_PARALLELS + 1);
        let (y, r) = (-libm::cos(polar), libm::sin(polar));
        for meridian in 0..n {
            let angle = 2.0 * PI * f64::from(meridian) / f64::from(n);
            vertices.push(Point3::new(r * libm::cos(angle), y, -r * libm::sin(angle)));
        }
    }
    let (south, north) = (N_PARALLELS * n, N_PARALLELS * n + 1);
    vertices.extend([Point3::new(0.0, -1.0, 0.0), Point3::new(0.0, 1.0, 0.0)]);
    vertices
        .iter_mut()
        .for_each(|p| *p = Point3::from(p.coords.component_mul(semi_axes)));
    let mut faces = Vec::new();
    for k in 0..n {
        let l = (k + 1) % n;
        faces.push(vec![south, l, k]);
        for row in (0..N_PARALLELS - 1).map(|p| p * n) {
            faces.push(vec![row + k, row + l, row + n + l, row + n + k]);
        }
        faces.push(vec![
            (N_PARALLELS - 1) * n + k,
            (N_PARALLELS - 1) * n + l,
            north,
        ]);
    }
    Polyhedron::from_faces(&vertices, &faces)
}

fn positive(name: &'static str, value: f64) -> Result<(), ShapeFault> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(ShapeFault::BadMeasure {
        name,
        value,
        bound: "a positive finite number",
    })
}

/// Faces of a prism whose vertices are two rings of `n`, the first below, each counter-clockwise seen from the
/// second's side.
fn prism_faces(n: u32) -> Vec<Vec<u32>> {
    let sides = (0..n)
        .map(|k| (k, (k + 1) % n))
        .map(|(k, l)| vec![k, l, n + l, n + k]);
    [(0..n).rev().collect(), (n..2 * n).collect()]
        .into_iter()
        .chain(sides)
        .collect()
}

/// A counter-clockwise outline in the xy plane, extruded along z around 0.
fn extrude(outline: &[[f64; 2]], depth: f64) -> Result<Polyhedron, ShapeFault> {
    let ring = |z: f64| outline.iter().map(move |&[x, y]| Point3::new(x, y, z));
    let vertices: Vec<Point3<f64>> = ring(-depth * 0.5).chain(ring(depth * 0.5)).collect();
    Polyhedron::from_faces(&vertices, &prism_faces(outline.len() as u32))
}
