//! Changes of state.

use tsukamu_proto::v1;
use tsukamu_proto::v1::contact_feature::Feature as WireFeature;
use tsukamu_proto::v1::event::Kind;
use tsukamu_world::frame::{Event, EventKind, Feature, GraspNormal, ReleaseReason, Support};
use tsukamu_world::hand::part::{JudgementPart, PartLayout};
use tsukamu_world::scene::Target;
use tsukamu_world::state::HandId;

use super::basic::{plus_one, point, vec3};
use super::scene::NamedHand;
use crate::broadcast::inbox::DeviceNews;

/// What an event refers to by number, so that the message can say it by name.
#[derive(Clone, Copy, Debug)]
pub struct Names<'a> {
    /// Hands in the world.
    pub hands: &'a [NamedHand],
    /// Targets of the scene.
    pub targets: &'a [Target],
}

/// An event as a message, without stamp and sequence number. `object_name` is the name of its object, or empty.
pub fn event(event: &Event, object_name: &str, names: Names<'_>) -> v1::Event {
    v1::Event {
        stamp: None,
        sequence: 0,
        object: plus_one(event.object.map(|id| id.to_bits())),
        object_name: object_name.to_owned(),
        hand: event.hand.map_or(0, |hand| hand.0.saturating_add(1)),
        kind: Some(kind(event, names)),
    }
}

fn kind(event: &Event, names: Names<'_>) -> Kind {
    let contact =
        |part: JudgementPart, feature: Feature| Some(names.contact(event.hand, part, feature));
    match &event.kind {
        EventKind::ContactBegan {
            part,
            feature,
            point: at,
        } => Kind::ContactBegan(v1::ContactBegan {
            contact: contact(*part, *feature),
            point: Some(point(at)),
        }),
        EventKind::ContactEnded { part, feature } => Kind::ContactEnded(v1::ContactEnded {
            contact: contact(*part, *feature),
        }),
        EventKind::Pushed { n_contacts } => Kind::Pushed(v1::Pushed {
            n_contacts: *n_contacts,
        }),
        EventKind::Grasped {
            normals: [first, second],
            angle,
        } => Kind::Grasped(v1::Grasped {
            first: Some(names.grasp_normal(first)),
            second: Some(names.grasp_normal(second)),
            angle_rad: *angle,
        }),
        EventKind::Released { reason } => Kind::Released(released(*reason)),
        EventKind::Thrown { velocity } => Kind::Thrown(v1::Thrown {
            velocity: Some(vec3(velocity)),
        }),
        EventKind::Landed { velocity } => Kind::Landed(v1::Landed {
            velocity: Some(vec3(velocity)),
        }),
        EventKind::Toppled { case } => Kind::Toppled(v1::Toppled {
            floor_case: u32::from(*case),
        }),
        EventKind::Rested { on: Support::Floor } => Kind::Rested(v1::Rested { on_object: 0 }),
        EventKind::Rested {
            on: Support::Object(id),
        } => Kind::Rested(v1::Rested {
            on_object: plus_one(Some(id.to_bits())),
        }),
        EventKind::Blocked { by } => Kind::Blocked(v1::Blocked { by: by.to_bits() }),
        EventKind::HitTarget { target, distance } => Kind::HitTarget(v1::HitTarget {
            target: names.target(*target),
            distance: *distance,
        }),
        EventKind::HandLost => Kind::HandLost(v1::HandLost {}),
        EventKind::HandFound => Kind::HandFound(v1::HandFound {}),
        EventKind::ObjectAdded => Kind::ObjectAdded(v1::ObjectAdded {}),
        EventKind::ObjectRemoved => Kind::ObjectRemoved(v1::ObjectRemoved {}),
        EventKind::Reset => Kind::Reset(v1::SceneReset {}),
    }
}

/// What happened to a device as a message, without stamp and sequence number.
pub fn device_event(news: &DeviceNews) -> v1::Event {
    let kind = match news {
        DeviceNews::Lost { device, reason } => Kind::DeviceLost(v1::DeviceLost {
            device: device.clone(),
            reason: reason.clone(),
        }),
        DeviceNews::Returned { device, absent_s } => Kind::DeviceReturned(v1::DeviceReturned {
            device: device.clone(),
            absent_s: *absent_s,
        }),
    };
    v1::Event {
        kind: Some(kind),
        ..v1::Event::default()
    }
}

fn released(reason: ReleaseReason) -> v1::Released {
    let (reason, angle_rad, threshold_rad) = match reason {
        ReleaseReason::ContactsGone => (v1::ReleaseReason::ContactsGone, 0.0, 0.0),
        ReleaseReason::AngleFell { angle, threshold } => {
            (v1::ReleaseReason::AngleFell, angle, threshold)
        }
        ReleaseReason::TrackingLost => (v1::ReleaseReason::TrackingLost, 0.0, 0.0),
        ReleaseReason::Command => (v1::ReleaseReason::Command, 0.0, 0.0),
    };
    v1::Released {
        reason: reason.into(),
        angle_rad,
        threshold_rad,
    }
}

impl Names<'_> {
    /// The name of a part of that hand, e.g. `index_tip`.
    pub fn part(&self, hand: Option<HandId>, part: JudgementPart) -> String {
        let model = self
            .hands
            .iter()
            .find(|known| Some(known.id) == hand)
            .map(|known| &known.model);
        model
            .and_then(|model| PartLayout::of(model).place(part))
            .map_or_else(|| format!("{part:?}"), |place| place.to_string())
    }

    fn contact(
        &self,
        hand: Option<HandId>,
        part: JudgementPart,
        feature: Feature,
    ) -> v1::ContactFeature {
        let feature = match feature {
            Feature::Face(face) => WireFeature::Face(face),
            Feature::Edge(edge) => WireFeature::Edge(edge),
        };
        v1::ContactFeature {
            part: self.part(hand, part),
            feature: Some(feature),
        }
    }

    fn grasp_normal(&self, normal: &GraspNormal) -> v1::GraspNormal {
        v1::GraspNormal {
            hand: normal.hand.0,
            contact: Some(self.contact(Some(normal.hand), normal.part, normal.feature)),
            normal: Some(vec3(&normal.normal)),
        }
    }

    fn target(&self, index: u32) -> String {
        self.targets
            .get(index as usize)
            .map_or_else(String::new, |target| target.name.clone())
    }
}
