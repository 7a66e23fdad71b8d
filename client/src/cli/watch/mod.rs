use std::pin::pin;
use std::time::Duration;

use anyhow::Result;
use console::Term;
use tokio::sync::mpsc;
use tokio::time::{Instant, MissedTickBehavior};
use tsukamu_client::clock_sync::PingSample;
use tsukamu_client::connect::Client;
use tsukamu_client::event_watch::{EventUpdate, EventWatch};
use tsukamu_client::subscribe::{FrameOptions, FrameUpdate, FrameWatch};
use tsukamu_proto::v1::GetStatusResponse;

use super::args::WatchArgs;
use super::{events, json, output, status};

/// Lines in cells of two by four dots.
mod canvas;
/// Measures over the last second.
mod meter;
/// What is known about the daemon while it is watched.
mod model;
/// The scene as a drawing of lines.
mod picture;
/// The model as a plain line.
mod plain;
/// The model as lines of a terminal.
mod screen;
/// The table of hands and the table of objects.
mod tables;
/// The terminal while a live view is on it.
pub(super) mod terminal;

use model::WatchModel;
use terminal::LiveTerminal;

/// Between two drawings of the live view.
const REDRAW: Duration = Duration::from_millis(80);
/// Between two plain lines.
const PLAIN: Duration = Duration::from_secs(1);
/// Between two questions about status and clock.
const ASK: Duration = Duration::from_secs(1);
/// Exchanges of times at the start, to have a good clock at once.
const FIRST_EXCHANGES: u32 = 8;
/// What the side tasks may have ready before they wait. Events are never dropped: their task waits, then the daemon.
const SIDE_CAPACITY: usize = 256;

/// What the side tasks tell.
enum Side {
    Event(EventUpdate),
    Status(Box<GetStatusResponse>),
    Ping(PingSample),
}

/// How the view is shown.
enum Show {
    Live(LiveTerminal),
    Plain,
    Json,
}

pub(crate) async fn watch(client: &Client, args: &WatchArgs, as_json: bool) -> Result<()> {
    let mut frames = FrameWatch::open(
        client,
        FrameOptions {
            max_rate_hz: args.rate,
        },
    )
    .await?;
    let (sender, mut side) = mpsc::channel(SIDE_CAPACITY);
    // Aborted when they are dropped at the end of this function.
    let mut tasks = tokio::task::JoinSet::new();
    tasks.spawn(watch_events(client.clone(), sender.clone()));
    tasks.spawn(ask(client.clone(), sender));
    let mut show = if as_json {
        Show::Json
    } else {
        Show::for_people(args.plain)?
    };
    let mut model = WatchModel::new(client.address());
    let mut redraw = tokio::time::interval(show.interval());
    redraw.set_missed_tick_behavior(MissedTickBehavior::Skip);
    redraw.tick().await;
    while args
        .count
        .is_none_or(|count| frames.counts().applied < count)
    {
        let update = {
            let mut next = pin!(frames.next());
            loop {
                tokio::select! {
                    update = &mut next => break update?,
                    Some(news) = side.recv() => show.take_side(&mut model, news)?,
                    _ = redraw.tick() => show.draw(&mut model, client.clock().now_ns())?,
                }
            }
        };
        show.take_frame(&mut model, &update, &frames)?;
    }
    show.draw(&mut model, client.clock().now_ns())
}

impl Show {
    fn for_people(plain: bool) -> Result<Self> {
        let terminal = Term::buffered_stdout();
        if plain || !terminal.is_term() {
            return Ok(Self::Plain);
        }
        Ok(Self::Live(LiveTerminal::open(terminal)?))
    }

    const fn interval(&self) -> Duration {
        match self {
            Self::Live(_) => REDRAW,
            Self::Plain | Self::Json => PLAIN,
        }
    }

    fn draw(&mut self, model: &mut WatchModel, now_ns: u64) -> Result<()> {
        match self {
            Self::Live(terminal) => {
                let (height, width) = terminal.size();
                let lines = screen::lines(model, now_ns, width, height);
                terminal.draw(&lines)?;
            }
            Self::Plain => output::line(&plain::line(model, now_ns))?,
            Self::Json => {}
        }
        Ok(())
    }

    fn take_frame(
        &self,
        model: &mut WatchModel,
        update: &FrameUpdate,
        frames: &FrameWatch,
    ) -> Result<()> {
        match (self, update) {
            (Self::Plain | Self::Json, FrameUpdate::Lost(reason)) => {
                output::note(&format!("lost the daemon ({reason}); trying again"));
            }
            (Self::Plain | Self::Json, FrameUpdate::Resumed) => output::note("the daemon is back"),
            _ => {}
        }
        model.take_frame(update, frames);
        if let (Self::Json, FrameUpdate::Frame { arrival_ns, .. }, Some(view)) =
            (self, update, frames.view())
        {
            let mut value = json::view(view, model.names());
            value["latency_s"] = model.latency_s(*arrival_ns, view.stamp.wall_ns).into();
            value["skipped"] = frames.counts().skipped.into();
            output::json(&value)?;
        }
        Ok(())
    }

    fn take_side(&self, model: &mut WatchModel, news: Side) -> Result<()> {
        match news {
            Side::Status(status) => model.take_status(*status),
            Side::Ping(sample) => model.take_ping(sample),
            Side::Event(update) => {
                if let (Self::Plain, EventUpdate::Event(event)) = (self, &update)
                    && !events::is_contact(event)
                {
                    output::line(&events::line(event, model.names()))?;
                }
                model.take_event(update);
            }
        }
        Ok(())
    }
}

/// Passes on events; ends with the watch. That it cannot go on shows on the frame lane too.
async fn watch_events(client: Client, sender: mpsc::Sender<Side>) {
    let Ok(mut watch) = EventWatch::open(&client, 0).await else {
        return;
    };
    while let Ok(update) = watch.next().await {
        if sender.send(Side::Event(update)).await.is_err() {
            return;
        }
    }
}

/// Asks for status and clock once a second. A question without an answer is asked again the next time.
async fn ask(client: Client, sender: mpsc::Sender<Side>) {
    for _ in 0..FIRST_EXCHANGES {
        if let Ok(sample) = status::exchange(&client).await
            && sender.send(Side::Ping(sample)).await.is_err()
        {
            return;
        }
    }
    let mut due = Instant::now();
    loop {
        if let Ok(status) = client.status().await
            && sender.send(Side::Status(Box::new(status))).await.is_err()
        {
            return;
        }
        due = Instant::max(due + ASK, Instant::now());
        tokio::time::sleep_until(due).await;
        if let Ok(Ok(sample)) = tokio::time::timeout(ASK, status::exchange(&client)).await
            && sender.send(Side::Ping(sample)).await.is_err()
        {
            return;
        }
    }
}
