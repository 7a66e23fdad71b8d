//! A client's stream that drives a hand: samples in, contacts out.

use std::sync::Arc;

use futures_core::Stream;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tonic::{Status, Streaming};
use tsukamu_proto::v1;
use tsukamu_proto::v1::drive_request::Kind;
use tsukamu_world::hand::skeleton::HandModel;

use crate::clock::Clock;
use crate::convert::basic::{checked_name, side_from};
use crate::convert::fault::Fault;
use crate::convert::hand::{drive_state, hand_model_from, hand_sample_from, one_euro_from};
use crate::status::StatusBoard;
use crate::ticker::request::{NewDriver, NewHand, Refusal, Request, TickerHandle};

use super::intake::DriveNow;
use super::sources::{Arrived, Seen, Source, Sources};

/// What a stream needs of the daemon; cheap to clone.
#[derive(Clone, Debug)]
pub struct RemoteContext {
    /// To let hands join.
    pub ticker: TickerHandle,
    /// The list of sources.
    pub sources: Sources,
    /// To know the mode.
    pub status: Arc<StatusBoard>,
    /// To stamp samples.
    pub clock: Clock,
    /// True when the daemon stops.
    pub stopping: watch::Receiver<bool>,
}

type Item = Result<v1::DriveResponse, Status>;

/// Answers to a client that drives a hand. The hand leaves when the stream goes.
pub fn drive(
    context: RemoteContext,
    requests: Streaming<v1::DriveRequest>,
    place: String,
) -> impl Stream<Item = Item> + Send {
    let start = Drive::Waiting(Box::new((context, requests, place)));
    futures_util::stream::unfold(start, |state| async {
        match state {
            Drive::Waiting(parts) => Some(match open(*parts).await {
                Ok((opened, hand)) => (Ok(opened), Drive::Open(Box::new(hand))),
                Err(status) => (Err(status), Drive::Over),
            }),
            Drive::Open(mut hand) => match hand.next().await? {
                Ok(answer) => Some((Ok(answer), Drive::Open(hand))),
                Err(status) => Some((Err(status), Drive::Over)),
            },
            Drive::Over => None,
        }
    })
}

enum Drive {
    /// For the first message.
    Waiting(Box<(RemoteContext, Streaming<v1::DriveRequest>, String)>),
    Open(Box<RemoteHand>),
    Over,
}

/// A hand that is driven.
struct RemoteHand {
    model: HandModel,
    answers: watch::Receiver<DriveNow>,
    /// Own stamp of the newest sample received.
    received: watch::Receiver<u64>,
    reader: Reader,
    is_lockstep: bool,
    source: Arc<Source>,
}

/// The task that reads samples; it is stopped when the stream goes.
struct Reader(JoinHandle<Result<(), Status>>);

impl Drop for Reader {
    fn drop(&mut self) {
        self.0.abort();
    }
}

impl Drop for RemoteHand {
    fn drop(&mut self) {
        // The tick thread sees that nobody listens, and takes the hand out of the world.
        self.source.update(|health| health.state = "ended");
    }
}

impl RemoteHand {
    /// The next answer; `None` when the client has said goodbye or the daemon stops.
    async fn next(&mut self) -> Option<Item> {
        tokio::select! {
            biased;
            received = self.received.changed(), if self.is_lockstep => match received {
                Ok(()) => {}
                Err(_) => return self.farewell().await,
            },
            done = &mut self.reader.0 => return done.map_or(None, |read| read.err().map(Err)),
            answered = self.answers.changed() => answered.ok()?,
        }
        let received = *self.received.borrow_and_update();
        Some(Ok(drive_state(
            &self.answers.borrow_and_update(),
            &self.model,
            received,
        )))
    }

    /// What the reader ended with.
    async fn farewell(&mut self) -> Option<Item> {
        (&mut self.reader.0)
            .await
            .map_or(None, |read| read.err().map(Err))
    }
}

/// Takes the first message and lets the hand join.
async fn open(
    (mut context, mut requests, place): (RemoteContext, Streaming<v1::DriveRequest>, String),
) -> Result<(v1::DriveResponse, RemoteHand), Status> {
    let first = tokio::select! {
        first = requests.message() => first?,
        // A client that says nothing does not hold up the end.
        _ = context.stopping.wait_for(|stops| *stops) => return Err(Refusal::Stopping.into()),
    };
    let Some(Kind::Open(wanted)) = first.and_then(|message| message.kind) else {
        return Err(Status::invalid_argument("the first message must be `open`"));
    };
    let model = model_of(&wanted)?;
    let filter = one_euro_from(wanted.filter.as_ref())?;
    checked_name(&wanted.name)?;
    let name = if wanted.name.is_empty() {
        "remote"
    } else {
        &wanted.name
    };
    let source = context.sources.add(name, "remote", place, "running");
    let (sender, answers) = watch::channel(DriveNow::default());
    let hand = NewHand {
        model: model.clone(),
        source: Arc::clone(&source),
        filter,
        driver: NewDriver::Remote(sender),
    };
    let joined = context
        .ticker
        .ask(|reply| Request::OpenHand {
            hand: Box::new(hand),
            reply,
        })
        .await;
    let id = joined.inspect_err(|_| context.sources.remove(&source))?;
    let (received_sender, received) = watch::channel(0);
    let reader = tokio::spawn(read(
        requests,
        Arc::clone(&source),
        context.clock,
        received_sender,
    ));
    let opened = v1::drive_response::Kind::Opened(v1::DriveOpened { hand: id.0 });
    let response = v1::DriveResponse {
        stamp: Some(context.status.stamp()),
        kind: Some(opened),
    };
    let is_lockstep = context.status.now().mode == "lockstep";
    Ok((
        response,
        RemoteHand {
            model,
            answers,
            received,
            reader: Reader(reader),
            is_lockstep,
            source,
        },
    ))
}

fn model_of(wanted: &v1::DriveOpen) -> Result<HandModel, Status> {
    let side = side_from(wanted.side)?;
    let Some(message) = &wanted.model else {
        return Ok(HandModel::adult(side));
    };
    let model = hand_model_from(message)?;
    if model.side != side {
        return Err(Status::invalid_argument(
            "the model's side is not the hand's",
        ));
    }
    Ok(model)
}

/// Hands samples to the tick until the client ends its stream or breaks the rules.
async fn read(
    mut requests: Streaming<v1::DriveRequest>,
    source: Arc<Source>,
    clock: Clock,
    received: watch::Sender<u64>,
) -> Result<(), Status> {
    // A connection that breaks is an end like any other.
    while let Ok(Some(request)) = requests.message().await {
        let Some(Kind::Sample(message)) = request.kind else {
            return Err(Status::invalid_argument(
                "after `open` only samples may come",
            ));
        };
        let arrival_ns = clock.monotonic_ns();
        match hand_sample_from(&message) {
            Ok(sample) => source.offer(Arrived {
                source_ns: message.source_ns,
                arrival_ns,
                fitted_ns: arrival_ns,
                ticks: None,
                seen: Seen::Whole(sample),
            }),
            // Numbers that are none come from a device that lost its way for a moment; the client goes on.
            Err(Fault::NotFinite(_)) => source.note_dropped(arrival_ns),
            Err(fault) => return Err(fault.into()),
        }
        received.send_replace(message.source_ns);
    }
    Ok(())
}
