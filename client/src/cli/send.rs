use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use console::Term;
use serde_json::json;
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::{Instant, MissedTickBehavior};
use tsukamu_client::connect::Client;
use tsukamu_client::feed::{
    FeedAnswer, FeedAnswers, FeedOptions, FeedSender, HandFeed, PlayProgress, play,
};
use tsukamu_motion::track::TrackHand;
use tsukamu_proto::v1::{self, GetSceneRequest};
use tsukamu_world::hand::joint::Side;

use super::args::{SendArgs, SideArg};
use super::format::{count, span};
use super::motion::Motion;
use super::scene_names::SceneNames;
use super::{output, refusal};

/// Between two drawings of the progress line.
const REDRAW: Duration = Duration::from_millis(100);

/// How one driven hand stands.
#[derive(Clone, Debug, Default)]
struct LaneState {
    side: &'static str,
    duration_s: f64,
    played: PlayProgress,
    answer: Option<FeedAnswer>,
}

pub(crate) async fn send(client: &Client, args: &SendArgs, as_json: bool) -> Result<()> {
    let wanted = args.side.map(|side| match side {
        SideArg::Left => Side::Left,
        SideArg::Right => Side::Right,
    });
    let motion = Motion::new(&args.source, wanted);
    let hands = motion.hands(client).await?;
    let names = scene_names(client).await?;
    let mut lanes = JoinSet::new();
    let mut states = Vec::new();
    for hand in hands {
        let feed = HandFeed::open(client, options(args, &motion, &hand)).await?;
        output::note(&format!(
            "driving hand {} ({}) with {}, {} of motion",
            feed.hand,
            hand.side.name(),
            count(hand.samples.len() as u64, "sample"),
            span(duration_s(&hand))
        ));
        let state = LaneState {
            side: hand.side.name(),
            duration_s: duration_s(&hand),
            ..LaneState::default()
        };
        let (sender, receiver) = watch::channel(state);
        states.push(receiver);
        let round = Round {
            hand,
            motion: motion.clone(),
            repeat: args.repeat,
        };
        lanes.spawn(drive(feed, round, client.clone(), sender));
    }
    let mut redraw = tokio::time::interval(REDRAW);
    redraw.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut progress = Progress::new(names, as_json);
    loop {
        tokio::select! {
            ended = lanes.join_next() => match ended {
                Some(result) => result??,
                None => break,
            },
            _ = redraw.tick() => progress.draw(&states)?,
        }
    }
    progress.finish(&states)?;
    Ok(())
}

/// What one lane plays.
struct Round {
    hand: TrackHand,
    motion: Motion,
    repeat: bool,
}

/// Plays one hand and takes its answers until the motion ends or the daemon closes the lane.
async fn drive(
    feed: HandFeed,
    round: Round,
    client: Client,
    state: watch::Sender<LaneState>,
) -> Result<()> {
    let HandFeed {
        samples,
        mut answers,
        ..
    } = feed;
    let side = round.hand.side;
    tokio::select! {
        played = play_rounds(round, &samples, &client, &state) => played?,
        closed = take_answers(&mut answers, &state) => {
            closed?;
            bail!("the daemon has closed the lane of the {} hand", side.name());
        }
    }
    state.send_modify(|state| state.played.n_skipped += samples.n_dropped());
    Ok(())
}

/// A file begins again as it is; a plan is made anew for each round, because its objects have moved.
async fn play_rounds(
    round: Round,
    samples: &FeedSender,
    client: &Client,
    state: &watch::Sender<LaneState>,
) -> Result<()> {
    let Round {
        mut hand,
        motion,
        repeat,
    } = round;
    let mut before = PlayProgress::default();
    loop {
        let mut note = |played| state.send_modify(|state| state.played = sum(before, played));
        let played = play(
            &hand,
            repeat && !motion.is_planned(),
            samples,
            client.clock(),
            &mut note,
        )
        .await;
        note(played);
        before = sum(before, played);
        if !repeat || !samples.is_open() {
            // The last samples are still on their way: a lane that closes now would take them along.
            tokio::time::sleep(REDRAW).await;
            return Ok(());
        }
        let side = hand.side;
        let mut planned = motion.hands(client).await?;
        planned.retain(|hand| hand.side == side);
        hand = planned
            .pop()
            .context("the new plan is for the other hand")?;
    }
}

fn sum(before: PlayProgress, now: PlayProgress) -> PlayProgress {
    PlayProgress {
        n_rounds: before.n_rounds + now.n_rounds,
        into_s: now.into_s,
        n_sent: before.n_sent + now.n_sent,
        n_skipped: before.n_skipped + now.n_skipped,
    }
}

async fn take_answers(answers: &mut FeedAnswers, state: &watch::Sender<LaneState>) -> Result<()> {
    while let Some(answer) = answers.next().await? {
        state.send_modify(|state| state.answer = Some(answer));
    }
    Ok(())
}

