//! The path of the object through an Adroit file.
//!
//! Space is the project's: y up. A body's own axes turn with the world's, so a body that stood upright in z-up
//! axes has no rotation here, and its half-edge along its z is now along its y.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::{y_up_from_z_up, y_up_vector};
use crate::mistake::{ImportError, Mistakes};
use crate::rows::pose;
use crate::table::{Column, Group, Row, Table};

/// A body whose path an Adroit file gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdroitBody {
    /// The free object of the pick runs.
    Object,
    /// The lever of the door recordings.
    Latch,
    /// The leaf of the door recordings.
    Door,
}

/// One body at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyRow {
    /// Seconds.
    pub t_s: f64,
    /// `world_from_body`, y up.
    pub pose: Isometry3<f64>,
    /// Velocity of the centre in world space, m/s; only for [`AdroitBody::Object`].
    pub velocity: Option<Vector3<f64>>,
    /// Angular velocity in world space, rad/s; only for [`AdroitBody::Object`].
    pub angular_velocity: Option<Vector3<f64>>,
    /// What the simulator's contacts and events say of this moment.
    pub phase: Phase,
    /// Number of contacts between hand and body (for the door's leaf: hand and latch).
    pub n_contacts: u32,
    /// The largest angle between two of their normals, degrees; with two contacts or more.
    pub opposition_deg: Option<f64>,
}

/// The phase of a run; it never goes back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// Nothing touched yet.
    Approach,
    /// Touched, not grasped.
    Touch,
    /// Grasped.
    Grasped,
    /// The pick runs: off the table, in the hand.
    Carried,
    /// The door recordings: the latch turns.
    Turning,
    /// The door recordings: the door opens.
    Opening,
    /// The door recordings: let go.
    Released,
    /// The pick runs: let go, in flight.
    Free,
    /// The pick runs: down again.
    Landed,
}

impl AdroitBody {
    const fn prefix(self) -> &'static str {
        match self {
            Self::Object => "obj",
            Self::Latch => "latch",
            Self::Door => "door",
        }
    }
}

const PHASES: [(&str, Phase); 9] = [
    ("approach", Phase::Approach),
    ("touch", Phase::Touch),
    ("grasped", Phase::Grasped),
    ("carried", Phase::Carried),
    ("turning", Phase::Turning),
    ("opening", Phase::Opening),
    ("released", Phase::Released),
    ("free", Phase::Free),
    ("landed", Phase::Landed),
];
const PHASES_ALLOWED: &str =
    "approach, touch, grasped, carried, turning, opening, released, free, landed";
/// The path of a body through an Adroit file, in the order of its rows.
///
/// # Errors
/// Every mistake with its line and column, up to a limit.
pub fn body_path(text: &str, body: AdroitBody) -> Result<Vec<BodyRow>, ImportError> {
    let mut mistakes = Mistakes::default();
    let table = Table::read(text, &mut mistakes)?;
    let columns = BodyColumns::find(&table, body, &mut mistakes);
    mistakes.check_header()?;
    let rows = table
        .rows
        .iter()
        .filter_map(|row| columns.row(row, &mut mistakes))
        .collect();
    mistakes.check().map(|()| rows)
}

struct BodyColumns {
    time: Column,
    pose: [Column; 7],
    velocity: Option<[Column; 3]>,
    angular_velocity: Option<[Column; 3]>,
    phase: Column,
    n_contacts: Column,
    opposition: Column,
}

impl BodyColumns {
    fn find(table: &Table, body: AdroitBody, mistakes: &mut Mistakes) -> Self {
        let prefix = body.prefix();
        let mut axes = |kind: &str| {
            ["x", "y", "z"].map(|axis| table.column(&format!("{prefix}_{kind}{axis}"), mistakes))
        };
        let is_object = body == AdroitBody::Object;
        let velocity = is_object.then(|| axes("v"));
        let angular_velocity = is_object.then(|| axes("w"));
        Self {
            time: table.column("t_s", mistakes),
            pose: ["x", "y", "z", "qx", "qy", "qz", "qw"]
                .map(|part| table.column(&format!("{prefix}_{part}"), mistakes)),
            velocity,
            angular_velocity,
            phase: table.column("phase", mistakes),
            n_contacts: table.column("n_con", mistakes),
            opposition: table.column("opp_deg", mistakes),
        }
    }

