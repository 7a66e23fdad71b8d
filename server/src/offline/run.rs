//! The run itself: a scene, hands, as many steps as asked for.

use std::io::Write;
use std::time::Instant;

use tsukamu_world::input::{Command, HandInput};
use tsukamu_world::scene::Scene;
use tsukamu_world::step::SceneFaults;
use tsukamu_world::{StepInput, World};

use super::event_record::{EventRecord, events_of_step};
use super::hands::RunHand;
use super::names::NameBook;
use super::poses::PoseTable;
use super::recorder::RunRecorder;
use super::timing::{StepTimeUs, StepTimes};
use crate::record::RecordFault;
use crate::record::writer::{Finished, RecordingFile};

/// World time that a run goes on after the last hand sample, in seconds.
const AFTER_HANDS_S: f64 = 2.0;
/// World time that is then waited for objects that still move, in seconds.
const WAIT_FOR_REST_S: f64 = 60.0;
/// Steps between two reports of progress.
const PROGRESS_TICKS: u64 = 256;

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum RunFault {
    /// The scene cannot be run.
    #[error(transparent)]
    Scene(#[from] SceneFaults),
    /// The recording cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordFault),
    /// The table of poses cannot be written.
    #[error("writing the poses failed")]
    Poses(#[from] csv::Error),
}

/// What is run.
#[derive(Clone, Debug)]
pub struct RunRequest {
    /// The scene, with the model and the step rate of the run.
    pub scene: Scene,
    /// Its text, for the recording.
    pub source_text: String,
    /// The hands that enter at the first step.
    pub hands: Vec<RunHand>,
    /// World time to run, in seconds. `None`: to the end of the hands' motion and 2 s longer, and then until
    /// everything is at rest, at most a minute.
    pub duration_s: Option<f64>,
}

/// Where a run leaves what it makes.
#[derive(Debug, Default)]
pub struct RunOutputs<W: Write> {
    /// A recording.
    pub recording: Option<RecordingFile>,
    /// A table of poses.
    pub poses: Option<PoseTable<W>>,
}

/// What a run came to.
#[derive(Debug)]
pub struct RunOutcome {
    /// The world after the last step.
    pub world: World,
    /// Names of its objects and hands.
    pub names: NameBook,
    /// Everything that happened.
    pub events: Vec<EventRecord>,
    /// How long steps took.
    pub step_time_us: StepTimeUs,
    /// World time per time of the steps, without files and bookkeeping.
    pub realtime_factor: f64,
    /// The recording, if one was made.
    pub recording: Option<Finished>,
}

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Steps done.
    pub done: u64,
    /// Steps that are known to be done at least.
    pub expected: u64,
}

/// One run under way.
struct Run<W: Write> {
    world: World,
    names: NameBook,
    hands: Vec<RunHand>,
    poses: Option<PoseTable<W>>,
    recorder: Option<RunRecorder>,
    events: Vec<EventRecord>,
    times: StepTimes,
    input: StepInput,
}

/// Runs a scene. `progress` is told how far it is, now and then.
///
/// # Errors
/// When the scene cannot be run or an output cannot be written.
pub fn run<W: Write>(
    request: RunRequest,
    outputs: RunOutputs<W>,
    mut progress: impl FnMut(Progress),
) -> Result<RunOutcome, RunFault> {
    let end_of_hands_s = request.hands.iter().map(RunHand::end_s).fold(0.0, f64::max);
    let rate_hz = request.scene.rate_hz;
    let ticks_of = |time_s: f64| (time_s * rate_hz).ceil() as u64;
    let expected = ticks_of(request.duration_s.unwrap_or(end_of_hands_s + AFTER_HANDS_S));
    let last = if request.duration_s.is_some() {
        expected
    } else {
        expected + ticks_of(WAIT_FOR_REST_S)
    };
    let mut run = Run::new(request, outputs)?;
    for tick in 1..=last {
        if tick > expected && run.is_at_rest() {
            break;
        }
        run.step(tick)?;
        if tick.is_multiple_of(PROGRESS_TICKS) {
            progress(Progress {
                done: tick,
                expected: expected.max(tick),
            });
        }
    }
    run.finish()
}

impl<W: Write> Run<W> {
    fn new(request: RunRequest, outputs: RunOutputs<W>) -> Result<Self, RunFault> {
        let world = World::new(request.scene)?;
        let mut names = NameBook::of(&world);
        request
            .hands
            .iter()
            .for_each(|hand| names.name_hand(hand.id, &hand.name));
        let begin = |file| RunRecorder::begin(file, &world, &request.source_text, &request.hands);
        Ok(Self {
            recorder: outputs.recording.map(begin).transpose()?,
            world,
            names,
            hands: request.hands,
            poses: outputs.poses,
            events: Vec::new(),
            times: StepTimes::default(),
            input: StepInput::default(),
        })
    }

    fn is_at_rest(&self) -> bool {
        self.world.objects().all(|(_, body)| body.is_resting())
    }

    fn step(&mut self, tick: u64) -> Result<(), RunFault> {
        self.input.clear();
        if tick == 1 {
            let enter = |hand: &RunHand| Command::AddHand {
                hand: hand.id,
                model: Box::new(hand.model.clone()),
            };
            self.input.commands.extend(self.hands.iter().map(enter));
        }
        let time_s = tick as f64 * self.world.scene().step_length_s();
        let samples = self.hands.iter().map(|hand| HandInput {
            hand: hand.id,
            sample: hand.sample_at(time_s),
        });
        self.input.hands.extend(samples);
        let before = Instant::now();
        self.world.step(&self.input);
        self.times.add(before.elapsed());
        self.names.note_step(&self.world);
        self.events.extend(events_of_step(&self.world, &self.names));
        if let Some(recorder) = &mut self.recorder {
            recorder.step(&self.input, &self.world, &self.names)?;
        }
        if let Some(poses) = &mut self.poses {
            poses.write_step(&self.world, &self.names, &[])?;
        }
        Ok(())
    }

    fn finish(self) -> Result<RunOutcome, RunFault> {
        let recording = self
            .recorder
            .map(|recorder| recorder.finish(&self.world))
            .transpose()?;
        self.poses.map_or(Ok(()), PoseTable::finish)?;
        let world_time_s = self.world.state().tick as f64 * self.world.scene().step_length_s();
        let stepping_s = self.times.total_s();
        Ok(RunOutcome {
            realtime_factor: if stepping_s > 0.0 {
                world_time_s / stepping_s
            } else {
                0.0
            },
            step_time_us: self.times.summary(),
            world: self.world,
            names: self.names,
            events: self.events,
            recording,
        })
    }
}