/// What is printed while hands are driven: one line that is drawn anew on a terminal, else a line per change of hold.
struct Progress {
    names: SceneNames,
    as_json: bool,
    terminal: Option<Term>,
    held: Vec<u64>,
    is_drawn: bool,
    start: Instant,
}

impl Progress {
    fn new(names: SceneNames, as_json: bool) -> Self {
        let terminal = Some(Term::stderr()).filter(|terminal| terminal.is_term() && !as_json);
        Self {
            names,
            as_json,
            terminal,
            held: Vec::new(),
            is_drawn: false,
            start: Instant::now(),
        }
    }

    fn draw(&mut self, states: &[watch::Receiver<LaneState>]) -> Result<()> {
        let states: Vec<LaneState> = states.iter().map(|state| state.borrow().clone()).collect();
        let held: Vec<u64> = states
            .iter()
            .map(|state| state.answer.as_ref().map_or(0, |answer| answer.state.holds))
            .collect();
        if let Some(terminal) = &self.terminal {
            let text = states
                .iter()
                .map(|state| self.words(state))
                .collect::<Vec<_>>()
                .join("   ");
            let width = usize::from(terminal.size().1).saturating_sub(1);
            if self.is_drawn {
                terminal.clear_line()?;
            }
            terminal.write_str(&console::truncate_str(&text, width, "…"))?;
            self.is_drawn = true;
        } else if held != self.held && (!self.held.is_empty() || held.iter().any(|id| *id > 0)) {
            for state in &states {
                self.line(state)?;
            }
        }
        self.held = held;
        Ok(())
    }

    fn finish(&mut self, states: &[watch::Receiver<LaneState>]) -> Result<()> {
        if let (Some(terminal), true) = (&self.terminal, self.is_drawn) {
            terminal.clear_line()?;
        }
        let states: Vec<LaneState> = states.iter().map(|state| state.borrow().clone()).collect();
        for state in &states {
            self.line(state)?;
        }
        if !self.as_json {
            output::note(&format!(
                "done after {}",
                span(self.start.elapsed().as_secs_f64())
            ));
        }
        Ok(())
    }

    fn line(&self, state: &LaneState) -> Result<()> {
        if !self.as_json {
            return Ok(output::line(&self.words(state))?);
        }
        let held = state
            .answer
            .as_ref()
            .and_then(|answer| answer.state.holds.checked_sub(1));
        output::json(&json!({
            "side": state.side, "into_s": state.played.into_s, "rounds": state.played.n_rounds,
            "sent": state.played.n_sent, "skipped": state.played.n_skipped,
            "dropped_by_daemon": state.answer.as_ref().map(|answer| answer.state.dropped),
            "applied_tick": state.answer.as_ref().map(|answer| answer.state.applied_tick),
            "holds": held.map(|id| self.names.object(id)),
            "touches": state.answer.as_ref().map(|answer| answer.state.contacts.iter().map(|contact| {
                json!({"object": self.names.object(contact.object), "part": contact.part})
            }).collect::<serde_json::Value>()),
        }))?;
        Ok(())
    }

    fn words(&self, state: &LaneState) -> String {
        let PlayProgress {
            into_s,
            n_rounds,
            n_sent,
            n_skipped,
        } = state.played;
        let mut text = format!(
            "{}: {into_s:.1} of {:.1} s, {n_sent} sent",
            state.side, state.duration_s
        );
        if n_rounds > 1 {
            text += &format!(", {n_rounds} rounds");
        }
        if n_skipped > 0 {
            text += &format!(", {n_skipped} too late");
        }
        let Some(answer) = &state.answer else {
            return text;
        };
        if let Some(id) = answer.state.holds.checked_sub(1) {
            text += &format!(", holds {}", self.names.object(id));
        }
        let parts: Vec<&str> = answer
            .state
            .contacts
            .iter()
            .map(|contact| contact.part.as_str())
            .take(4)
            .collect();
        if !parts.is_empty() {
            text += &format!(", touches with {}", parts.join(", "));
        }
        text
    }
}

/// The hand's name: the one given, the built-in hand's, or the file's without folder and ending.
fn options(args: &SendArgs, motion: &Motion, hand: &TrackHand) -> FeedOptions {
    let stem = || {
        Path::new(&args.source)
            .file_stem()
            .map(|stem| stem.to_string_lossy().into_owned())
    };
    let planned = motion.is_planned().then(|| args.source.clone());
    let name = args
        .name
        .clone()
        .or(planned)
        .or_else(stem)
        .unwrap_or_else(|| "tsukamu".into());
    let side = match hand.side {
        Side::Left => v1::Side::Left,
        Side::Right => v1::Side::Right,
    };
    FeedOptions {
        name,
        side,
        model: None,
        filter: None,
    }
}

fn duration_s(hand: &TrackHand) -> f64 {
    hand.times_s.last().copied().unwrap_or(0.0) - hand.times_s.first().copied().unwrap_or(0.0)
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
