//! What the tabular formats have in common: one row, one hand at one time.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use tsukamu_world::hand::joint::{JointId, N_JOINTS, Side};
use tsukamu_world::hand::sample::HandSample;

use crate::mistake::{ImportError, MistakeKind, Mistakes};
use crate::table::{Column, Group, Row, Table};
use crate::track::{HandTrack, TrackHand};

/// One hand of one row, in the space of its file.
#[derive(Clone, Debug)]
pub(crate) struct RawRow {
    /// Line of the file, from 1.
    pub(crate) line: u64,
    /// Seconds.
    pub(crate) t_s: f64,
    pub(crate) side: Side,
    /// The pose that the file gives for wrist or palm.
    pub(crate) body: Isometry3<f64>,
    /// Joint places; `None` is not tracked.
    pub(crate) points: [Option<Point3<f64>>; N_JOINTS],
}

/// The columns of a row.
#[derive(Debug)]
pub(crate) struct HandColumns {
    time: Column,
    /// Absent in files of a right hand only.
    hand: Option<Column>,
    /// x, y, z, qx, qy, qz, qw.
    body: [Column; 7],
    joints: Vec<[Column; 3]>,
}

/// Shorter quaternions are no rotations.
const QUATERNION_MIN: f64 = 1e-6;
/// A quaternion whose squared length is this near to one is kept bit for bit, so that files round-trip.
const QUATERNION_UNIT: f64 = 1e-12;
/// The values of a `hand` column.
pub(crate) const SIDES: [(&str, Side); 2] = [("left", Side::Left), ("right", Side::Right)];
/// What a `hand` column may say.
pub(crate) const SIDES_ALLOWED: &str = "left, right";

/// Joint columns of the recorded sets: `<prefix><finger>_<joint>_<axis>` with anatomical joint names.
pub(crate) fn anatomical_name(prefix: &str, joint: JointId) -> String {
    const THUMB: [&str; 4] = ["cmc", "mcp", "ip", "tip"];
    const OTHERS: [&str; 4] = ["mcp", "pip", "dip", "tip"];
    let finger = joint.finger();
    let names = if finger.index() == 0 { THUMB } else { OTHERS };
    format!(
        "{prefix}{}_{}",
        finger.name(),
        names[joint.index() % names.len()]
    )
}

impl HandColumns {
    /// Finds `t_s`, `hand` if there is one, the pose of `body`, and each joint's three columns.
    pub(crate) fn find(
        table: &Table,
        body: &str,
        joint_name: impl Fn(JointId) -> String,
        mistakes: &mut Mistakes,
    ) -> Self {
        let time = table.column("t_s", mistakes);
        let hand = table.has("hand").then(|| table.column("hand", mistakes));
        let body = ["x", "y", "z", "qx", "qy", "qz", "qw"]
            .map(|part| table.column(&format!("{body}_{part}"), mistakes));
        let joints = joint_columns(table, joint_name, mistakes);
        Self {
            time,
            hand,
            body,
            joints,
        }
    }
}

/// The three columns of each joint.
pub(crate) fn joint_columns(
    table: &Table,
    joint_name: impl Fn(JointId) -> String,
    mistakes: &mut Mistakes,
) -> Vec<[Column; 3]> {
    let mut columns = |joint| {
        let name = joint_name(joint);
        ["x", "y", "z"].map(|axis| table.column(&format!("{name}_{axis}"), mistakes))
    };
    JointId::all().map(&mut columns).collect()
}

/// The rows in which a hand is tracked (its body's pose is there). Mistakes are noted.
pub(crate) fn hand_rows(
    table: &Table,
    columns: &HandColumns,
    mistakes: &mut Mistakes,
) -> Vec<RawRow> {
    table
        .rows
        .iter()
        .filter_map(|row| hand_row(row, columns, mistakes))
        .collect()
}

fn hand_row(row: &Row, columns: &HandColumns, mistakes: &mut Mistakes) -> Option<RawRow> {
    let t_s = row.number(&columns.time, mistakes);
    let side = match &columns.hand {
        Some(column) => row.word(column, &SIDES, SIDES_ALLOWED, mistakes),
        None => Some(Side::Right),
    };
    let body = pose(row, &columns.body, mistakes);
    let points = joint_points(row, &columns.joints, mistakes);
    Some(RawRow {
        line: row.line,
        t_s: t_s?,
        side: side?,
        body: body?,
        points,
    })
}

/// The joints of a row; an empty one is `None`, and so is one with a mistake, which is noted.
pub(crate) fn joint_points(
    row: &Row,
    columns: &[[Column; 3]],
    mistakes: &mut Mistakes,
) -> [Option<Point3<f64>>; N_JOINTS] {
    let mut points = [None; N_JOINTS];
    for (point, columns) in points.iter_mut().zip(columns) {
        if let Group::Values(values) = row.group(columns, mistakes) {
            *point = Some(Point3::from(values));
        }
    }
    points
}

/// A pose from seven cells (x, y, z, qx, qy, qz, qw); `None` where all are empty or one is wrong.
pub(crate) fn pose(
    row: &Row,
    columns: &[Column; 7],
    mistakes: &mut Mistakes,
) -> Option<Isometry3<f64>> {
    let Group::Values([x, y, z, qx, qy, qz, qw]) = row.group(columns, mistakes) else {
        return None;
    };
    let Some(rotation) = rotation(Quaternion::new(qw, qx, qy, qz)) else {
        mistakes.add(
            row.line,
            Some(&columns[3].name),
            MistakeKind::ZeroQuaternion,
        );
        return None;
    };
    Some(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

fn rotation(quaternion: Quaternion<f64>) -> Option<UnitQuaternion<f64>> {
    // Scaled first: squares of huge numbers overflow.
    let largest = quaternion.coords.amax();
    if largest < QUATERNION_MIN {
        return None;
    }
    let off_unit = (quaternion.norm_squared() - 1.0).abs();
    Some(if off_unit <= QUATERNION_UNIT {
        UnitQuaternion::new_unchecked(quaternion)
    } else {
        UnitQuaternion::new_normalize(quaternion / largest)
    })
}

/// Sorts rows by hand, in [`Side`] order. Each hand's time must advance from row to row.
pub(crate) fn track_of(
    rows: Vec<RawRow>,
    time_column: &str,
    sample: impl Fn(&RawRow) -> HandSample,
    mut mistakes: Mistakes,
) -> Result<HandTrack, ImportError> {
    let mut hands = [Side::Left, Side::Right].map(|side| TrackHand {
        side,
        times_s: Vec::new(),
        samples: Vec::new(),
    });
    for row in rows {
        let hand = &mut hands[usize::from(row.side == Side::Right)];
        match hand.times_s.last() {
            Some(&previous_s) if row.t_s <= previous_s => {
                let kind = MistakeKind::TimeNotAfter {
                    t_s: row.t_s,
                    previous_s,
                };
                mistakes.add(row.line, Some(time_column), kind);
            }
            _ => {
                hand.times_s.push(row.t_s);
                hand.samples.push(sample(&row));
            }
        }
    }
    mistakes.check()?;
    let hands: Vec<TrackHand> = hands
        .into_iter()
        .filter(|hand| !hand.times_s.is_empty())
        .collect();
    if hands.is_empty() {
        mistakes.add(1, None, MistakeKind::NoRows);
    }
    mistakes.check().map(|()| HandTrack { hands })
}
