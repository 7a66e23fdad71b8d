//! Tables for spreadsheets, made by replaying a recording.
//!
//! | file | a row per | columns |
//! | --- | --- | --- |
//! | `poses.csv` | tick and object | `epoch`, then those of [`crate::offline::poses`] |
//! | `hands.csv` | tick and hand | `t_s`, `hand` (left or right), wrist pose and tracked joints as in the hand CSV, so that it can be run again; then `epoch`, `tick`, `id`, `name`, `tracking` (`tracked`, `held` or `lost`), `holds` (an object), and `shown_<joint>_x,_y,_z` |
//! | `events.csv` | event | `epoch,tick,time_s,object,hand,kind,reason,details`; details are JSON |
//! | `inputs.csv` | tick and hand input, and command | `epoch,tick,time_s,hand,command`, then wrist pose and joints, or the 21 `angle_<n>` of a glove in the order of the protocol's `HandSample.angles`; empty where there are none |
//!
//! Metres, seconds, radians; world space, y up; quaternions x, y, z, w. `epoch` counts the scenes of the recording.

use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::Path;

use tsukamu_proto::v1;
use tsukamu_proto::v1::world_command::Kind;
use tsukamu_world::World;
use tsukamu_world::frame::{HandFrame, Tracking};
use tsukamu_world::hand::joint::JOINT_NAMES;

use super::RecordFault;
use super::reader::{Ending, RecordingReader};
use super::replay::{Moment, Replay, ReplayFault};
use crate::offline::event_record::{EventRecord, events_of_step};
use crate::offline::names::NameBook;
use crate::offline::poses::PoseTable;

/// Joint angles of a glove in a sample.
const N_ANGLES: usize = 21;
/// Columns of a wrist's pose.
const WRIST: [&str; 7] = [
    "wrist_x", "wrist_y", "wrist_z", "wrist_qx", "wrist_qy", "wrist_qz", "wrist_qw",
];

