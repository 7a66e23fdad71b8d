//! What one tick shows to the outside: which objects changed, where the hands are, what happened.

use nalgebra::{Isometry3, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::hand::joint::{N_JOINTS, Side};
use crate::hand::part::JudgementPart;
use crate::state::{HandId, ObjectId};

/// What one step publishes. Poses of objects are read from the [`World`](crate::World); the frame says which changed.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// Steps since the start; the first step's frame is 1.
    pub tick: u64,
    /// World time in seconds: tick times step length.
    pub time_s: f64,
    /// Objects whose pose or state differs from the last frame, ascending.
    pub changed: Vec<ObjectId>,
    /// The hands, ascending by id.
    pub hands: Vec<HandFrame>,
    /// What happened in this step, in order.
    pub events: Vec<Event>,
}

/// One hand as one tick shows it.
#[derive(Clone, Debug)]
pub struct HandFrame {
    /// Which hand.
    pub hand: HandId,
    /// Left or right.
    pub side: Side,
    /// Whether it is followed.
    pub tracking: Tracking,
    /// `world_from_wrist`.
    pub wrist: Isometry3<f64>,
    /// Joints as tracked, world space, metres. `None` was never tracked.
    pub tracked: [Option<Point3<f64>>; N_JOINTS],
    /// Joints as shown: fingers opened to the surface of what they touch (model §9).
    pub shown: [Option<Point3<f64>>; N_JOINTS],
    /// The object it holds, if any; the lowest id where it holds several.
    pub holds: Option<ObjectId>,
}

/// Whether a hand is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tracking {
    /// No sample has come yet.
    #[default]
    Never,
    /// A valid sample came for this tick.
    Tracked,
    /// No valid sample came for this tick, but the grace time still runs: the hand stands where it was.
    Held,
    /// The grace time has run out: the hand touches nothing.
    Lost,
}

impl Tracking {
    /// The name in files and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Never => "never",
            Self::Tracked => "tracked",
            Self::Held => "held",
            Self::Lost => "lost",
        }
    }
}

/// One change of state, with its reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The object it happened to, if it is about one.
    pub object: Option<ObjectId>,
    /// The hand that did it, if one did.
    pub hand: Option<HandId>,
    /// What happened.
    pub kind: EventKind,
}

/// Part of an object that a hand touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Feature {
    /// A face, by index in the object's shape; touched by a judgement point.
    Face(u32),
    /// An edge, by index in the object's shape; touched by a judgement segment.
    Edge(u32),
}

/// One of the two normals that make a grasp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspNormal {
    /// Whose contact.
    pub hand: HandId,
    /// Which point or segment of that hand.
    pub part: JudgementPart,
    /// What it touches.
    pub feature: Feature,
    /// Outward unit normal of the face or pseudo-normal of the edge, in the object's space.
    pub normal: Vector3<f64>,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum EventKind {
    /// A judgement point came to a face, or a judgement segment to an edge.
    ContactBegan {
        /// The point or segment.
        part: JudgementPart,
        /// The face or edge.
        feature: Feature,
        /// Contact point on the surface, world space, metres.
        point: Point3<f64>,
    },
    /// That contact is over.
    ContactEnded {
        /// The point or segment.
        part: JudgementPart,
        /// The face or edge.
        feature: Feature,
    },
    /// The object is pushed from now on.
    Pushed {
        /// Contacts that push: one, or several that make no grasp.
        n_contacts: u32,
    },
    /// The object is grasped from now on.
    Grasped {
        /// The two normals that make the largest angle.
        normals: [GraspNormal; 2],
        /// Their angle, in radians.
        angle: f64,
    },
    /// The grasp is over.
    Released {
        /// Why.
        reason: ReleaseReason,
    },
    /// The object left the hand with this velocity.
    Thrown {
        /// In m/s, world space.
        velocity: Vector3<f64>,
    },
    /// The object came from the air to the floor.
    Landed {
        /// Velocity just before, in m/s, world space.
        velocity: Vector3<f64>,
    },
    /// The object begins to topple on the floor.
    Toppled {
        /// 1, 2 or 3: over one vertex, over two, over two of three or more (model §7).
        case: u8,
    },
    /// The object lies still from now on.
    Rested {
        /// What carries it.
        on: Support,
    },
    /// The object stopped because another one is in its way.
    Blocked {
        /// The other one.
        by: ObjectId,
    },
    /// The object passed through a target.
    HitTarget {
        /// Index of the target in the scene.
        target: u32,
        /// Distance from its centre, in metres.
        distance: f64,
    },
    /// A hand has been without a valid sample for longer than the grace time.
    HandLost,
    /// A hand's first valid sample, or the first after it was lost.
    HandFound,
    /// An object was added while running.
    ObjectAdded,
    /// An object was taken out while running.
    ObjectRemoved,
    /// The scene was set back to its start.
    Reset,
}

/// What a resting object lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Support {
    /// The floor.
    Floor,
    /// Another object.
    Object(ObjectId),
}

/// Why a grasp ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReleaseReason {
    /// No contact is left.
    ContactsGone,
    /// Contacts are left, but their largest angle is below the grasp angle.
    AngleFell {
        /// The largest angle left, in radians; 0 with a single contact.
        angle: f64,
        /// The object's grasp angle, in radians.
        threshold: f64,
    },
    /// The hand was lost.
    TrackingLost,
    /// A command said so.
    Command,
}

impl ReleaseReason {
    /// The name that programs read.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ContactsGone => "contacts_gone",
            Self::AngleFell { .. } => "angle_fell",
            Self::TrackingLost => "tracking_lost",
            Self::Command => "command",
        }
    }
}

impl EventKind {
    /// The name that programs read.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::ContactBegan { .. } => "contact_began",
            Self::ContactEnded { .. } => "contact_ended",
            Self::Pushed { .. } => "pushed",
            Self::Grasped { .. } => "grasped",
            Self::Released { .. } => "released",
            Self::Thrown { .. } => "thrown",
            Self::Landed { .. } => "landed",
            Self::Toppled { .. } => "toppled",
            Self::Rested { .. } => "rested",
            Self::Blocked { .. } => "blocked",
            Self::HitTarget { .. } => "hit_target",
            Self::HandLost => "hand_lost",
            Self::HandFound => "hand_found",
            Self::ObjectAdded => "object_added",
            Self::ObjectRemoved => "object_removed",
            Self::Reset => "reset",
        }
    }
}
