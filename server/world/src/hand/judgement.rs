//! The posed hand: judgement points and segments in world space (Funahashi et al. 1998, §3.1).

use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

use super::joint::{Finger, JointId, N_JOINTS, POINTS_PER_FINGER};
use super::kinematics::forward;
use super::part::{N_METACARPALS, PartLayout};
use super::prism::PrismAxes;
use super::sample::{FingerPose, HandSample};
use super::skeleton::HandModel;

/// One hand's judgement points and segments at one time, in world space, ordered as [`PartLayout`] says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PosedHand {
    /// `world_from_wrist`.
    pub wrist: Isometry3<f64>,
    /// The judgement points, metres: twenty joints, then the palm's if it has contacts.
    pub points: Vec<Point3<f64>>,
    /// Whether each point exists. A joint that was never tracked has none; its place is then the wrist's.
    pub point_valid: Vec<bool>,
    /// The judgement segments, metres: the ridges of each link's prism.
    pub segments: Vec<[Point3<f64>; 2]>,
    /// Whether each segment exists: both ends of its link do.
    pub segment_valid: Vec<bool>,
}

/// Where each joint was last seen, in the wrist's space; what a joint that is not tracked now falls back on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointMemory {
    /// Metres in the wrist's space; `None` for a joint that was never tracked.
    pub places: [Option<Point3<f64>>; N_JOINTS],
}

/// Palm points and the metacarpals' near ends, as shares of the way from the wrist to the knuckle.
const PALM_STEPS: [f64; 2] = [0.35, 0.7];

impl Default for PosedHand {
    fn default() -> Self {
        Self {
            wrist: Isometry3::identity(),
            points: Vec::new(),
            point_valid: Vec::new(),
            segments: Vec::new(),
            segment_valid: Vec::new(),
        }
    }
}

impl PosedHand {
    /// A finger's four judgement points in world space, if all exist.
    pub fn finger_points(&self, finger: Finger) -> Option<[Point3<f64>; POINTS_PER_FINGER]> {
        let start = JointId::of(finger, 0).index();
        let all = self
            .point_valid
            .get(start..start + POINTS_PER_FINGER)?
            .iter()
            .all(|valid| *valid);
        all.then(|| std::array::from_fn(|step| self.points[start + step]))
    }

    /// Becomes a copy of another, in the memory that it has.
    pub fn copy_from(&mut self, other: &Self) {
        self.wrist = other.wrist;
        self.points.clone_from(&other.points);
        self.point_valid.clone_from(&other.point_valid);
        self.segments.clone_from(&other.segments);
        self.segment_valid.clone_from(&other.segment_valid);
    }

    /// Replaces a finger's four points and the ridges around them: how the shown hand differs from the tracked one.
    /// `points` are in world space, metres. Parts of the palm stay.
    pub fn set_finger(
        &mut self,
        model: &HandModel,
        finger: Finger,
        points: &[Point3<f64>; POINTS_PER_FINGER],
    ) {
        let layout = PartLayout::of(model);
        let range = layout.points_of(finger);
        self.point_valid[range.clone()].fill(true);
        self.points[range].copy_from_slice(points);
        let segments = layout.segments_of(finger);
        self.segment_valid[segments.clone()].fill(true);
        let axes = PrismAxes::new(model.side, &self.wrist.rotation, model.prism_sides);
        let mut slots = self.segments[segments].iter_mut();
        axes.finger_ridges(
            finger,
            points,
            &model.skeleton.finger(finger).radii,
            |ridge| {
                if let Some(slot) = slots.next() {
                    *slot = ridge;
                }
            },
        );
    }
}

/// Poses a hand: fills `out` with its judgement points and segments for one finite sample.
///
/// `memory` belongs to this one hand and goes from sample to sample. Nothing is allocated once `out` has been filled
/// with the same model before.
pub fn pose_hand(
    model: &HandModel,
    sample: &HandSample,
    memory: &mut JointMemory,
    out: &mut PosedHand,
) {
    out.wrist = sample.wrist;
    out.points.clear();
    out.point_valid.clear();
    out.segments.clear();
    out.segment_valid.clear();
    push_joints(model, sample, memory, out);
    let axes = PrismAxes::new(model.side, &sample.wrist.rotation, model.prism_sides);
    push_finger_ridges(model, &axes, out);
    if model.palm_contacts {
        push_palm(model, &axes, out);
    }
}

fn push_joints(
    model: &HandModel,
    sample: &HandSample,
    memory: &mut JointMemory,
    out: &mut PosedHand,
) {
    match &sample.fingers {
        FingerPose::Angles(angles) => {
            for (place, point) in
                memory
                    .places
                    .iter_mut()
                    .zip(forward(&model.skeleton, model.side, angles))
            {
                *place = Some(point);
                out.points.push(sample.wrist * point);
                out.point_valid.push(true);
            }
        }
        FingerPose::Points(points) => {
            for (place, tracked) in memory.places.iter_mut().zip(points) {
                if let Some(point) = tracked {
                    *place = Some(sample.wrist.inverse_transform_point(point));
                }
                // A tracked point stays exactly as it came; only a remembered one is computed.
                let known = tracked.or_else(|| place.map(|p| sample.wrist * p));
                out.points
                    .push(known.unwrap_or_else(|| Point3::from(sample.wrist.translation.vector)));
                out.point_valid.push(known.is_some());
            }
        }
    }
}

fn push_finger_ridges(model: &HandModel, axes: &PrismAxes, out: &mut PosedHand) {
    for finger in Finger::ALL {
        let radii = &model.skeleton.finger(finger).radii;
        let mut direction = axes.forward();
        for (link, radius) in radii.iter().enumerate() {
            let near = JointId::of(finger, link).index();
            let valid = out.point_valid[near] && out.point_valid[near + 1];
            let ends = [out.points[near], out.points[near + 1]];
            let segments = &mut out.segments;
            let segment_valid = &mut out.segment_valid;
            direction = axes.ridges(finger, ends, *radius, &direction, |ridge| {
                segments.push(ridge);
                segment_valid.push(valid);
            });
        }
    }
}

/// The palm follows the four knuckles: points along each metacarpal, and a prism around it.
fn push_palm(model: &HandModel, axes: &PrismAxes, out: &mut PosedHand) {
    let wrist = Point3::from(out.wrist.translation.vector);
    for finger in &Finger::ALL[1..=N_METACARPALS] {
        let knuckle = JointId::of(*finger, 0).index();
        for step in PALM_STEPS {
            out.points
                .push(wrist + (out.points[knuckle] - wrist) * step);
            out.point_valid.push(out.point_valid[knuckle]);
        }
    }
    for finger in &Finger::ALL[1..=N_METACARPALS] {
        let knuckle = JointId::of(*finger, 0).index();
        let (end, valid) = (out.points[knuckle], out.point_valid[knuckle]);
        let start = wrist + (end - wrist) * PALM_STEPS[0];
        let radius = model.skeleton.finger(*finger).radii[0];
        let segments = &mut out.segments;
        let segment_valid = &mut out.segment_valid;
        axes.ridges(*finger, [start, end], radius, &axes.forward(), |ridge| {
            segments.push(ridge);
            segment_valid.push(valid);
        });
    }
}

#[cfg(test)]
#[path = "judgement_tests.rs"]
mod tests;
