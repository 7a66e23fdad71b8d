use tsukamu_proto::v1::{
    ContactFeature, Event, GraspNormal, ReleaseReason, Vec3, contact_feature::Feature, event::Kind,
};

/// What happened and why, in words, e.g. `grasped: index_tip on face 3 and thumb_tip on face 1, 178°`.
///
/// `object_name` gives the name of an object's id, where one is known; others are called by their number.
pub fn event_text(event: &Event, object_name: &dyn Fn(u64) -> Option<String>) -> String {
    let Some(kind) = &event.kind else {
        return "an event that this client is too old to know".into();
    };
    match kind {
        Kind::ContactBegan(began) => format!("contact began: {}", contact(began.contact.as_ref())),
        Kind::ContactEnded(ended) => format!("contact ended: {}", contact(ended.contact.as_ref())),
        Kind::Pushed(pushed) if pushed.n_contacts == 1 => "pushed at one point".into(),
        Kind::Pushed(pushed) => {
            format!("pushed at {} points that make no grasp", pushed.n_contacts)
        }
        Kind::Grasped(grasped) => format!(
            "grasped: {} and {}, {}",
            normal(grasped.first.as_ref()),
            normal(grasped.second.as_ref()),
            degrees(grasped.angle_rad)
        ),
        Kind::Released(released) => {
            format!(
                "released: {}",
                release(
                    released.reason(),
                    released.angle_rad,
                    released.threshold_rad
                )
            )
        }
        Kind::Thrown(thrown) => format!("thrown at {}", velocity(thrown.velocity.as_ref())),
        Kind::Landed(landed) => format!("landed at {}", velocity(landed.velocity.as_ref())),
        Kind::Toppled(toppled) => format!(
            "toppled {} (case {})",
            topple(toppled.floor_case),
            toppled.floor_case
        ),
        Kind::Rested(rested) => match rested.on_object.checked_sub(1) {
            None => "came to rest on the floor".into(),
            Some(id) => format!("came to rest against {}", called(id, object_name)),
        },
        Kind::Blocked(blocked) => format!("blocked by {}", called(blocked.by, object_name)),
        Kind::HitTarget(hit) => format!(
            "hit the target {}, {:.0} mm from its centre",
            hit.target,
            hit.distance * 1e3
        ),
        Kind::HandLost(_) => "hand lost: no valid sample within the grace time".into(),
        Kind::HandFound(_) => "hand found".into(),
        Kind::ObjectAdded(_) => "added to the world".into(),
        Kind::ObjectRemoved(_) => "taken out of the world".into(),
        Kind::Reset(_) => "the scene was set back to its start".into(),
        Kind::SceneLoaded(loaded) => format!("scene {} was loaded: a new epoch began", loaded.name),
        Kind::DeviceLost(lost) => format!("{} was lost: {}", lost.device, lost.reason),
        Kind::DeviceReturned(back) => {
            format!("{} is back after {:.1} s", back.device, back.absent_s)
        }
    }
}

fn contact(contact: Option<&ContactFeature>) -> String {
    let Some(contact) = contact else {
        return "an unnamed part".into();
    };
    match contact.feature {
        Some(Feature::Face(face)) => format!("{} on face {face}", contact.part),
        Some(Feature::Edge(edge)) => format!("{} on edge {edge}", contact.part),
        None => contact.part.clone(),
    }
}

fn normal(normal: Option<&GraspNormal>) -> String {
    contact(normal.and_then(|normal| normal.contact.as_ref()))
}

fn release(reason: ReleaseReason, angle_rad: f64, threshold_rad: f64) -> String {
    match reason {
        ReleaseReason::Unspecified => "for a reason that this client is too old to know".into(),
        ReleaseReason::ContactsGone => "contacts gone".into(),
        ReleaseReason::AngleFell => {
            format!(
                "the angle fell to {}, below {}",
                degrees(angle_rad),
                degrees(threshold_rad)
            )
        }
        ReleaseReason::TrackingLost => "tracking lost".into(),
        ReleaseReason::Command => "on command".into(),
    }
}

const fn topple(floor_case: u32) -> &'static str {
    match floor_case {
        1 => "over one vertex",
        2 => "over two vertices",
        3 => "over two of three or more vertices",
        _ => "in an unknown way",
    }
}