    fn row(&self, row: &Row, mistakes: &mut Mistakes) -> Option<BodyRow> {
        let t_s = row.number(&self.time, mistakes);
        let phase = row.word(&self.phase, &PHASES, PHASES_ALLOWED, mistakes);
        let n_contacts = row.optional(&self.n_contacts, mistakes).unwrap_or(0.0);
        let opposition_deg = row.optional(&self.opposition, mistakes);
        let velocity = self
            .velocity
            .as_ref()
            .and_then(|columns| vector(row, columns, mistakes));
        let angular_velocity = self
            .angular_velocity
            .as_ref()
            .and_then(|columns| vector(row, columns, mistakes));
        let pose = pose(row, &self.pose, mistakes)?;
        Some(BodyRow {
            t_s: t_s?,
            pose: y_up_pose(&pose),
            velocity,
            angular_velocity,
            phase: phase?,
            n_contacts: n_contacts.max(0.0) as u32,
            opposition_deg,
        })
    }
}

/// A pose of z-up body axes in z-up space as one of y-up body axes in y-up space.
fn y_up_pose(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let turn: UnitQuaternion<f64> = y_up_from_z_up();
    let place = Translation3::from(y_up_vector(&pose.translation.vector));
    Isometry3::from_parts(place, turn * pose.rotation * turn.inverse())
}

fn vector(row: &Row, columns: &[Column; 3], mistakes: &mut Mistakes) -> Option<Vector3<f64>> {
    match row.group(columns, mistakes) {
        Group::Values(values) => Some(y_up_vector(&Vector3::from(values))),
        Group::Absent | Group::Bad => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{own_data, shared_data};
    use super::*;

    #[test]
    fn the_cube_lies_upright_until_it_is_lifted() {
        let path = body_path(
            &own_data("adroit_pick_policy/cube_carry_07.csv"),
            AdroitBody::Object,
        )
        .unwrap();
        assert_eq!((path.len(), path[0].phase), (201, Phase::Approach));
        assert!(
            (path[0].pose.translation.vector - Vector3::new(0.04456, 0.028, -0.06496)).norm()
                < 1e-12
        );
        assert!(path[0].pose.rotation.angle() < 1e-7, "upright");
        let last = path.last().unwrap();
        assert_eq!(last.phase, Phase::Carried);
        assert!(last.pose.translation.y > 0.2 && last.n_contacts > 0 && last.velocity.is_some());
        assert!(
            path.windows(2).all(|rows| rows[0].phase <= rows[1].phase),
            "a phase never goes back"
        );
        // The recorded velocity is that of the path.
        for rows in path.windows(3) {
            let step = rows[2].pose.translation.vector - rows[0].pose.translation.vector;
            let off = step / 0.02 - rows[1].velocity.unwrap();
            assert!(off.norm() < 0.35, "{} {off}", rows[1].t_s);
        }
    }

    #[test]
    fn a_thrown_ball_falls_along_y() {
        let path = body_path(
            &own_data("adroit_pick_policy/ball_throw_01.csv"),
            AdroitBody::Object,
        )
        .unwrap();
        let flight: Vec<&BodyRow> = path.iter().filter(|row| row.phase == Phase::Free).collect();
        assert!(flight.len() > 10);
        for rows in flight.windows(2) {
            let fall = (rows[1].velocity.unwrap() - rows[0].velocity.unwrap()) / 0.01;
            assert!(
                (fall - Vector3::new(0.0, -9.755, 0.0)).norm() < 0.15,
                "{fall}"
            );
        }
    }

    #[test]
    fn the_doors_latch_and_leaf_have_paths() {
        let Some(text) = shared_data("adroit_door_human/door_11.csv") else {
            return;
        };
        let latch = body_path(&text, AdroitBody::Latch).unwrap();
        assert_eq!((latch.len(), latch[0].velocity), (236, None));
        assert!(
            latch
                .iter()
                .any(|row| row.phase == Phase::Turning && row.n_contacts > 1)
        );
        assert_eq!(body_path(&text, AdroitBody::Door).unwrap().len(), 236);
    }
}
