use tsukamu_client::names;
use tsukamu_proto::v1::ContactState;

use super::super::format::span_ns;
use super::model::WatchModel;

/// The model as one plain line: time, rate, latency, hands, and the objects that are touched or move.
pub(super) fn line(model: &mut WatchModel, now_ns: u64) -> String {
    if let Some(reason) = &model.lost {
        return format!("connection lost ({reason})");
    }
    let rate_hz = model.meter.rate_hz(now_ns);
    let latency = model.meter.latency_ns(now_ns);
    let Some(view) = model.view() else {
        return "waiting for the first frame".into();
    };
    let latency = latency.map_or_else(|| "?".into(), |(median, _)| span_ns(median));
    let mut text = format!(
        "{:.2} s  tick {}  {rate_hz:.1} frames/s  latency {latency}  {} skipped",
        view.stamp.world_time_s, view.stamp.tick, model.counts.skipped
    );
    for hand in &view.hands {
        text += &format!(
            "  | {} {}",
            model.names().hand(hand.id),
            names::tracking(hand.tracking)
        );
        if let Some(id) = hand.holds {
            text += &format!(", holds {}", model.names().object(id));
        }
    }
    let active = view
        .objects
        .iter()
        .filter(|(_, object)| !object.resting || object.state != ContactState::Free);
    for (id, object) in active.take(8) {
        let p = object.pose.translation;
        text += &format!(
            "  | {} {} ({:.3}, {:.3}, {:.3})",
            model.names().object(*id),
            names::contact_state(object.state),
            p.x,
            p.y,
            p.z
        );
    }
    text
}
