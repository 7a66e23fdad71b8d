use tsukamu_proto::v1::{ContactState, ReleaseReason, Side, Tracking, event::Kind};

/// `left`, `right` or `unspecified`.
pub const fn side(side: Side) -> &'static str {
    match side {
        Side::Unspecified => "unspecified",
        Side::Left => "left",
        Side::Right => "right",
    }
}

/// `never`, `tracked`, `held`, `lost` or `unspecified`.
pub const fn tracking(tracking: Tracking) -> &'static str {
    match tracking {
        Tracking::Unspecified => "unspecified",
        Tracking::Never => "never",
        Tracking::Tracked => "tracked",
        Tracking::Held => "held",
        Tracking::Lost => "lost",
    }
}

/// `free`, `push-1`, `push-n`, `grasped` or `unspecified`.
pub const fn contact_state(state: ContactState) -> &'static str {
    match state {
        ContactState::Unspecified => "unspecified",
        ContactState::Free => "free",
        ContactState::PushedAtOne => "push-1",
        ContactState::PushedAtSeveral => "push-n",
        ContactState::Grasped => "grasped",
    }
}

/// The reason as programs read it, e.g. `contacts_gone`.
pub const fn release_reason(reason: ReleaseReason) -> &'static str {
    match reason {
        ReleaseReason::Unspecified => "unspecified",
        ReleaseReason::ContactsGone => "contacts_gone",
        ReleaseReason::AngleFell => "angle_fell",
        ReleaseReason::TrackingLost => "tracking_lost",
        ReleaseReason::Command => "command",
    }
}

/// The event's kind as programs read it, e.g. `contact_began`.
pub const fn event_kind(kind: &Kind) -> &'static str {
    match kind {
        Kind::ContactBegan(_) => "contact_began",
        Kind::ContactEnded(_) => "contact_ended",
        Kind::Pushed(_) => "pushed",
        Kind::Grasped(_) => "grasped",
        Kind::Released(_) => "released",
        Kind::Thrown(_) => "thrown",
        Kind::Landed(_) => "landed",
        Kind::Toppled(_) => "toppled",
        Kind::Rested(_) => "rested",
        Kind::Blocked(_) => "blocked",
        Kind::HitTarget(_) => "hit_target",
        Kind::HandLost(_) => "hand_lost",
        Kind::HandFound(_) => "hand_found",
        Kind::ObjectAdded(_) => "object_added",
        Kind::ObjectRemoved(_) => "object_removed",
        Kind::Reset(_) => "reset",
        Kind::SceneLoaded(_) => "scene_loaded",
        Kind::DeviceLost(_) => "device_lost",
        Kind::DeviceReturned(_) => "device_returned",
    }
}
