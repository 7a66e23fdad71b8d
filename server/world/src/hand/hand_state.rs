//! One hand of the world, from step to step.

use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

use super::joint::{Finger, N_FINGERS, N_JOINTS};
use super::judgement::{JointMemory, PosedHand, pose_hand};
use super::retract::{FingerLinks, OpeningPath};
use super::sample::HandSample;
use super::skeleton::HandModel;
use crate::frame::Tracking;
use crate::polyhedron::aabb::Aabb;
use crate::state::HandId;

/// One hand of the world.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HandState {
    /// Its name in the world.
    pub id: HandId,
    /// Its shape.
    pub model: HandModel,
    /// Whether it is followed.
    pub tracking: Tracking,
    /// Steps since the last valid sample.
    pub unseen_steps: u64,
    /// Where each joint was last seen.
    pub memory: JointMemory,
    /// How it stands now.
    pub posed: PosedHand,
    /// How it stood at the step before. The same as `posed` in the step in which it is found.
    pub before: PosedHand,
    /// What the shown hand remembers of each finger.
    pub openings: [Opening; N_FINGERS],
    /// Joints as shown, world space, metres.
    pub shown: [Point3<f64>; N_JOINTS],
}

/// What the shown hand remembers of one finger.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Opening {
    /// The path back to the pose in which the finger touched first; `None` while it touches nothing.
    pub path: Option<OpeningPath>,
    /// How far it was opened in the last step.
    pub opening: f64,
}

impl HandState {
    /// A hand that no sample has come for.
    pub fn new(id: HandId, model: HandModel) -> Self {
        Self {
            id,
            model,
            tracking: Tracking::Never,
            unseen_steps: 0,
            memory: JointMemory::default(),
            posed: PosedHand::default(),
            before: PosedHand::default(),
            openings: [Opening::default(); N_FINGERS],
            shown: [Point3::origin(); N_JOINTS],
        }
    }

    /// Takes the sample of this step, or none. Returns what became of the tracking before.
    ///
    /// A sample that is not valid is none. Without a sample for longer than `grace_steps` the hand is lost.
    pub fn advance(&mut self, sample: Option<&HandSample>, grace_steps: u64) -> Tracking {
        let was = self.tracking;
        let Some(sample) = sample.filter(|sample| sample.is_valid()) else {
            self.unseen_steps = self.unseen_steps.saturating_add(1);
            if self.unseen_steps == 1 {
                // It stands still: its last motion must not be taken for this step's.
                self.before.copy_from(&self.posed);
            }
            self.tracking = match was {
                Tracking::Never => Tracking::Never,
                _ if self.unseen_steps > grace_steps => Tracking::Lost,
                _ => Tracking::Held,
            };
            return was;
        };
        self.unseen_steps = 0;
        self.tracking = Tracking::Tracked;
        std::mem::swap(&mut self.posed, &mut self.before);
        pose_hand(&self.model, sample, &mut self.memory, &mut self.posed);
        if !matches!(was, Tracking::Tracked | Tracking::Held) {
            self.before.copy_from(&self.posed);
        }
        was
    }

    /// Whether it can touch anything now.
    pub fn can_touch(&self) -> bool {
        matches!(self.tracking, Tracking::Tracked | Tracking::Held)
    }

    /// `world_from_wrist` now.
    pub fn wrist(&self) -> &Isometry3<f64> {
        &self.posed.wrist
    }

    /// Judgement points that exist now and before: index, now, before. World space, metres.
    pub fn moving_points(&self) -> impl Iterator<Item = (u16, &Point3<f64>, &Point3<f64>)> {
        let valid = self.posed.point_valid.iter().zip(&self.before.point_valid);
        let points = self.posed.points.iter().zip(&self.before.points);
        (0_u16..)
            .zip(points.zip(valid))
            .filter(|(_, (_, (now, before)))| **now && **before)
            .map(|(index, ((now, before), _))| (index, now, before))
    }

    /// Judgement segments that exist now and before: index, now, before. World space, metres.
    pub fn moving_segments(
        &self,
    ) -> impl Iterator<Item = (u16, &[Point3<f64>; 2], &[Point3<f64>; 2])> {
        let valid = self
            .posed
            .segment_valid
            .iter()
            .zip(&self.before.segment_valid);
        let segments = self.posed.segments.iter().zip(&self.before.segments);
        (0_u16..)
            .zip(segments.zip(valid))
            .filter(|(_, (_, (now, before)))| **now && **before)
            .map(|(index, ((now, before), _))| (index, now, before))
    }

    /// A box around everything that the hand sweeps in this step, world space, metres: around its points, grown by
    /// the radius of its thickest part.
    pub fn swept(&self) -> Aabb {
        let radii = self
            .model
            .skeleton
            .fingers
            .iter()
            .flat_map(|bones| bones.radii);
        let reach = radii.fold(self.model.point_radius, f64::max);
        let mut around = Aabb::of([]);
        for (_, now, before) in self.moving_points() {
            around.lo = around.lo.inf(now).inf(before);
            around.hi = around.hi.sup(now).sup(before);
        }
        around.grown(reach)
    }

    /// The links of a finger in the wrist's space, as they stood at the step before.
    pub fn links_before(&self, finger: Finger) -> Option<FingerLinks> {
        let points = self.before.finger_points(finger)?;
        Some(FingerLinks::from_points(
            &points.map(|p| self.before.wrist.inverse_transform_point(&p)),
        ))
    }

    /// The links of a finger in the wrist's space.
    pub fn links(&self, finger: Finger) -> Option<FingerLinks> {
        let points = self.posed.finger_points(finger)?;
        Some(FingerLinks::from_points(
            &points.map(|p| self.posed.wrist.inverse_transform_point(&p)),
        ))
    }
}
