//! The reference tables of the Adroit sets: one row of results per run. Space is the project's: y up.

use nalgebra::Point3;

use super::y_up_point;
use crate::mistake::{ImportError, Mistakes};
use crate::table::{Column, Group, Row, Table};

/// The free objects of the pick runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdroitObject {
    /// A sphere.
    Ball,
    /// A cube.
    Cube,
    /// A box of three different edges.
    Brick,
}

/// Mass of every free object, kilograms.
pub const OBJECT_MASS_KG: f64 = 0.179_594;

/// How a pick run ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PickMode {
    /// Held at the target to the end.
    Carry,
    /// Let go at the target.
    Release,
    /// Thrown.
    Throw,
}

/// One row of the pick runs' `reference.csv`. Times in seconds; empty cells are `None`.
#[derive(Clone, Debug, PartialEq)]
pub struct PickReference {
    /// The run's name, that of its file without `.csv`.
    pub demo: String,
    /// What is picked.
    pub object: AdroitObject,
    /// How it ends.
    pub mode: PickMode,
    /// Where to carry it, world space, metres, y up.
    pub target: Point3<f64>,
    /// Lifted, and at the target for a quarter of a second.
    pub success: bool,
    /// The first contact.
    pub t_first_contact_s: Option<f64>,
    /// The start of the opposed contact that leads to the lift.
    pub t_grasp_s: Option<f64>,
    /// Off the table.
    pub t_lift_s: Option<f64>,
    /// At the target.
    pub t_at_target_s: Option<f64>,
    /// The first frame after the last one with opposed contacts: where a rule on normals lets go. Empty if held to the end.
    pub t_grasp_end_s: Option<f64>,
    /// The first frame after the last contact.
    pub t_release_s: Option<f64>,
    /// Down again.
    pub t_land_s: Option<f64>,
    /// How far the object is, at root mean square, from where it would be if it were fixed to the palm at the lift, metres.
    pub rigid_err_rms_m: Option<f64>,
    /// The same at worst, metres.
    pub rigid_err_max_m: Option<f64>,
    /// The same for its rotation, degrees.
    pub rigid_rot_err_max_deg: Option<f64>,
    /// Share of carried frames with opposed contacts.
    pub carried_opp90_frac: Option<f64>,
    /// Speed at the release, m/s.
    pub release_speed_m_s: Option<f64>,
    /// Where it landed, world space, metres, y up.
    pub land: Option<Point3<f64>>,
    /// Whether it fell in a carry run and was picked up again.
    pub dropped_in_carry: bool,
}

/// One row of the door recordings' `reference.csv`. Times in seconds; empty cells are `None`.
#[derive(Clone, Debug, PartialEq)]
pub struct DoorReference {
    /// The recording's name, that of its file without `.csv`.
    pub demo: String,
    /// Where the door's frame stands, world space, metres, y up.
    pub door_frame: Point3<f64>,
    /// The first contact with the latch.
    pub t_first_contact_s: Option<f64>,
    /// The start of the first run of opposed contact.
    pub t_grasp_s: Option<f64>,
    /// The latch turns.
    pub t_latch_turn_s: Option<f64>,
    /// The door opens.
    pub t_door_open_s: Option<f64>,
    /// After the last contact with the latch; `None` if held to the end.
    pub t_release_s: Option<f64>,
    /// Share of the frames in which the latch turns that have opposed contacts.
    pub turning_opp90_frac: Option<f64>,
    /// The same among all frames with contact.
    pub contact_opp90_frac: Option<f64>,
}

impl AdroitObject {
    /// Half edges along x, y and z, y up, metres; for the ball its radius thrice.
    pub const fn half_extents_m(self) -> [f64; 3] {
        match self {
            Self::Ball => [0.035, 0.035, 0.035],
            Self::Cube => [0.028, 0.028, 0.028],
            Self::Brick => [0.025, 0.030, 0.035],
        }
    }

    /// The name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ball => "ball",
            Self::Cube => "cube",
            Self::Brick => "brick",
        }
    }
}