/// Why a recording cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportFault {
    /// The recording cannot be opened, or the folder cannot be made.
    #[error(transparent)]
    Record(#[from] RecordFault),
    /// The recording cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayFault),
    /// A table cannot be written.
    #[error("writing a table failed")]
    Write(#[from] csv::Error),
}

type Table = csv::Writer<BufWriter<File>>;

struct Tables {
    poses: PoseTable<BufWriter<File>>,
    hands: Table,
    events: Table,
    inputs: Table,
    names: NameBook,
}

/// Replays a recording into the tables in that folder, which is made where it is missing. `progress` gets the bytes
/// read, now and then. Tells how the recording ended.
///
/// # Errors
/// When the recording cannot be replayed (the tables then hold what came before) or a table cannot be written.
pub fn export(
    recording: RecordingReader<BufReader<File>>,
    folder: &Path,
    mut progress: impl FnMut(u64),
) -> Result<Ending, ExportFault> {
    let refuse = |source| RecordFault::Open {
        file: folder.display().to_string(),
        source,
    };
    std::fs::create_dir_all(folder).map_err(refuse)?;
    let mut tables = Tables::create(folder)?;
    let mut replay = Replay::new(recording);
    let fault = loop {
        match replay.next_moment() {
            Ok(None) => break None,
            Err(fault) => break Some(fault),
            Ok(Some(Moment::Epoch)) => {
                tables.names = replay.world().map(NameBook::of).unwrap_or_default();
                for (hand, name) in replay.hand_names() {
                    tables.names.name_hand(*hand, name);
                }
            }
            Ok(Some(Moment::Stepped { message, .. })) => {
                let Some(world) = replay.world() else {
                    continue;
                };
                tables.write_step(replay.epoch(), world, &message)?;
            }
            Ok(Some(Moment::Digest { .. })) => progress(replay.n_read()),
        }
    };
    tables.finish()?;
    fault.map_or_else(
        || Ok(replay.ending().cloned().unwrap_or(Ending::Complete)),
        |fault| Err(fault.into()),
    )
}

impl Tables {
    fn create(folder: &Path) -> Result<Self, ExportFault> {
        let open = |name: &str| {
            let path = folder.join(name);
            let refuse = |source| RecordFault::Open {
                file: path.display().to_string(),
                source,
            };
            File::create(&path).map(BufWriter::new).map_err(refuse)
        };
        let table = |name: &str| open(name).map(csv::Writer::from_writer);
        let mut tables = Self {
            poses: PoseTable::new(open("poses.csv")?, &["epoch"])?,
            hands: table("hands.csv")?,
            events: table("events.csv")?,
            inputs: table("inputs.csv")?,
            names: NameBook::default(),
        };
        let words = |words: &[&str]| {
            words
                .iter()
                .map(|word| (*word).to_owned())
                .collect::<Vec<_>>()
        };
        let hand_columns = [
            words(&["t_s", "hand"]),
            words(&WRIST),
            joint_columns(""),
            words(&["epoch", "tick", "id", "name", "tracking", "holds"]),
            joint_columns("shown_"),
        ];
        tables.hands.write_record(hand_columns.concat())?;
        tables.events.write_record([
            "epoch", "tick", "time_s", "object", "hand", "kind", "reason", "details",
        ])?;
        let angles = (0..N_ANGLES)
            .map(|index| format!("angle_{index}"))
            .collect();
        let input_columns = [
            words(&["epoch", "tick", "time_s", "hand", "command"]),
            words(&WRIST),
            joint_columns(""),
            angles,
        ];
        tables.inputs.write_record(input_columns.concat())?;
        Ok(tables)
    }

    fn write_step(
        &mut self,
        epoch: u64,
        world: &World,
        message: &v1::StepInput,
    ) -> csv::Result<()> {
        for command in &message.commands {
            if let Some(Kind::AddHand(added)) = &command.kind {
                self.names
                    .name_hand(tsukamu_world::state::HandId(added.hand), &added.name);
            }
        }
        self.names.note_step(world);
        self.poses
            .write_step(world, &self.names, &[epoch.to_string()])?;
        for hand in &world.frame().hands {
            self.write_hand(epoch, world, hand)?;
        }
        for event in events_of_step(world, &self.names) {
            self.write_event(epoch, event)?;
        }
        self.write_inputs(world.frame().time_s, message)
    }

    fn write_hand(&mut self, epoch: u64, world: &World, hand: &HandFrame) -> csv::Result<()> {
        if hand.tracking == Tracking::Never {
            return Ok(());
        }
        let frame = world.frame();
        let mut row = vec![text(frame.time_s), hand.side.name().to_owned()];
        let is_seen = hand.tracking == Tracking::Tracked;
        let wrist = hand
            .wrist
            .translation
            .vector
            .iter()
            .chain(hand.wrist.rotation.coords.iter());
        // A hand that was not seen in this tick is no sample when the file is run again.
        row.extend(wrist.map(|number| {
            if is_seen {
                text(*number)
            } else {
                String::new()
            }
        }));
        for joint in &hand.tracked {
            row.extend(cells(
                joint
                    .filter(|_| is_seen)
                    .map(|point| [point.x, point.y, point.z]),
            ));
        }
        let name = self.names.hand(hand.hand);
        let holds = hand
            .holds
            .map_or_else(String::new, |id| self.names.object(id));
        let tracking = hand.tracking.name().to_owned();
        row.extend([
            epoch.to_string(),
            frame.tick.to_string(),
            hand.hand.0.to_string(),
            name,
            tracking,
            holds,
        ]);
        for joint in &hand.shown {
            row.extend(cells(joint.map(|point| [point.x, point.y, point.z])));
        }
        self.hands.write_record(row)
    }

    fn write_event(&mut self, epoch: u64, event: EventRecord) -> csv::Result<()> {
        let details = serde_json::Value::Object(event.details).to_string();
        self.events.write_record([
            epoch.to_string(),
            event.tick.to_string(),
            text(event.time_s),
            event.object.unwrap_or_default(),
            event.hand.unwrap_or_default(),
            event.kind.to_owned(),
            event.reason,
            details,
        ])
    }

    fn write_inputs(&mut self, time_s: f64, message: &v1::StepInput) -> csv::Result<()> {
        let start = [
            message.epoch.to_string(),
            message.tick.to_string(),
            text(time_s),
        ];
        let n_numbers = WRIST.len() + 3 * JOINT_NAMES.len() + N_ANGLES;
        for command in &message.commands {
            let mut row = start.to_vec();
            row.extend([String::new(), command_text(command)]);
            row.resize(row.len() + n_numbers, String::new());
            self.inputs.write_record(row)?;
        }
        for hand in &message.hands {
            let mut row = start.to_vec();
            row.extend([
                self.names.hand(tsukamu_world::state::HandId(hand.hand)),
                String::new(),
            ]);
            row.extend(sample_cells(hand.sample.as_ref()));
            self.inputs.write_record(row)?;
        }
        Ok(())
    }

    fn finish(mut self) -> csv::Result<()> {
        self.poses.finish()?;
        for table in [&mut self.hands, &mut self.events, &mut self.inputs] {
            table.flush()?;
        }
        Ok(())
    }
}

fn joint_columns(before: &str) -> Vec<String> {
    JOINT_NAMES
        .iter()
        .flat_map(|joint| ["x", "y", "z"].map(|axis| format!("{before}{joint}_{axis}")))
        .collect()
}

/// The shortest text that reads back as the same number.
fn text(number: f64) -> String {
    format!("{number:?}")
}

/// Three cells, empty without a point.
fn cells(point: Option<[f64; 3]>) -> [String; 3] {
    point.map_or_else(Default::default, |point| point.map(text))
}

/// Wrist, joints and angles of a sample; empty cells for what it does not have.
fn sample_cells(sample: Option<&v1::HandSample>) -> Vec<String> {
    let wrist = sample.and_then(|sample| sample.wrist.as_ref());
    let position = wrist
        .and_then(|wrist| wrist.position)
        .map(|p| [p.x, p.y, p.z]);
    let rotation = wrist
        .and_then(|wrist| wrist.rotation)
        .map(|q| [q.x, q.y, q.z, q.w]);
    let of = |numbers: &[f64], n: usize| -> Vec<String> {
        let known = numbers.iter().map(|number| {
            if number.is_nan() {
                String::new()
            } else {
                text(*number)
            }
        });
        known
            .chain(std::iter::repeat(String::new()))
            .take(n)
            .collect()
    };
    let numbers = |list: Option<&Vec<f64>>, n| of(list.map_or(&[], Vec::as_slice), n);
    [
        of(position.as_ref().map_or(&[], |position| position), 3),
        of(rotation.as_ref().map_or(&[], |rotation| rotation), 4),
        numbers(sample.map(|sample| &sample.joints), 3 * JOINT_NAMES.len()),
        numbers(sample.map(|sample| &sample.angles), N_ANGLES),
    ]
    .concat()
}

/// A command as a few words.
fn command_text(command: &v1::WorldCommand) -> String {
    match &command.kind {
        None => "nothing".to_owned(),
        Some(Kind::AddHand(added)) => format!("add_hand {}", added.name),
        Some(Kind::RemoveHand(hand)) => format!("remove_hand {hand}"),
        Some(Kind::AddObject(object)) => format!("add_object {}", object.name),
        Some(Kind::RemoveObject(object)) => format!("remove_object {object}"),
        Some(Kind::Release(object)) => format!("release {object}"),
        Some(Kind::Reset(_)) => "reset".to_owned(),
        Some(Kind::SetModel(model)) => format!("set_model {model}"),
    }
}
