//! Events with names and reasons, one shape for JSON, tables and CSV.

use nalgebra::{Point3, Vector3};
use serde::Serialize;
use serde_json::{Map, Value, json};
use tsukamu_world::World;
use tsukamu_world::frame::{Event, EventKind, Feature, GraspNormal, ReleaseReason, Support};

use super::names::NameBook;

/// One event as it is shown outside.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EventRecord {
    /// The step that it happened in.
    pub tick: u64,
    /// World time of that step, in seconds.
    pub time_s: f64,
    /// Name of the object it happened to.
    pub object: Option<String>,
    /// Name of the hand that did it.
    pub hand: Option<String>,
    /// What happened, e.g. `grasped`.
    pub kind: &'static str,
    /// Why, as one word, e.g. `contacts_gone`.
    pub reason: String,
    /// The numbers behind it: metres, radians, seconds; world space unless the name says otherwise.
    #[serde(flatten)]
    pub details: Map<String, Value>,
}

/// The events of the world's last step.
pub fn events_of_step(world: &World, names: &NameBook) -> Vec<EventRecord> {
    let frame = world.frame();
    let record = |event: &Event| {
        let (reason, details) = explain(event, world, names);
        EventRecord {
            tick: frame.tick,
            time_s: frame.time_s,
            object: event.object.map(|id| names.object(id)),
            hand: event.hand.map(|id| names.hand(id)),
            kind: event.kind.name(),
            reason: reason.to_owned(),
            details,
        }
    };
    frame.events.iter().map(record).collect()
}

/// The reason and the numbers of an event.
fn explain(event: &Event, world: &World, names: &NameBook) -> (&'static str, Map<String, Value>) {
    let (reason, details) = match &event.kind {
        EventKind::ContactBegan { .. } | EventKind::ContactEnded { .. } => {
            explain_contact(event, world, names)
        }
        EventKind::Pushed { n_contacts } => {
            let reason = if *n_contacts == 1 {
                "one_contact"
            } else {
                "several_contacts"
            };
            (reason, json!({ "n_contacts": n_contacts }))
        }
        EventKind::Grasped { normals, angle } => {
            let normals = normals
                .each_ref()
                .map(|normal| grasp_normal(normal, world, names));
            (
                "angle_reached",
                json!({ "angle_rad": angle, "normals": normals }),
            )
        }
        EventKind::Released { reason } => (reason.name(), released(*reason)),
        EventKind::Thrown { velocity } => ("let_go_moving", moving(velocity)),
        EventKind::Landed { velocity } => ("floor", moving(velocity)),
        EventKind::Toppled { case } => (toppled(*case), json!({ "case": case })),
        EventKind::Rested { on: Support::Floor } => ("floor", json!({})),
        EventKind::Rested {
            on: Support::Object(id),
        } => ("object", json!({ "on": names.object(*id) })),
        EventKind::Blocked { by } => ("object", json!({ "by": names.object(*by) })),
        EventKind::HitTarget { target, distance } => {
            let name = world
                .scene()
                .targets
                .get(*target as usize)
                .map(|target| target.name.as_str());
            (
                "centre_passed",
                json!({ "target": name, "distance": distance }),
            )
        }
        EventKind::HandLost => ("no_valid_sample", json!({})),
        EventKind::HandFound => ("valid_sample", json!({})),
        EventKind::ObjectAdded | EventKind::ObjectRemoved | EventKind::Reset => {
            ("command", json!({}))
        }
    };
    let Value::Object(details) = details else {
        return (reason, Map::new());
    };
    (reason, details)
}

fn explain_contact(event: &Event, world: &World, names: &NameBook) -> (&'static str, Value) {
    let part = |part| names.part(world, event.hand, part);
    match &event.kind {
        EventKind::ContactBegan {
            part: touching,
            feature: touched,
            point,
        } => (
            how(*touched),
            json!({ "part": part(*touching), "feature": feature(*touched), "point": place(point) }),
        ),
        EventKind::ContactEnded {
            part: touching,
            feature: touched,
        } => (
            how(*touched),
            json!({ "part": part(*touching), "feature": feature(*touched) }),
        ),
        _ => ("contact", json!({})),
    }
}

const fn toppled(case: u8) -> &'static str {
    match case {
        1 => "one_vertex",
        2 => "two_vertices",
        _ => "three_or_more_vertices",
    }
}

const fn how(touched: Feature) -> &'static str {
    match touched {
        Feature::Face(_) => "point_on_face",
        Feature::Edge(_) => "segment_on_edge",
    }
}

fn feature(touched: Feature) -> Value {
    match touched {
        Feature::Face(face) => json!({ "face": face }),
        Feature::Edge(edge) => json!({ "edge": edge }),
    }
}

fn grasp_normal(normal: &GraspNormal, world: &World, names: &NameBook) -> Value {
    json!({
        "hand": names.hand(normal.hand),
        "part": names.part(world, Some(normal.hand), normal.part),
        "feature": feature(normal.feature),
        "normal_in_object": <[f64; 3]>::from(normal.normal),
    })
}

fn released(reason: ReleaseReason) -> Value {
    match reason {
        ReleaseReason::AngleFell { angle, threshold } => {
            json!({ "angle_rad": angle, "threshold_rad": threshold })
        }
        ReleaseReason::ContactsGone | ReleaseReason::TrackingLost | ReleaseReason::Command => {
            json!({})
        }
    }
}

fn moving(velocity: &Vector3<f64>) -> Value {
    json!({ "velocity": <[f64; 3]>::from(*velocity), "speed": velocity.norm() })
}

fn place(point: &Point3<f64>) -> [f64; 3] {
    [point.x, point.y, point.z]
}