const OBJECTS: [(&str, AdroitObject); 3] = [
    ("ball", AdroitObject::Ball),
    ("cube", AdroitObject::Cube),
    ("brick", AdroitObject::Brick),
];
const MODES: [(&str, PickMode); 3] = [
    ("carry", PickMode::Carry),
    ("release", PickMode::Release),
    ("throw", PickMode::Throw),
];
const FLAGS: [(&str, bool); 2] = [("0", false), ("1", true)];

/// The rows of the pick runs' `reference.csv`.
///
/// # Errors
/// Every mistake with its line and column, up to a limit.
pub fn pick_references(text: &str) -> Result<Vec<PickReference>, ImportError> {
    let mut mistakes = Mistakes::default();
    let table = Table::read(text, &mut mistakes)?;
    let fields = Fields { table: &table };
    fields.require(&PICK_COLUMNS, &mut mistakes);
    mistakes.check_header()?;
    let rows = table
        .rows
        .iter()
        .filter_map(|row| fields.pick(row, &mut mistakes))
        .collect();
    mistakes.check().map(|()| rows)
}

/// The rows of the door recordings' `reference.csv`.
///
/// # Errors
/// Every mistake with its line and column, up to a limit.
pub fn door_references(text: &str) -> Result<Vec<DoorReference>, ImportError> {
    let mut mistakes = Mistakes::default();
    let table = Table::read(text, &mut mistakes)?;
    let fields = Fields { table: &table };
    fields.require(&DOOR_COLUMNS, &mut mistakes);
    mistakes.check_header()?;
    let rows = table
        .rows
        .iter()
        .filter_map(|row| fields.door(row, &mut mistakes))
        .collect();
    mistakes.check().map(|()| rows)
}

const PICK_COLUMNS: [&str; 23] = [
    "demo",
    "object",
    "mode",
    "target_x_m",
    "target_y_m",
    "target_z_m",
    "success",
    "t_first_contact_s",
    "t_grasp_s",
    "t_lift_s",
    "t_at_target_s",
    "t_grasp_end_s",
    "t_release_s",
    "t_land_s",
    "rigid_err_rms_m",
    "rigid_err_max_m",
    "rigid_rot_err_max_deg",
    "carried_opp90_frac",
    "release_speed_m_s",
    "land_x_m",
    "land_y_m",
    "land_z_m",
    "dropped_in_carry",
];
const DOOR_COLUMNS: [&str; 11] = [
    "demo",
    "door_frame_x_m",
    "door_frame_y_m",
    "door_frame_z_m",
    "t_first_contact_s",
    "t_grasp_s",
    "t_latch_turn_s",
    "t_door_open_s",
    "t_release_s",
    "turning_opp90_frac",
    "contact_opp90_frac",
];

/// Cells by column name; a reference table has few rows.
struct Fields<'t> {
    table: &'t Table,
}

