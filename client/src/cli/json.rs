use nalgebra::Isometry3;
use serde_json::{Value, json};
use tsukamu_client::event_text::event_text;
use tsukamu_client::names;
use tsukamu_client::view::{Joints, Stamp, WorldView};
use tsukamu_proto::v1::event::Kind;
use tsukamu_proto::v1::{ContactFeature, Event, GraspNormal, Vec3, contact_feature::Feature};

use super::scene_names::SceneNames;

/// A stamp's four fields.
pub(crate) fn stamp(stamp: Stamp) -> Value {
    json!({
        "epoch": stamp.epoch, "tick": stamp.tick, "time_s": stamp.world_time_s, "wall_ns": stamp.wall_ns,
    })
}

/// A frame: stamp, objects by id, hands.
pub(crate) fn view(view: &WorldView, scene_names: &SceneNames) -> Value {
    let objects = view.objects.iter().map(|(id, object)| {
        json!({
            "id": id, "name": scene_names.object(*id), "state": names::contact_state(object.state),
            "resting": object.resting, "hand": object.holder.map(|hand| scene_names.hand(hand)),
            "position": position(&object.pose), "rotation": rotation(&object.pose),
        })
    });
    let hands = view.hands.iter().map(|hand| {
        json!({
            "id": hand.id, "name": scene_names.hand(hand.id), "side": names::side(hand.side),
            "tracking": names::tracking(hand.tracking), "holds": hand.holds.map(|id| scene_names.object(id)),
            "sample_age_s": hand.sample_age_s, "wrist_position": position(&hand.wrist),
            "wrist_rotation": rotation(&hand.wrist), "tracked": joints(&hand.tracked), "shown": joints(&hand.shown),
        })
    });
    let mut value = stamp(view.stamp);
    value["objects"] = objects.collect();
    value["hands"] = hands.collect();
    value
}

/// An event: stamp, sequence, object, hand, kind, the fields of its kind, and the same in words.
pub(crate) fn event(event: &Event, scene_names: &SceneNames) -> Value {
    let mut value = stamp(event.stamp.as_ref().map(Stamp::from).unwrap_or_default());
    value["sequence"] = event.sequence.into();
    value["object"] = if event.object > 0 {
        event.object_name.clone().into()
    } else {
        Value::Null
    };
    value["object_id"] = event.object.checked_sub(1).into();
    value["hand"] = event
        .hand
        .checked_sub(1)
        .map(|id| scene_names.hand(id))
        .into();
    value["hand_id"] = event.hand.checked_sub(1).into();
    value["kind"] = event.kind.as_ref().map(names::event_kind).into();
    if let Some(kind) = &event.kind {
        for (key, field) in fields(kind) {
            value[key] = field;
        }
    }
    value["text"] = event_text(event, &|id| scene_names.known_object(id)).into();
    value
}

fn fields(kind: &Kind) -> Vec<(&'static str, Value)> {
    match kind {
        Kind::ContactBegan(began) => {
            vec![
                ("contact", contact(began.contact.as_ref())),
                ("point", vector(began.point.as_ref())),
            ]
        }
        Kind::ContactEnded(ended) => vec![("contact", contact(ended.contact.as_ref()))],
        Kind::Pushed(pushed) => vec![("n_contacts", pushed.n_contacts.into())],
        Kind::Grasped(grasped) => vec![
            ("first", normal(grasped.first.as_ref())),
            ("second", normal(grasped.second.as_ref())),
            ("angle_rad", grasped.angle_rad.into()),
        ],
        Kind::Released(released) => vec![
            ("reason", names::release_reason(released.reason()).into()),
            ("angle_rad", released.angle_rad.into()),
            ("threshold_rad", released.threshold_rad.into()),
        ],
        Kind::Thrown(thrown) => vec![("velocity", vector(thrown.velocity.as_ref()))],
        Kind::Landed(landed) => vec![("velocity", vector(landed.velocity.as_ref()))],
        Kind::Toppled(toppled) => vec![("case", toppled.floor_case.into())],
        Kind::Rested(rested) => vec![("on_object_id", rested.on_object.checked_sub(1).into())],
        Kind::Blocked(blocked) => vec![("by_object_id", blocked.by.into())],
        Kind::HitTarget(hit) => vec![
            ("target", hit.target.clone().into()),
            ("distance_m", hit.distance.into()),
        ],
        Kind::SceneLoaded(loaded) => vec![("scene", loaded.name.clone().into())],
        Kind::DeviceLost(lost) => vec![
            ("device", lost.device.clone().into()),
            ("reason", lost.reason.clone().into()),
        ],
        Kind::DeviceReturned(back) => vec![
            ("device", back.device.clone().into()),
            ("absent_s", back.absent_s.into()),
        ],
        Kind::HandLost(_)
        | Kind::HandFound(_)
        | Kind::ObjectAdded(_)
        | Kind::ObjectRemoved(_)
        | Kind::Reset(_) => Vec::new(),
    }
}

fn contact(contact: Option<&ContactFeature>) -> Value {
    let Some(contact) = contact else {
        return Value::Null;
    };
    match contact.feature {
        Some(Feature::Face(face)) => json!({"part": contact.part, "face": face}),
        Some(Feature::Edge(edge)) => json!({"part": contact.part, "edge": edge}),
        None => json!({"part": contact.part}),
    }
}

fn normal(normal: Option<&GraspNormal>) -> Value {
    let Some(normal) = normal else {
        return Value::Null;
    };
    let mut value = contact(normal.contact.as_ref());
    if value.is_object() {
        value["hand_id"] = normal.hand.into();
        value["normal"] = vector(normal.normal.as_ref());
    }
    value
}

fn vector(vector: Option<&Vec3>) -> Value {
    vector.map_or(Value::Null, |v| json!([v.x, v.y, v.z]))
}

fn position(pose: &Isometry3<f64>) -> Value {
    let p = pose.translation;
    json!([p.x, p.y, p.z])
}

fn rotation(pose: &Isometry3<f64>) -> Value {
    let q = pose.rotation;
    json!([q.i, q.j, q.k, q.w])
}

/// A list of twenty, `null` where a joint was never tracked.
fn joints(joints: &Joints) -> Value {
    joints
        .iter()
        .map(|joint| joint.map_or(Value::Null, |p| json!([p.x, p.y, p.z])))
        .collect()
}
