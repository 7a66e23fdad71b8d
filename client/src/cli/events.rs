use std::time::Duration;

use anyhow::Result;
use console::Style;
use tsukamu_client::connect::Client;
use tsukamu_client::event_text::event_text;
use tsukamu_client::event_watch::{EventUpdate, EventWatch};
use tsukamu_client::view::Stamp;
use tsukamu_proto::v1::event::Kind;
use tsukamu_proto::v1::{Event, GetSceneRequest};

use super::args::EventsArgs;
use super::format::{pad, pad_left, printable};
use super::scene_names::SceneNames;
use super::{json, output, refusal};

/// Without `--follow`: the log has been read when nothing came for this long.
const END_OF_LOG: Duration = Duration::from_millis(400);

/// Columns for whom an event is about.
const WHOM_WIDTH: usize = 28;

pub(crate) async fn events(client: &Client, args: &EventsArgs, as_json: bool) -> Result<()> {
    let from = match (args.from, args.follow) {
        (Some(from), _) => from,
        (None, true) => 0,
        (None, false) => 1,
    };
    let until = last_stamp(client).await?;
    let mut watch = EventWatch::open(client, from).await?;
    let mut names = scene_names(client).await?;
    let mut n_shown = 0;
    while args.count.is_none_or(|count| n_shown < count) {
        let next = watch.next();
        let update = if args.follow {
            next.await?
        } else {
            let Ok(update) = tokio::time::timeout(END_OF_LOG, next).await else {
                break;
            };
            update?
        };
        match update {
            EventUpdate::Event(event) => {
                let is_later = !args.follow
                    && event
                        .stamp
                        .as_ref()
                        .map(Stamp::from)
                        .is_some_and(|at| is_after(at, until));
                if is_later {
                    break;
                }
                if matches!(
                    event.kind,
                    Some(Kind::SceneLoaded(_) | Kind::ObjectAdded(_) | Kind::HandFound(_))
                ) {
                    names = scene_names(client).await?;
                }
                if args.contacts || !is_contact(&event) {
                    show(&event, &names, as_json)?;
                    n_shown += 1;
                }
            }
            // Without --from, the log was asked for whatever it still holds.
            EventUpdate::Missed(_) if args.from.is_none() && n_shown == 0 => {}
            EventUpdate::Missed(n) => output::note(&format!(
                "{n} events are lost: the daemon's log holds them no longer"
            )),
            EventUpdate::Lost(reason) if args.follow => {
                output::note(&format!("lost the daemon ({reason}); trying again"))
            }
            EventUpdate::Lost(_) => break,
            EventUpdate::Resumed => output::note("the daemon is back"),
            EventUpdate::Restarted => {
                output::note("the daemon was started anew");
                names = scene_names(client).await?;
            }
        }
    }
    Ok(())
}

/// When the world stands now: what happens later is not asked for without `--follow`.
async fn last_stamp(client: &Client) -> Result<Stamp> {
    Ok(client
        .status()
        .await?
        .stamp
        .as_ref()
        .map(Stamp::from)
        .unwrap_or_default())
}

fn is_after(at: Stamp, until: Stamp) -> bool {
    (at.epoch, at.tick) > (until.epoch, until.tick)
}

async fn scene_names(client: &Client) -> Result<SceneNames> {
    let answer = client
        .world()
        .get_scene(GetSceneRequest {})
        .await
        .map_err(|status| refusal(&status))?;
    Ok(SceneNames::of(
        &answer.into_inner().scene.unwrap_or_default(),
    ))
}

/// Whether it is about a single contact: many of them make one push or grasp.
pub(crate) fn is_contact(event: &Event) -> bool {
    matches!(
        event.kind,
        Some(Kind::ContactBegan(_) | Kind::ContactEnded(_))
    )
}

fn show(event: &Event, names: &SceneNames, as_json: bool) -> Result<()> {
    if as_json {
        output::json(&json::event(event, names))?;
    } else {
        output::line(&line(event, names))?;
    }
    Ok(())
}

/// Sequence number, world time, whom it is about, and what happened.
pub(crate) fn line(event: &Event, names: &SceneNames) -> String {
    let at = event.stamp.as_ref().map(Stamp::from).unwrap_or_default();
    let text = printable(&event_text(event, &|id| names.known_object(id)));
    let dim = Style::new().dim();
    format!(
        "{} {} {} {}",
        dim.apply_to(pad_left(&format!("#{}", event.sequence), 6)),
        pad_left(&format!("{:.3} s", at.world_time_s), 10),
        pad(&whom(event, names), WHOM_WIDTH),
        style(event).apply_to(text)
    )
}

fn whom(event: &Event, names: &SceneNames) -> String {
    let hand = event.hand.checked_sub(1).map(|id| names.hand(id));
    if let Some(device) = event.kind.as_ref().and_then(device) {
        return printable(device);
    }
    match (event.object > 0, hand) {
        (true, Some(hand)) => format!("{} · {hand}", printable(&event.object_name)),
        (true, None) => printable(&event.object_name),
        (false, Some(hand)) => hand,
        (false, None) => "world".into(),
    }
}

/// The device that it is about.
fn device(kind: &Kind) -> Option<&str> {
    match kind {
        Kind::DeviceLost(lost) => Some(&lost.device),
        Kind::DeviceReturned(back) => Some(&back.device),
        _ => None,
    }
}

fn style(event: &Event) -> Style {
    match event.kind {
        Some(Kind::Grasped(_)) => Style::new().green(),
        Some(Kind::Released(_) | Kind::Thrown(_)) => Style::new().yellow(),
        Some(Kind::HandLost(_) | Kind::DeviceLost(_)) => Style::new().red(),
        Some(Kind::HitTarget(_)) => Style::new().magenta().bold(),
        Some(Kind::SceneLoaded(_) | Kind::Reset(_)) => Style::new().cyan(),
        Some(Kind::Rested(_) | Kind::ContactBegan(_) | Kind::ContactEnded(_)) => Style::new().dim(),
        _ => Style::new(),
    }
}