impl Fields<'_> {
    fn require(&self, names: &[&str], mistakes: &mut Mistakes) {
        for name in names {
            self.table.column(name, mistakes);
        }
    }

    /// A column that [`Self::require`] has found.
    fn column(&self, name: &str) -> Column {
        self.table.column(name, &mut Mistakes::default())
    }

    fn seconds(&self, row: &Row, name: &str, mistakes: &mut Mistakes) -> Option<f64> {
        row.optional(&self.column(name), mistakes)
    }

    fn place(&self, row: &Row, name: &str, mistakes: &mut Mistakes) -> Option<Point3<f64>> {
        let columns = ["x", "y", "z"].map(|axis| self.column(&format!("{name}_{axis}_m")));
        match row.group(&columns, mistakes) {
            Group::Values(values) => Some(y_up_point(&Point3::from(values))),
            Group::Absent | Group::Bad => None,
        }
    }

    fn flag(&self, row: &Row, name: &str, mistakes: &mut Mistakes) -> Option<bool> {
        row.word(&self.column(name), &FLAGS, "0, 1", mistakes)
    }

    fn pick(&self, row: &Row, mistakes: &mut Mistakes) -> Option<PickReference> {
        let object = row.word(
            &self.column("object"),
            &OBJECTS,
            "ball, cube, brick",
            mistakes,
        );
        let mode = row.word(
            &self.column("mode"),
            &MODES,
            "carry, release, throw",
            mistakes,
        );
        let target = self.place(row, "target", mistakes);
        let success = self.flag(row, "success", mistakes);
        let dropped_in_carry = self.flag(row, "dropped_in_carry", mistakes);
        let land = self.place(row, "land", mistakes);
        let mut number = |name| self.seconds(row, name, mistakes);
        Some(PickReference {
            demo: row.text(&self.column("demo")).to_owned(),
            object: object?,
            mode: mode?,
            target: target?,
            success: success?,
            t_first_contact_s: number("t_first_contact_s"),
            t_grasp_s: number("t_grasp_s"),
            t_lift_s: number("t_lift_s"),
            t_at_target_s: number("t_at_target_s"),
            t_grasp_end_s: number("t_grasp_end_s"),
            t_release_s: number("t_release_s"),
            t_land_s: number("t_land_s"),
            rigid_err_rms_m: number("rigid_err_rms_m"),
            rigid_err_max_m: number("rigid_err_max_m"),
            rigid_rot_err_max_deg: number("rigid_rot_err_max_deg"),
            carried_opp90_frac: number("carried_opp90_frac"),
            release_speed_m_s: number("release_speed_m_s"),
            land,
            dropped_in_carry: dropped_in_carry?,
        })
    }

    fn door(&self, row: &Row, mistakes: &mut Mistakes) -> Option<DoorReference> {
        let door_frame = self.place(row, "door_frame", mistakes);
        let mut number = |name| self.seconds(row, name, mistakes);
        Some(DoorReference {
            demo: row.text(&self.column("demo")).to_owned(),
            t_first_contact_s: number("t_first_contact_s"),
            t_grasp_s: number("t_grasp_s"),
            t_latch_turn_s: number("t_latch_turn_s"),
            t_door_open_s: number("t_door_open_s"),
            t_release_s: number("t_release_s"),
            turning_opp90_frac: number("turning_opp90_frac"),
            contact_opp90_frac: number("contact_opp90_frac"),
            door_frame: door_frame?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{own_data, shared_data};
    use super::*;

    #[test]
    fn references_are_typed() {
        let rows = pick_references(&own_data("adroit_pick_policy/reference.csv")).unwrap();
        let cube = rows.iter().find(|row| row.demo == "cube_carry_07").unwrap();
        assert_eq!(
            (cube.object, cube.mode, cube.success),
            (AdroitObject::Cube, PickMode::Carry, true)
        );
        assert_eq!(
            (cube.t_grasp_s, cube.t_lift_s, cube.t_release_s),
            (Some(0.25), Some(0.34), None)
        );
        assert_eq!(cube.target, Point3::new(0.00109, 0.24823, -0.09391));
        let ball = rows.iter().find(|row| row.demo == "ball_throw_01").unwrap();
        assert_eq!(
            (ball.t_grasp_end_s, ball.t_land_s),
            (Some(0.91), Some(1.16))
        );
        assert_eq!(ball.land, Some(Point3::new(0.11927, 0.03442, -0.89854)));
    }

    #[test]
    fn mistakes_are_named() {
        let text = own_data("adroit_pick_policy/reference.csv");
        let check = |text: &str, expected: &str| {
            assert_eq!(pick_references(text).unwrap_err().to_string(), expected);
        };
        check(
            &text.replace(",cube,", ",dice,"),
            "line 2, column object: \"dice\" is none of ball, cube, brick",
        );
        check(
            &text.replace("t_lift_s", "t_left_s"),
            "line 1, column t_lift_s: the column is missing",
        );
        check("", "line 1: the file is empty");
    }

    #[test]
    fn the_whole_tables_are_read() {
        let (Some(doors), Some(runs)) = (
            shared_data("adroit_door_human/reference.csv"),
            shared_data("adroit_pick_policy/reference.csv"),
        ) else {
            return;
        };
        let rows = door_references(&doors).unwrap();
        assert_eq!(
            (rows.len(), rows[6].demo.as_str(), rows[6].t_grasp_s),
            (15, "door_11", Some(0.57))
        );
        assert_eq!(rows[0].t_release_s, None);
        assert_eq!(pick_references(&runs).unwrap().len(), 36);
    }
}