fn velocity(velocity: Option<&Vec3>) -> String {
    let v = velocity.copied().unwrap_or_default();
    let speed = (v.x * v.x + v.y * v.y + v.z * v.z).sqrt();
    format!("{speed:.2} m/s ({:.2}, {:.2}, {:.2})", v.x, v.y, v.z)
}

fn degrees(radians: f64) -> String {
    format!("{:.0}°", radians.to_degrees())
}

fn called(id: u64, object_name: &dyn Fn(u64) -> Option<String>) -> String {
    object_name(id).unwrap_or_else(|| format!("object {id}"))
}

#[cfg(test)]
mod tests {
    use tsukamu_proto::v1::{
        Blocked, DeviceLost, DeviceReturned, Grasped, HitTarget, Landed, Pushed, Released, Rested,
        SceneLoaded, Toppled,
    };

    use super::*;

    fn check(kind: Kind, expected: &str) {
        let event = Event {
            kind: Some(kind),
            ..Event::default()
        };
        assert_eq!(
            event_text(&event, &|id| (id == 4).then(|| "red cube".to_owned())),
            expected
        );
    }

    fn normal_on(part: &str, feature: Feature) -> Option<GraspNormal> {
        let contact = Some(ContactFeature {
            part: part.into(),
            feature: Some(feature),
        });
        Some(GraspNormal {
            hand: 0,
            contact,
            normal: None,
        })
    }

    fn released(reason: ReleaseReason) -> Kind {
        Kind::Released(Released {
            reason: reason.into(),
            angle_rad: 1.2,
            threshold_rad: std::f64::consts::FRAC_PI_2,
        })
    }

    #[test]
    fn reasons_are_words() {
        check(
            Kind::Grasped(Grasped {
                first: normal_on("index_tip", Feature::Face(3)),
                second: normal_on("thumb_distal ridge 2", Feature::Edge(1)),
                angle_rad: 3.1067,
            }),
            "grasped: index_tip on face 3 and thumb_distal ridge 2 on edge 1, 178°",
        );
        check(
            released(ReleaseReason::ContactsGone),
            "released: contacts gone",
        );
        check(
            released(ReleaseReason::AngleFell),
            "released: the angle fell to 69°, below 90°",
        );
        check(
            released(ReleaseReason::TrackingLost),
            "released: tracking lost",
        );
        check(released(ReleaseReason::Command), "released: on command");
        check(
            Kind::Pushed(Pushed { n_contacts: 1 }),
            "pushed at one point",
        );
        check(
            Kind::Pushed(Pushed { n_contacts: 3 }),
            "pushed at 3 points that make no grasp",
        );
    }

    #[test]
    fn motions_are_words() {
        check(
            Kind::Landed(Landed {
                velocity: Some(Vec3 {
                    x: 3.0,
                    y: -4.0,
                    z: 0.0,
                }),
            }),
            "landed at 5.00 m/s (3.00, -4.00, 0.00)",
        );
        check(
            Kind::Toppled(Toppled { floor_case: 2 }),
            "toppled over two vertices (case 2)",
        );
        check(
            Kind::Rested(Rested { on_object: 0 }),
            "came to rest on the floor",
        );
        check(
            Kind::Rested(Rested { on_object: 5 }),
            "came to rest against red cube",
        );
        check(Kind::Blocked(Blocked { by: 7 }), "blocked by object 7");
        check(
            Kind::HitTarget(HitTarget {
                target: "board".into(),
                distance: 0.042,
            }),
            "hit the target board, 42 mm from its centre",
        );
        check(
            Kind::SceneLoaded(SceneLoaded {
                name: "demo".into(),
            }),
            "scene demo was loaded: a new epoch began",
        );
    }

    #[test]
    fn devices_go_and_come_in_words() {
        check(
            Kind::DeviceLost(DeviceLost {
                device: "glove".into(),
                reason: "unplugged".into(),
            }),
            "glove was lost: unplugged",
        );
        check(
            Kind::DeviceReturned(DeviceReturned {
                device: "glove".into(),
                absent_s: 2.34,
            }),
            "glove is back after 2.3 s",
        );
    }

    #[test]
    fn what_a_newer_daemon_says_is_admitted() {
        let unknown = event_text(&Event::default(), &|_| None);
        assert_eq!(unknown, "an event that this client is too old to know");
        let reason = Kind::Released(Released {
            reason: 99,
            angle_rad: 0.0,
            threshold_rad: 0.0,
        });
        check(
            reason,
            "released: for a reason that this client is too old to know",
        );
    }
}
